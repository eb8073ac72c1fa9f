//! The chain's figures as tables.

use std::fmt::Write as _;

use super::case::Beside;
use super::{Measure, Report, Row};

/// A column: its head, and what stands in it of a row among others.
type Column = (&'static str, fn(&Row, &[&Row]) -> String);

const LATENCY: [Column; 11] = [
    ("p50 µs", |row, _| format!("{:.0}", row.median.latency_us[0])),
    ("p90", |row, _| format!("{:.0}", row.median.latency_us[1])),
    ("p99", |row, _| format!("{:.0}", row.median.latency_us[2])),
    ("p99.9", |row, _| format!("{:.0}", row.median.latency_us[3])),
    ("p50 ratio", |row, _| format!("{:.2}×", row.latency_ratio[0])),
    ("p99 ratio", |row, _| format!("{:.2}×", row.latency_ratio[2])),
    LOST,
    ("CPU µs/tick", |row, _| format!("{:.2}", row.median.cpu_us_per_tick)),
    ("ratio", |row, _| format!("{:.2}×", row.cpu_ratio)),
    ("source late µs", |row, _| format!("{:.0}", row.median.source_late_us[1])),
    ("swaps", |row, _| match row.case.beside {
        Some(Beside::Swaps) => row.median.swaps_per_unit.to_string(),
        _ => String::new(),
    }),
];

const THROUGHPUT: [Column; 6] = [
    ("messages/s", |row, _| format!("{:.0}", row.median.messages_per_s)),
    TICKS,
    ("ratio", |row, _| format!("{:.2}×", row.throughput_ratio)),
    LOST,
    CPU,
    ("cores", |row, _| format!("{:.2}", row.median.cpu_share)),
];

const UNITS: [Column; 7] = [
    TICKS,
    CPU,
    LOST,
    ("resident MiB", |row, _| format!("{:.1}", kib(row) / 1024.0)),
    ("KiB per further unit", per_further_unit),
    ("start s", |row, _| format!("{:.2}", row.median.start_s)),
    ("swap ms", |row, _| format!("{:.1}", row.median.swap_ms)),
];

const LOST: Column = ("lost", |row, _| row.median.lost.to_string());
const TICKS: Column = ("ticks/s", |row, _| format!("{:.0}", row.median.ticks_per_s));
const CPU: Column = ("CPU µs/tick", |row, _| format!("{:.3}", row.median.cpu_us_per_tick));

/// Latency first, then throughput.
pub(crate) fn table(report: &Report) -> String {
    let mut text = format!("{}\n", report.machine.words());
    let is_paced = |measure| !matches!(measure, Measure::Saturation | Measure::Units);
    lines(&mut text, report, is_paced, &LATENCY);
    lines(&mut text, report, |measure| measure == Measure::Saturation, &THROUGHPUT);
    lines(&mut text, report, |measure| measure == Measure::Units, &UNITS);
    for words in &report.skipped {
        let _ = writeln!(text, "\nskipped: {words}");
    }
    text
}

/// The rows of some measures, if there are any, as a table.
fn lines(text: &mut String, report: &Report, is: impl Fn(Measure) -> bool, columns: &[Column]) {
    let rows: Vec<&Row> = report.rows.iter().filter(|row| is(row.measure)).collect();
    if rows.is_empty() {
        return;
    }
    let head = ["load", "in the middle"].into_iter().chain(columns.iter().map(|(head, _)| *head));
    let mut last = "";
    let cells = rows.iter().map(|row| {
        let name = if row.name == last { String::new() } else { row.name.clone() };
        last = &row.name;
        let cells = columns.iter().map(|(_, cell)| cell(row, &rows));
        [name, middle(row)].into_iter().chain(cells).collect::<Vec<_>>()
    });
    let _ = writeln!(text, "\n{}", isotherm_cli::table(head, cells, 1..));
}

/// What stands in the middle, with settings that are not the project's own.
fn middle(row: &Row) -> String {
    match row.profile.as_str() {
        "default" => row.subject.name().to_owned(),
        profile => format!("{}, {profile}", row.subject.name()),
    }
}

/// Resident memory (KiB).
#[expect(clippy::cast_precision_loss, reason = "far below 2⁵³")]
fn kib(row: &Row) -> f64 {
    row.median.resident_kib as f64
}

/// What each unit takes beyond those of the case with fewest: one unit has what all share too.
#[expect(clippy::cast_precision_loss, reason = "far below 2⁵³")]
fn per_further_unit(row: &Row, rows: &[&Row]) -> String {
    let is_first = |first: &&&Row| first.subject == row.subject && first.case.units < row.case.units;
    let first = rows.iter().find(is_first);
    first.map_or_else(String::new, |first| {
        format!("{:.1}", (kib(row) - kib(first)) / (row.case.units - first.case.units) as f64)
    })
}
