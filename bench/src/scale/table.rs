//! The scale's figures as tables.

use std::fmt::Write as _;

use super::Report;
use crate::chain::{Row, middle};
use crate::cli::plain;

/// By number of units, then the greatest number at its rate, then offline.
pub(crate) fn table(report: &Report) -> String {
    let mut text = format!("{}\n", report.machine.words());
    if !report.units.is_empty() {
        let _ = writeln!(text, "\n{}", units(&report.units, &report.zenoh));
        for growth in &report.growth {
            let _ = writeln!(text, " exponent {:6.3}  {}", growth.exponent, growth.what);
        }
    }
    if !report.rated.is_empty() {
        let _ = writeln!(text, "\n{}", rated(&report.rated));
    }
    if let Some(offline) = &report.offline {
        let _ = writeln!(text, "\n{}", offline_table(offline));
    }
    for words in &report.skipped {
        let _ = writeln!(text, "\nskipped: {words}");
    }
    text
}

/// Columns of the figures by number of units.
const BY_UNITS: [&str; 10] = [
    "units",
    "ticks/s",
    "CPU µs/tick",
    "lost",
    "resident MiB",
    "KiB per unit",
    "start s",
    "swap ms",
    "Zenoh alone: CPU µs/tick",
    "KiB per unit",
];

/// What Zenoh takes by itself where the service has so many units.
fn alone<'a>(service: &Row, zenoh: &'a [Row]) -> Option<&'a Row> {
    zenoh.iter().find(|row| row.case.units == service.case.units)
}

/// Resident memory per unit beyond the first row's, in words; none of that row itself.
fn beyond_first(row: &Row, rows: &[Row]) -> String {
    let first = rows.first().filter(|first| first.case.units < row.case.units);
    first.map_or_else(String::new, |first| format!("{:.1}", kib_per_unit(row, first)))
}

/// Resident memory per unit beyond the first (KiB).
#[expect(clippy::cast_precision_loss, reason = "far below 2⁵³")]
fn kib_per_unit(row: &Row, first: &Row) -> f64 {
    (row.median.resident_kib as f64 - first.median.resident_kib as f64)
        / (row.case.units as f64 - first.case.units as f64)
}

#[expect(clippy::cast_precision_loss, reason = "far below 2⁵³")]
fn units(rows: &[Row], zenoh: &[Row]) -> comfy_table::Table {
    let mut table = plain(&BY_UNITS);
    for row in rows {
        let outcome = &row.median;
        table.add_row([
            row.case.units.to_string(),
            format!("{:.0}", outcome.ticks_per_s),
            format!("{:.3}", outcome.cpu_us_per_tick),
            outcome.lost.to_string(),
            format!("{:.1}", outcome.resident_kib as f64 / 1024.0),
            beyond_first(row, rows),
            format!("{:.2}", outcome.start_s),
            format!("{:.1}", outcome.swap_ms),
            alone(row, zenoh).map_or_else(String::new, |row| format!("{:.3}", row.median.cpu_us_per_tick)),
            alone(row, zenoh).map_or_else(String::new, |row| beyond_first(row, zenoh)),
        ]);
    }
    table
}

fn rated(rows: &[Row]) -> comfy_table::Table {
    let mut table =
        plain(&["load", "in the middle", "p50 µs", "p99", "p99 ratio", "lost", "CPU µs/tick", "cores"]);
    for row in rows {
        let [p50, _, p99, _] = row.median.latency_us;
        table.add_row([
            row.name.clone(),
            middle(row),
            format!("{p50:.0}"),
            format!("{p99:.0}"),
            format!("{:.2}×", row.latency_ratio[2]),
            row.median.lost.to_string(),
            format!("{:.2}", row.median.cpu_us_per_tick),
            format!("{:.2}", row.median.cpu_share),
        ]);
    }
    table
}

fn offline_table(offline: &super::Offline) -> comfy_table::Table {
    let mut table = plain(&["offline, one core", "ticks/s", "`correct` is faster by"]);
    let own = [
        ("isotherm-replay correct, from MCAP", offline.correct_per_s),
        ("the same, chunks not compressed", offline.uncompressed_per_s),
    ];
    for (name, per_s) in own {
        table.add_row([name.to_owned(), format!("{per_s:.0}"), String::new()]);
    }
    if let Some(numpy) = &offline.numpy {
        let rows = [
            ("numpy, vectorised, from MCAP", numpy.vectorised_per_s),
            ("numpy, vectorised, from arrays in memory", numpy.vectorised_in_memory_per_s),
            ("numpy, tick by tick, from MCAP", numpy.tick_by_tick_per_s),
            ("numpy, tick by tick, from arrays in memory", numpy.tick_by_tick_in_memory_per_s),
        ];
        for ((name, per_s), ratio) in rows.into_iter().zip(numpy.ratios) {
            table.add_row([name.to_owned(), format!("{per_s:.0}"), format!("{ratio:.1}×")]);
        }
    }
    table
}
