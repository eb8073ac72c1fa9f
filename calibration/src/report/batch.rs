//! Several units at once, and the table that closes them.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;

use isotherm_pages::{Page, Table};
use serde_json::{Value, json};

use super::{Report, Verdict, counted, table};
use crate::error::Error;

/// Several units, each with its report or with why there is none, and the table that closes them.
#[derive(Debug, Clone, Copy)]
pub struct Batch<'a>(pub &'a [(String, Result<Report, Error>)]);

impl Batch<'_> {
    fn reports(&self) -> impl Iterator<Item = &Report> {
        self.0.iter().filter_map(|(_, came)| came.as_ref().ok())
    }

    /// Sensors accepted, sensors refused, units failed.
    pub fn counts(&self) -> [usize; 3] {
        let verdicts = || self.reports().flat_map(|report| &report.verdicts);
        let accepted = verdicts().filter(|verdict| verdict.accepted).count();
        [accepted, verdicts().count() - accepted, self.0.iter().filter(|(_, came)| came.is_err()).count()]
    }

    /// The first line.
    pub fn headline(&self) -> String {
        let [accepted, refused, failed] = self.counts();
        let failed = if failed == 0 { String::new() } else { format!(", {failed} of the units failed") };
        let fitted = self.reports().all(|report| report.summary.is_none());
        format!(
            "{}: {accepted} of {} sensors {}{failed}.",
            counted(self.0.len(), "unit", "units"),
            accepted + refused,
            if fitted { "accepted" } else { "analysed" }
        )
    }

    /// A row for each sensor of each unit, and one for each unit that failed.
    pub fn rows(&self) -> Table {
        let head = self.reports().next().map(|report| report.rows(true).head).unwrap_or_default();
        let mut rows = Vec::new();
        for (unit, came) in self.0 {
            match came {
                Ok(report) => {
                    let own = report.rows(true).rows.into_iter();
                    rows.extend(own.map(|row| [vec![unit.clone()], row].concat()));
                }
                Err(why) => {
                    let mut row = vec![unit.clone()];
                    row.resize(head.len().max(1), "–".to_owned());
                    row.push(format!("failed: {why}"));
                    rows.push(row);
                }
            }
        }
        Table::of(["unit".to_owned()].into_iter().chain(head), rows)
    }

    /// Everything as text.
    pub fn to_text(&self) -> String {
        format!("{}\n{}\n", self.headline(), table(&self.rows()))
    }

    /// Everything as JSON.
    pub fn to_json(&self) -> Value {
        let unit = |(unit, came): &(String, Result<Report, Error>)| match came {
            Ok(report) => {
                json!({ "unit": unit, "verdicts": report.verdicts.iter().map(Verdict::to_json).collect::<Vec<_>>() })
            }
            Err(why) => json!({ "unit": unit, "failed": why.to_string() }),
        };
        json!({ "verdict": self.headline(), "units": self.0.iter().map(unit).collect::<Vec<_>>() })
    }

    /// Everything as a page.
    pub fn to_html(&self, title: &str) -> String {
        let mut page = Page::new(title);
        page.headline(&self.headline());
        page.table(&self.rows());
        page.to_html()
    }
}

/// Does the same to every item, as many at a time as there are processors; what comes out stands in the order of the items,
/// whoever was ready first.
pub fn in_parallel<T: Sync, R: Send>(items: &[T], each: impl Fn(&T) -> R + Sync) -> Vec<R> {
    let threads = thread::available_parallelism().map_or(1, usize::from).min(items.len());
    let next = AtomicUsize::new(0);
    let work = || {
        let mut mine = Vec::new();
        loop {
            let index = next.fetch_add(1, Ordering::Relaxed);
            let Some(item) = items.get(index) else { return mine };
            mine.push((index, each(item)));
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
