//! What recording came to.

use std::collections::BTreeSet;
use std::path::PathBuf;

use isotherm_log::recording::JournalAccount;
use serde::Serialize;
use tokio::time::Instant;

use super::queue::{Queue, TopicCount};
use super::writer::Done;

/// Why a recording ended.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum EndedBy {
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

/// What recording came to.
#[derive(Debug, Clone, Default, Serialize)]
pub struct RecordReport {
    /// Files that are there, oldest first.
    pub files: Vec<PathBuf>,
    /// Files deleted to keep only the newest.
    pub files_deleted: u64,
    /// Why it ended.
    pub ended_by: EndedBy,
    /// How long it took, from the first file's beginning (s).
    pub elapsed_s: f64,
    /// Messages that came in.
    pub received: u64,
    /// Of these, in a file.
    pub written: u64,
    /// Of these, in no file.
    pub lost: u64,
    /// Length of all files written, of deleted ones too (bytes).
    pub file_bytes: u64,
    /// By key.
    pub topics: Vec<TopicCount>,
    /// Files attached, in each recording file anew.
    pub attachments: u64,
    /// What the journals came to.
    pub journal: JournalAccount,
    /// Units that were recorded but cannot be corrected again from this recording alone: nothing says what they knew.
    pub units_without_memory: Vec<String>,
    /// Units of which corrected messages were recorded but nothing raw, though it was asked for: producers do not reach the
    /// recorder.
    pub units_without_raw: Vec<String>,
    /// Services that were there, by instance.
    pub services: BTreeSet<String>,
    /// What somebody should know.
    pub warnings: Vec<String>,
    /// Why nothing more could be written.
    pub failure: Option<String>,
}

impl RecordReport {
    /// Whether anything was lost.
    #[must_use]
    pub fn lost_data(&self) -> bool {
        self.lost > 0 || self.failure.is_some()
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
    let Done { files, deleted, attachments, journal, without_memory, without_raw, failure } = done;
    let length = |path: &PathBuf| std::fs::metadata(path).map_or(0, |metadata| metadata.len());
    if deleted == 0 {
        // With the summaries.
        report.file_bytes = files.iter().map(length).sum();
    }
    (report.files, report.files_deleted, report.attachments) = (files, deleted, attachments);
    report.journal = journal;
    if with_service {
        report.units_without_memory = without_memory;
        report.units_without_raw = without_raw;
    }
    if let Some(error) = failure {
        report.failure = Some(error.to_string());
        report.ended_by = EndedBy::Failure;
    }
}
