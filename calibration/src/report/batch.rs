//! Several units at once, and the table that closes them.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;

use isotherm_pages::{Page, Table};
use serde_json::{Value, json};

use super::FitReport;
use super::verdict::Verdict;
use crate::report::{short, table};

/// What a report gives to a batch: what is said of one unit by itself, and its rows in the table that closes all of them.
pub trait UnitReport {
    /// Heads of the columns between the unit and what came of it.
    const COLUMNS: &'static [&'static str];
    /// What is said of a sensor that was not refused.
    const DONE: &'static str;

    /// Everything as text.
    fn to_text(&self) -> String;
    /// Everything as JSON.
    fn to_json(&self) -> Value;
    /// Everything as a page.
    fn to_html(&self) -> String;
    /// What was refused and why, for the end of a command.
    fn refusals(&self) -> Vec<String>;
    /// A row for each sensor.
    fn rows(&self) -> Vec<BatchRow>;
}

/// One sensor in the table.
#[derive(Debug, Clone, PartialEq)]
pub struct BatchRow {
    /// A cell for each of [`UnitReport::COLUMNS`].
    pub cells: Vec<String>,
    /// Whether it was not refused.
    pub accepted: bool,
    /// What came of it, in words.
    pub state: String,
    /// The same as JSON.
    pub json: Value,
}

/// One row per unit and sensor.
#[derive(Debug, Clone, PartialEq)]
pub struct BatchTable {
    columns: &'static [&'static str],
    done: &'static str,
    units: Vec<(String, Result<Vec<BatchRow>, String>)>,
}

impl BatchTable {
    /// An empty one for reports of a kind.
    pub fn of<R: UnitReport>() -> Self {
        Self { columns: R::COLUMNS, done: R::DONE, units: Vec::new() }
    }

    /// Adds a unit with its rows, or with why there are none.
    pub fn add(&mut self, unit: impl Into<String>, came: Result<Vec<BatchRow>, String>) {
        self.units.push((unit.into(), came));
    }

    /// Sensors accepted, sensors refused, units that came to nothing.
    pub fn counts(&self) -> [usize; 3] {
        let rows = || self.units.iter().filter_map(|(_, came)| came.as_ref().ok()).flatten();
        let accepted = rows().filter(|row| row.accepted).count();
        let failed = self.units.iter().filter(|(_, came)| came.is_err()).count();
        [accepted, rows().count() - accepted, failed]
    }

    /// What came of all of them, in one line.
    pub fn headline(&self) -> String {
        let [accepted, refused, failed] = self.counts();
        let count = self.units.len();
        let units = if count == 1 { "unit" } else { "units" };
        let failed = if failed == 0 { String::new() } else { format!(", {failed} of the units failed") };
        format!("{count} {units}: {accepted} of {} sensors {}{failed}.", accepted + refused, self.done)
    }

    /// As a table.
    pub fn rows(&self) -> Table {
        let head = ["unit"].iter().chain(self.columns).chain(&[""]).copied();
        let mut rows = Vec::new();
        for (unit, came) in &self.units {
            match came {
                Ok(own) => rows.extend(own.iter().map(|row| {
                    let mut cells = vec![unit.clone()];
                    cells.extend(row.cells.iter().cloned());
                    cells.push(row.state.clone());
                    cells
                })),
                Err(why) => {
                    let mut row = vec![unit.clone()];
                    row.resize(self.columns.len() + 1, "–".to_owned());
                    row.push(format!("failed: {why}"));
                    rows.push(row);
                }
            }
        }
        Table::of(head, rows)
    }

    /// As text, its line first.
    pub fn to_text(&self) -> String {
        let Table { head, rows } = self.rows();
        format!("{}\n{}\n", self.headline(), table(&head, &rows))
    }

    /// As JSON.
    pub fn to_json(&self) -> Value {
        let unit = |(unit, came): &(String, Result<Vec<BatchRow>, String>)| match came {
            Ok(rows) => {
                json!({ "unit": unit, "verdicts": rows.iter().map(|row| row.json.clone()).collect::<Vec<_>>() })
            }
            Err(why) => json!({ "unit": unit, "failed": why }),
        };
        json!({ "verdict": self.headline(), "units": self.units.iter().map(unit).collect::<Vec<_>>() })
    }

    /// As a page.
    pub fn to_html(&self, title: &str) -> String {
        let mut page = Page::new(title);
        page.headline(&self.headline());
        page.table(&self.rows());
        page.to_html()
    }
}

impl UnitReport for FitReport {
    const COLUMNS: &'static [&'static str] =
        &["of", "rms before", "after", "peak to peak before", "after", "measure", "sample"];
    const DONE: &'static str = "accepted";

    fn to_text(&self) -> String {
        Self::to_text(self)
    }

    fn to_json(&self) -> Value {
        Self::to_json(self)
    }

    fn to_html(&self) -> String {
        Self::to_html(self)
    }

    fn refusals(&self) -> Vec<String> {
        Self::refusals(self)
    }

    fn rows(&self) -> Vec<BatchRow> {
        self.verdicts.iter().map(BatchRow::from).collect()
    }
}

impl From<&Verdict> for BatchRow {
    fn from(verdict: &Verdict) -> Self {
        let [before, after] = verdict.deciding();
        let known = before.count > 0 || after.count > 0;
        let figure = |value: f64| if known { short(value) } else { "–".to_owned() };
        let state = verdict.state();
        Self {
            cells: vec![
                verdict.of.clone(),
                figure(before.rms),
                figure(after.rms),
                figure(before.peak_to_peak),
                figure(after.peak_to_peak),
                verdict.measure.clone(),
                if verdict.out_of_sample.is_some() { "out" } else { "in" }.to_owned(),
            ],
            accepted: verdict.accepted,
            state: if verdict.reason.is_empty() {
                state.to_owned()
            } else {
                format!("{state}: {}", verdict.reason)
            },
            json: verdict.to_json(),
        }
    }
}

/// Does the same to every item, as many at a time as there are processors; what comes out stands in the order of the items,
/// whoever was ready first. `done` is told how many are, from whichever thread was.
pub fn in_parallel<T: Sync, R: Send>(
    items: &[T],
    done: impl Fn(usize) + Sync,
    each: impl Fn(&T) -> R + Sync,
) -> Vec<R> {
    let threads = thread::available_parallelism().map_or(1, usize::from).min(items.len());
    let (next, ready) = (AtomicUsize::new(0), AtomicUsize::new(0));
    let work = || {
        let mut mine = Vec::new();
        loop {
            let index = next.fetch_add(1, Ordering::Relaxed);
            let Some(item) = items.get(index) else { return mine };
            mine.push((index, each(item)));
            done(ready.fetch_add(1, Ordering::Relaxed) + 1);
        }
    };
    let mut made: Vec<(usize, R)> = thread::scope(|scope| {
        let running: Vec<_> = (0..threads).map(|_| scope.spawn(work)).collect();
        let joined = running
            .into_iter()
            .map(|thread| thread.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)));
        joined.flatten().collect()
    });
    made.sort_by_key(|(index, _)| *index);
    made.into_iter().map(|(_, result)| result).collect()
}

/// The name of a unit's own file in a batch: "fit.html" of unit A is "fit-A.html".
pub fn of_unit(path: &Path, unit: &str) -> PathBuf {
    let stem = path.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
    let name = match path.extension() {
        Some(extension) => format!("{stem}-{unit}.{}", extension.to_string_lossy()),
        None => format!("{stem}-{unit}"),
    };
    path.with_file_name(name)
}
