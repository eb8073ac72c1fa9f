//! The chain's figures as tables.

use std::fmt::Write as _;

use comfy_table::Table;

use super::case::Beside;
use super::{Measure, Report, Row};
use crate::cli::plain;

/// Latency first, then throughput.
pub(crate) fn table(report: &Report) -> String {
    let saturated = |row: &&Row| row.measure == Measure::Saturation;
    let mut text = format!("{}\n", report.machine.words());
    let paced: Vec<&Row> = report.rows.iter().filter(|row| !saturated(row)).collect();
    if !paced.is_empty() {
        let _ = writeln!(text, "\n{}", latency(&paced));
    }
    let saturated: Vec<&Row> = report.rows.iter().filter(saturated).collect();
    if !saturated.is_empty() {
        let _ = writeln!(text, "\n{}", throughput(&saturated));
    }
    for words in &report.skipped {
        let _ = writeln!(text, "\nskipped: {words}");
    }
    text
}

/// What stands in the middle, with settings that are not the project's own.
pub(crate) fn middle(row: &Row) -> String {
    match row.profile.as_str() {
        "default" => row.subject.name().to_owned(),
        profile => format!("{}, {profile}", row.subject.name()),
    }
}

fn latency(rows: &[&Row]) -> Table {
    let mut table = plain(&[
        "load",
        "in the middle",
        "p50 µs",
        "p90",
        "p99",
        "p99.9",
        "p50 ratio",
        "p99 ratio",
        "lost",
        "CPU µs/tick",
        "ratio",
        "source late µs",
        "swaps",
    ]);
    let mut last = "";
    for row in rows {
        let [p50, p90, p99, p999] = row.median.latency_us;
        let [half, .., ratio, _] = row.latency_ratio;
        table.add_row([
            if row.name == last { String::new() } else { row.name.clone() },
            middle(row),
            format!("{p50:.0}"),
            format!("{p90:.0}"),
            format!("{p99:.0}"),
            format!("{p999:.0}"),
            format!("{half:.2}×"),
            format!("{ratio:.2}×"),
            row.median.lost.to_string(),
            format!("{:.2}", row.median.cpu_us_per_tick),
            format!("{:.2}×", row.cpu_ratio),
            format!("{:.0}", row.median.source_late_us[1]),
            if row.case.beside == Some(Beside::Swaps) {
                row.median.swaps_per_unit.to_string()
            } else {
                String::new()
            },
        ]);
        last = &row.name;
    }
    table
}

fn throughput(rows: &[&Row]) -> Table {
    let mut table =
        plain(&["load", "in the middle", "messages/s", "ticks/s", "ratio", "lost", "CPU µs/tick", "cores"]);
    let mut last = "";
    for row in rows {
        table.add_row([
            if row.name == last { String::new() } else { row.name.clone() },
            middle(row),
            format!("{:.0}", row.median.messages_per_s),
            format!("{:.0}", row.median.ticks_per_s),
            format!("{:.2}×", row.throughput_ratio),
            row.median.lost.to_string(),
            format!("{:.3}", row.median.cpu_us_per_tick),
            format!("{:.2}", row.median.cpu_share),
        ]);
        last = &row.name;
    }
    table
}
