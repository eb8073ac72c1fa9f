//! Summaries as tables and as JSON.

use std::fmt::{Display, Write};
use std::ops::RangeBounds;
use std::path::PathBuf;

use comfy_table::Row;
use isotherm_cli::say_lines;
use isotherm_log::source::LogReport;
use serde::Serialize;

/// A table of two columns, figures to the right.
pub(super) fn table(rows: &[(&str, String)]) -> String {
    let rows = rows.iter().map(|(name, figure)| [*name, figure.as_str()]);
    grid([""; 0], rows, 1..)
}

/// A table of the three case axes.
pub(super) fn axes(rows: &[(&str, [f64; 3], usize)]) -> String {
    let row = |(name, values, digits): &(&str, [f64; 3], usize)| {
        std::iter::once((*name).to_owned()).chain(values.map(|value| format!("{value:.digits$}")))
    };
    grid(["", "x", "y", "z"], rows.iter().map(row), 1..)
}

/// A table with a line end; columns in `right` are aligned to the right.
pub(super) fn grid<R: Into<Row>>(
    head: impl Into<Row>,
    rows: impl IntoIterator<Item = R>,
    right: impl RangeBounds<usize>,
) -> String {
    format!("{}\n", isotherm_cli::table(head, rows, right))
}

/// A warning on standard error.
pub(super) fn warn(words: impl Display) {
    say_lines(format_args!("warning: {words}"));
}

/// One JSON object on one line.
pub(super) fn json(value: &impl Serialize) -> String {
    // The values are plain structures of numbers and texts, which always serialise.
    serde_json::to_string(value).map(|text| text + "\n").unwrap_or_default()
}

/// Files by their names.
pub(super) fn names(paths: &[PathBuf]) -> String {
    let names: Vec<_> = paths.iter().map(|path| path.display().to_string()).collect();
    names.join(", ")
}

/// The head of a document's digest.
pub(super) fn hexadecimal(digest: [u8; 8]) -> String {
    format!("{:016x}", u64::from_be_bytes(digest))
}

/// What reading a log came to, in words; empty where there is nothing to say.
pub(super) fn reading(report: &LogReport) -> String {
    let mut text = String::new();
    let report = match report {
        LogReport::Text(report) => report,
        LogReport::Recording(report) => {
            if let Some(words) = &report.cut_short {
                let _ = writeln!(text, "not read to the end: {words}; everything before it has been used");
            }
            if report.foreign_messages > 0 {
                let _ = writeln!(text, "{} messages of other programs were skipped", report.foreign_messages);
            }
            return text;
        }
    };
    if report.skipped_rows > 0 {
        let (rows, first) = (report.skipped_rows, report.first_skipped.as_deref().unwrap_or_default());
        let _ = writeln!(text, "{rows} rows could not be read and were skipped; the first:\n  {first}");
    }
    if report.bad_status_rows > 0 {
        let _ = writeln!(text, "{} rows were skipped because of their status", report.bad_status_rows);
    }
    if report.repeated_rows > 0 {
        let _ = writeln!(text, "{} rows repeat the row before them and were dropped", report.repeated_rows);
    }
    if report.midnights > 0 {
        let _ = writeln!(
            text,
            "midnights passed by times without a date, after each the next day: {}",
            report.midnights
        );
    }
    if report.rows_of_others > 0 {
        let _ = writeln!(text, "{} rows are of other units", report.rows_of_others);
    }
    if report.cut_short {
        text += "the compressed log is cut short; everything before the end has been used\n";
    }
    if report.unterminated_last_line {
        text += "the log's last line has no line end: its last cell may be cut\n";
    }
    text
}
