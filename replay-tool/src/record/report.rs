//! What recording came to.

use std::collections::BTreeSet;
use std::path::PathBuf;

use isotherm_log::recording::JournalAccount;
use serde::Serialize;
use tokio::time::Instant;

use super::queue::{Queue, TopicCount};

/// Why a recording ended.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum EndedBy {
    /// It goes on.
    #[default]
    Nothing,
    /// Ctrl-C or a stop signal.
    Signal,
    /// The time asked for is over.
    Duration,
    /// The last service has stopped.
    ServiceStop,
    /// Nothing more could be written.
    Failure,
}

/// What was written.
#[derive(Debug, Clone, Default, Serialize)]
pub(crate) struct Done {
    /// Files that are there, oldest first.
    pub(crate) files: Vec<PathBuf>,
    /// Files deleted to keep only the newest.
    pub(crate) files_deleted: u64,
    /// Files attached, in each recording file anew.
    pub(crate) attachments: u64,
    /// What the journals came to.
    pub(crate) journal: JournalAccount,
    /// Units that were recorded but cannot be corrected again from this recording alone: nothing says what they knew.
    pub(crate) units_without_memory: Vec<String>,
    /// Units of which corrected messages were recorded but nothing raw, though it was asked for: producers do not reach the
    /// recorder.
    pub(crate) units_without_raw: Vec<String>,
    /// Why nothing more could be written.
    pub(crate) failure: Option<String>,
}

/// What recording came to.
#[derive(Debug, Clone, Default, Serialize)]
pub(crate) struct RecordReport {
    /// What was written; nothing before the end.
    #[serde(flatten)]
    pub(crate) done: Done,
    /// Why it ended.
    pub(crate) ended_by: EndedBy,
    /// How long it took, from the first file's beginning (s).
    pub(crate) elapsed_s: f64,
    /// Messages that came in.
    pub(crate) received: u64,
    /// Of these, in a file.
    pub(crate) written: u64,
    /// Of these, in no file.
    pub(crate) lost: u64,
    /// Length of all files written, of deleted ones too (bytes).
    pub(crate) file_bytes: u64,
    /// By key.
    pub(crate) topics: Vec<TopicCount>,
    /// Services that were there, by instance.
    pub(crate) services: BTreeSet<String>,
    /// What somebody should know.
    pub(crate) warnings: Vec<String>,
}

impl RecordReport {
    /// Whether anything was lost.
    #[must_use]
    pub(crate) fn lost_data(&self) -> bool {
        self.lost > 0 || self.done.failure.is_some()
    }
}

/// The figures of the moment.
pub(super) fn fill(report: &mut RecordReport, queue: &Queue, begun: Instant) {
    let (topics, nameless, file_bytes) = queue.counts();
    let sum = |count: fn(&TopicCount) -> u64| topics.iter().map(count).sum::<u64>();
    report.received = sum(|count| count.received) + nameless;
    report.written = sum(|count| count.written);
    report.lost = sum(|count| count.lost) + nameless;
    report.elapsed_s = begun.elapsed().as_secs_f64();
    report.file_bytes = file_bytes;
    report.topics = topics;
}

/// What the writing thread has done.
pub(super) fn finish(report: &mut RecordReport, done: Done, with_service: bool) {
    let length = |path: &PathBuf| std::fs::metadata(path).map_or(0, |metadata| metadata.len());
    if done.files_deleted == 0 {
        // With the summaries.
        report.file_bytes = done.files.iter().map(length).sum();
    }
    if done.failure.is_some() {
        report.ended_by = EndedBy::Failure;
    }
    report.done = done;
    if !with_service {
        (report.done.units_without_memory, report.done.units_without_raw) = (Vec::new(), Vec::new());
    }
}
