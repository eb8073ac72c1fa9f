//! Summaries as tables and as JSON.

use std::io::{self, Write};
use std::ops::RangeBounds;

use comfy_table::Row;
use serde::Serialize;

use isotherm_log::text::ReadReport;

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
pub(super) fn warn(words: &str) {
    // A reader that has gone away is no error.
    let _ = writeln!(io::stderr(), "warning: {words}");
}

/// One JSON object on one line.
pub(super) fn json(value: &impl Serialize) -> String {
    // The values are plain structures of numbers and texts, which always serialise.
    serde_json::to_string(value).map(|text| text + "\n").unwrap_or_default()
}

/// What reading the log came to, in words; empty where there is nothing to say.
pub(super) fn reading(report: &ReadReport) -> String {
    let mut text = String::new();
    if report.skipped_rows > 0 {
        let first = report.first_skipped.as_deref().unwrap_or_default();
        let rows = report.skipped_rows;
        text.push_str(
            &[&rows.to_string(), " rows could not be read and were skipped; the first:\n  ", first, "\n"]
                .concat(),
        );
    }
    if report.bad_status_rows > 0 {
        let rows = report.bad_status_rows.to_string();
        text.push_str(&[&rows, " rows were skipped because of their status\n"].concat());
    }
    if report.cut_short {
        text += "the compressed log is cut short; everything before the end has been used\n";
    }
    if report.unterminated_last_line {
        text += "the log's last line has no line end: its last cell may be cut\n";
    }
    text
}
