//! Figures of a recording: while it runs, on a terminal; at its end.

use std::collections::BTreeMap;

use isotherm_bus::BusError;
use isotherm_cli::Bar;

use crate::cli::show;
use crate::error::Error;
use crate::record::{EndedBy, RecordOptions, RecordReport, ServiceWait, TopicCount};

/// Topics that are shown one by one; more are shown by kind.
const MOST_ROWS: usize = 24;

/// The figures on a terminal; nothing where there is none.
#[derive(Debug)]
pub(super) struct Live {
    lines: Bar,
    /// Messages and bytes, and when they were looked at (s).
    before: (u64, u64, f64),
    /// Warnings that have been printed.
    warned: usize,
}

impl Live {
    /// Nothing yet.
    pub(super) fn new() -> Self {
        Self { lines: Bar::lines(), before: (0, 0, 0.0), warned: 0 }
    }

    /// Shows them.
    pub(super) fn show(&mut self, report: &RecordReport) {
        self.warn(report);
        if self.lines.is_hidden() {
            return;
        }
        let (messages, bytes, at) = self.before;
        let seconds = (report.elapsed_s - at).max(1e-3);
        let rate = |now: u64, before: u64| float(now.saturating_sub(before)) / seconds;
        let line = format!(
            "{:.0} s  {:.0} messages/s  {}/s  {} in the file",
            report.elapsed_s,
            rate(report.received, messages),
            size(rate(report.file_bytes, bytes)),
            size(float(report.file_bytes)),
        );
        self.lines.say(topics(&report.topics) + &line);
        // Over a second and more, so that chunks even out.
        if seconds >= 2.0 {
            self.before = (report.received, report.file_bytes, report.elapsed_s);
        }
    }

    /// Prints warnings that have not been printed.
    pub(super) fn warn(&mut self, report: &RecordReport) {
        let new = report.warnings.get(self.warned..).unwrap_or_default();
        self.lines.beside(|| new.iter().for_each(show::warn));
        self.warned = report.warnings.len();
    }

    /// Takes them away.
    pub(super) fn finish(&self) {
        self.lines.finish();
    }
}

/// The summary as tables.
pub(super) fn human(report: &RecordReport) -> String {
    let ended_by = match report.ended_by {
        EndedBy::Nothing => "nothing",
        EndedBy::Signal => "signal",
        EndedBy::Duration => "--duration",
        EndedBy::ServiceStop => "the service has stopped",
        EndedBy::Failure => "writing failed",
    };
    let rate = float(report.received) / report.elapsed_s.max(1e-3);
    let mut rows = vec![
        ("ended by", ended_by.to_owned()),
        ("recorded (s)", format!("{:.3}", report.elapsed_s)),
        ("messages received", report.received.to_string()),
        ("written", report.written.to_string()),
        ("lost", report.lost.to_string()),
        ("messages per second", format!("{rate:.1}")),
        ("written to files", size(float(report.file_bytes))),
        ("attachments", report.done.attachments.to_string()),
        ("journal entries", report.done.journal.entries.to_string()),
        ("journal entries lost", report.done.journal.missing.to_string()),
    ];
    if report.done.files_deleted > 0 {
        rows.push(("older files deleted", report.done.files_deleted.to_string()));
    }
    let mut text = topics(&report.topics) + &show::table(&rows);
    for path in &report.done.files {
        text.push_str(&path.to_string_lossy());
        text.push('\n');
    }
    text
}

/// A table of topics.
fn topics(counts: &[TopicCount]) -> String {
    let mut rows: BTreeMap<String, [u64; 4]> = BTreeMap::new();
    for count in counts {
        let name = if counts.len() > MOST_ROWS { of_all(&count.topic) } else { count.topic.clone() };
        let row = rows.entry(name).or_default();
        let figures = [count.received, count.written, count.lost, count.bytes];
        row.iter_mut().zip(figures).for_each(|(sum, figure)| *sum += figure);
    }
    let row = |(name, figures): (String, [u64; 4])| {
        std::iter::once(name).chain(figures.map(|figure| figure.to_string()))
    };
    show::grid(["topic", "received", "written", "lost", "bytes"], rows.into_iter().map(row), 1..)
}

/// The topic of all units that this one is of.
fn of_all(topic: &str) -> String {
    let mut chunks: Vec<_> = topic.split('/').collect();
    if let Some(name) = chunks.get_mut(1) {
        *name = "*";
    }
    chunks.join("/")
}

/// Bytes for people.
fn size(bytes: f64) -> String {
    let units = [(1e9, "GB"), (1e6, "MB"), (1e3, "kB")];
    let found = units.iter().find(|(factor, _)| bytes >= *factor);
    found.map_or_else(|| format!("{bytes:.0} B"), |(factor, unit)| format!("{:.1} {unit}", bytes / factor))
}

#[expect(clippy::cast_precision_loss, reason = "for people")]
fn float(number: u64) -> f64 {
    number as f64
}

/// Adds what else could be done.
pub(super) fn advise(error: Error, options: &RecordOptions) -> Error {
    let waits = matches!(options.service, ServiceWait::Within(_));
    match error {
        Error::Bus(BusError::NoService { .. } | BusError::Unreachable { .. }) if waits => {
            let words = format!("{error}; wait for it with --wait, or record without one with --no-service");
            Error::Service(words)
        }
        error => error,
    }
}
