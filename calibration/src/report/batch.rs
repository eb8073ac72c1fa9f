//! Several units at once, and the table that closes them.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;

use isotherm_log::plot::page::{Page, Table};
use serde_json::{Value, json};

use super::verdict::Verdict;
use crate::drift::figures::{short, table};

/// One row per unit and sensor.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct BatchTable {
    units: Vec<(String, Result<Vec<Verdict>, String>)>,
}

impl BatchTable {
    /// Adds a unit with its verdicts, or with why there are none.
    pub fn add(&mut self, unit: impl Into<String>, came: Result<Vec<Verdict>, String>) {
        self.units.push((unit.into(), came));
    }

    /// Sensors accepted, sensors refused, units that came to nothing.
    #[must_use]
    pub fn counts(&self) -> [usize; 3] {
        let verdicts = || self.units.iter().filter_map(|(_, came)| came.as_ref().ok()).flatten();
        let accepted = verdicts().filter(|verdict| verdict.accepted).count();
        let failed = self.units.iter().filter(|(_, came)| came.is_err()).count();
        [accepted, verdicts().count() - accepted, failed]
    }

    /// What came of all of them, in one line.
    #[must_use]
    pub fn headline(&self) -> String {
        let [accepted, refused, failed] = self.counts();
        let count = self.units.len();
        let units = if count == 1 { "unit" } else { "units" };
        let failed =
            if failed == 0 { String::new() } else { format!(", {failed} of the units came to nothing") };
        format!("{count} {units}: {accepted} of {} sensors accepted{failed}.", accepted + refused)
    }

    /// As a table.
    #[must_use]
    pub fn rows(&self) -> Table {
        let head =
            ["unit", "of", "rms before", "after", "peak to peak before", "after", "measure", "sample", ""];
        let mut rows = Vec::new();
        for (unit, came) in &self.units {
            match came {
                Ok(verdicts) => rows.extend(verdicts.iter().map(|verdict| row(unit, verdict))),
                Err(why) => {
                    let mut row = vec![unit.clone()];
                    row.resize(head.len() - 1, "–".to_owned());
                    row.push(format!("failed: {why}"));
                    rows.push(row);
                }
            }
        }
        Table { head: head.map(str::to_owned).to_vec(), rows }
    }

    /// As text, its line first.
    #[must_use]
    pub fn to_text(&self) -> String {
        let Table { head, rows } = self.rows();
        format!("{}\n{}\n", self.headline(), table(&head, &rows))
    }

    /// As JSON.
    #[must_use]
    pub fn to_json(&self) -> Value {
        let unit = |(unit, came): &(String, Result<Vec<Verdict>, String>)| match came {
            Ok(verdicts) => {
                json!({ "unit": unit, "verdicts": verdicts.iter().map(Verdict::to_json).collect::<Vec<_>>() })
            }
            Err(why) => json!({ "unit": unit, "failed": why }),
        };
        json!({ "verdict": self.headline(), "units": self.units.iter().map(unit).collect::<Vec<_>>() })
    }

    /// As a page.
    #[must_use]
    pub fn to_html(&self, title: &str) -> String {
        let mut page = Page::new(title);
        page.headline(&self.headline());
        page.table(&self.rows());
        page.to_html()
    }
}

fn row(unit: &str, verdict: &Verdict) -> Vec<String> {
    let [before, after] = verdict.deciding();
    let known = before.count > 0 || after.count > 0;
    let figure = |value: f64| if known { short(value) } else { "–".to_owned() };
    let state = if verdict.accepted { "accepted" } else { "refused" };
    vec![
        unit.to_owned(),
        verdict.of.clone(),
        figure(before.rms),
        figure(after.rms),
        figure(before.peak_to_peak),
        figure(after.peak_to_peak),
        verdict.measure.clone(),
        if verdict.out_of_sample.is_some() { "out" } else { "in" }.to_owned(),
        if verdict.reason.is_empty() { state.to_owned() } else { format!("{state}: {}", verdict.reason) },
    ]
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
#[must_use]
pub fn of_unit(path: &Path, unit: &str) -> PathBuf {
    let stem = path.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
    let name = match path.extension() {
        Some(extension) => format!("{stem}-{unit}.{}", extension.to_string_lossy()),
        None => format!("{stem}-{unit}"),
    };
    path.with_file_name(name)
}
