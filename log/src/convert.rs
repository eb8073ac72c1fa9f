//! A log in another form: what it holds, its raw streams as rows, and what a conversion came to.
//!
//! A conversion reads its log twice. [`contents`] finds the units, their sensors and their channels, so that every
//! output knows its columns before the first row; then the messages are written out one by one. Memory depends on the
//! number of units, not on the length of the log.
//!
//! | module | holds |
//! |---|---|
//! | [`contents`] | what a log holds, by unit |
//! | [`decoded`] | a message of a log, decoded |
//! | [`rows`] | the raw streams of a unit, put in order of time |
//! | [`raw_text`] | these rows as a text log, with the mapping that reads it back |

pub mod contents;
pub mod decoded;
pub mod raw_text;
pub mod rows;

use std::collections::BTreeMap;
use std::path::PathBuf;

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
    pub fn add(&mut self, tally: &rows::Tally) {
        self.duplicates += tally.duplicates;
        self.lose("too late to be sorted", tally.late);
        self.lose("two different ticks or readings at one time", tally.conflicts);
    }

    /// Whether anything was lost.
    #[must_use]
    pub fn lost_data(&self) -> bool {
        !self.lost.is_empty()
    }
}

/// Adds to a count, which is there only above 0.
fn add(counts: &mut BTreeMap<&'static str, u64>, what: &'static str, count: u64) {
    if count > 0 {
        *counts.entry(what).or_default() += count;
    }
}
