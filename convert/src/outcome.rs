//! What a conversion came to.

use std::collections::BTreeMap;
use std::path::PathBuf;

use isotherm_log::source::LogReport;
use isotherm_log::streams::rows::Tally;
use serde::Serialize;

/// A file that a conversion wrote.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Written {
    /// Where it is.
    pub path: PathBuf,
    /// The unit that it is of; `None` for several.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unit: Option<String>,
    /// What it holds.
    pub what: &'static str,
    /// Its rows or messages.
    pub rows: u64,
}

/// What a conversion came to.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize)]
pub struct Converted {
    /// The files.
    pub files: Vec<Written>,
    /// Messages whose kind has no place in the target, by kind.
    pub left_out: BTreeMap<&'static str, u64>,
    /// Ticks and readings that came more than once; each is written once.
    pub duplicates: u64,
    /// What should have been written and could not be, by reason.
    pub lost: BTreeMap<&'static str, u64>,
    /// Topics of a ROS 2 bag.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub topics: Vec<crate::bag::BagTopic>,
    /// Units that have nothing in a ROS 2 bag, and why.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub notes: Vec<String>,
}

impl Converted {
    /// Counts something that has no place in the target.
    pub fn leave_out(&mut self, kind: &'static str, count: u64) {
        add(&mut self.left_out, kind, count);
    }

    /// Counts something that could not be written.
    pub fn lose(&mut self, reason: &'static str, count: u64) {
        add(&mut self.lost, reason, count);
    }

    /// Adds what became of a unit's rows.
    pub fn add(&mut self, tally: &Tally) {
        self.duplicates += tally.duplicates;
        self.lose("too late to be sorted", tally.late);
        self.lose("two different ticks or readings at one time", tally.conflicts);
    }
}

/// What a conversion came to, and the reading of its log.
#[derive(Debug, Clone, Serialize)]
pub struct Outcome {
    /// What was written, and what was not.
    #[serde(flatten)]
    pub converted: Converted,
    /// What reading the log came to.
    pub log: LogReport,
}

impl Outcome {
    /// Whether anything was lost, in the log or on the way.
    #[must_use]
    pub fn lost_data(&self) -> bool {
        !self.converted.lost.is_empty() || self.log.lost_data()
    }
}

/// Adds to a count, which is there only above 0.
fn add(counts: &mut BTreeMap<&'static str, u64>, what: &'static str, count: u64) {
    if count > 0 {
        *counts.entry(what).or_default() += count;
    }
}
