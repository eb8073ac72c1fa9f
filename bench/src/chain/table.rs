//! The chain's figures as tables.

use std::fmt::Write as _;

use comfy_table::Table;

use super::case::Beside;
use super::{Measure, Report, Row};
use crate::cli::plain;

/// Latency first, then throughput.
pub(crate) fn table(report: &Report) -> String {
    let is_paced = |row: &Row| !matches!(row.measure, Measure::Saturation | Measure::Units);
    let mut text = format!("{}\n", report.machine.words());
    let paced: Vec<&Row> = report.rows.iter().filter(|row| is_paced(row)).collect();
    if !paced.is_empty() {
        let _ = writeln!(text, "\n{}", latency(&paced));
    }
    let of = |measure| report.rows.iter().filter(move |row| row.measure == measure);
    let saturated: Vec<&Row> = of(Measure::Saturation).collect();
    if !saturated.is_empty() {
        let _ = writeln!(text, "\n{}", throughput(&saturated));
    }
    let by_units: Vec<&Row> = of(Measure::Units).collect();
    if !by_units.is_empty() {
        let _ = writeln!(text, "\n{}", units(&by_units));
    }
    for words in &report.skipped {
        let _ = writeln!(text, "\nskipped: {words}");
    }
    text
}

/// What stands in the middle, with settings that are not the project's own.
fn middle(row: &Row) -> String {
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

/// What a number of units takes.
#[expect(clippy::cast_precision_loss, reason = "far below 2⁵³")]
fn units(rows: &[&Row]) -> Table {
    let mut table = plain(&[
        "load",
        "in the middle",
        "ticks/s",
        "CPU µs/tick",
        "lost",
        "resident MiB",
        "KiB per further unit",
        "start s",
        "swap ms",
    ]);
    for row in rows {
        let (outcome, units) = (&row.median, row.case.units);
        // One unit has what all share too.
        let first = rows.iter().find(|first| first.subject == row.subject && first.case.units < units);
        let per_unit = first.map_or_else(String::new, |first| {
            let further_kib = outcome.resident_kib as f64 - first.median.resident_kib as f64;
            format!("{:.1}", further_kib / (units - first.case.units) as f64)
        });
        table.add_row([
            row.name.clone(),
            middle(row),
            format!("{:.0}", outcome.ticks_per_s),
            format!("{:.3}", outcome.cpu_us_per_tick),
            outcome.lost.to_string(),
            format!("{:.1}", outcome.resident_kib as f64 / 1024.0),
            per_unit,
            format!("{:.2}", outcome.start_s),
            format!("{:.1}", outcome.swap_ms),
        ]);
    }
    table
}
