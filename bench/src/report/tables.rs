//! Tables in Markdown.

use std::fmt::Write as _;

use super::Kernel;
use crate::chain::{Measure, Row, middle};
use crate::machine::Machine;
use crate::scale::{BY_UNITS, Growth, Offline, alone, beyond_first};

/// A table; the first column is text.
fn markdown(head: &[&str], rows: impl IntoIterator<Item = Vec<String>>) -> String {
    let line = |cells: &[String]| format!("| {} |\n", cells.join(" | "));
    let mut text = line(&head.iter().map(ToString::to_string).collect::<Vec<_>>());
    let _ = writeln!(text, "|---{}|", "|---:".repeat(head.len().saturating_sub(1)));
    text.extend(rows.into_iter().map(|cells| line(&cells)));
    text
}

/// A number with spaces between its thousands.
fn thousands(number: f64) -> String {
    let digits = format!("{number:.0}");
    let mut spaced = String::new();
    for (index, digit) in digits.chars().enumerate() {
        if index > 0 && (digits.len() - index) % 3 == 0 {
            spaced.push(' ');
        }
        spaced.push(digit);
    }
    spaced
}

/// On what it was measured, and what was left out.
pub(super) fn machine(machine: &Machine, skipped: &[String]) -> String {
    let mut text = format!("Measured on: {}.\n", machine.words());
    for words in skipped {
        let _ = writeln!(text, "\nSkipped: {words}");
    }
    text
}

/// The load, said once for all its rows.
fn load<'a>(row: &'a Row, last: &mut &'a str) -> String {
    let again = *last == row.name;
    *last = &row.name;
    if again { String::new() } else { row.name.clone() }
}

/// A ratio to the reference; of the reference itself there is none.
fn ratio(ratio: f64, is_reference: bool) -> String {
    if is_reference { String::new() } else { format!("{ratio:.2}×") }
}

fn latency_rows<'a>(rows: impl Iterator<Item = &'a Row>) -> String {
    let mut last = "";
    let head = [
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
    ];
    markdown(
        &head,
        rows.enumerate().map(|(index, row)| {
            let name = load(row, &mut last);
            let reference = !name.is_empty() && (index == 0 || !row.case.is_disturbed());
            let mut cells = vec![name, middle(row)];
            cells.extend(row.median.latency_us.map(thousands));
            let [half, _, p99, _] = row.latency_ratio;
            cells.extend([half, p99].map(|of| ratio(of, reference)));
            cells.extend([row.median.lost.to_string(), format!("{:.1}", row.median.cpu_us_per_tick)]);
            cells
        }),
    )
}

/// Latency at rates.
pub(super) fn latency(rows: &[Row]) -> String {
    latency_rows(rows.iter().filter(|row| row.measure == Measure::Latency))
}

/// Latency with swaps beside latency without.
pub(super) fn swaps(rows: &[Row]) -> String {
    latency_rows(rows.iter().filter(|row| row.measure == Measure::Swap))
}

/// Settings of Zenoh beside one another.
pub(super) fn profiles(rows: &[Row]) -> String {
    latency_rows(rows.iter())
}

/// Throughput where nothing waits.
pub(super) fn throughput(rows: &[Row]) -> String {
    let mut last = "";
    let head = ["load", "in the middle", "messages/s", "ticks/s", "ratio", "lost", "CPU µs/tick"];
    markdown(
        &head,
        rows.iter().filter(|row| row.measure == Measure::Saturation).map(|row| {
            let name = load(row, &mut last);
            let reference = !name.is_empty();
            vec![
                name,
                middle(row),
                thousands(row.median.messages_per_s),
                thousands(row.median.ticks_per_s),
                ratio(row.throughput_ratio, reference),
                row.median.lost.to_string(),
                format!("{:.2}", row.median.cpu_us_per_tick),
            ]
        }),
    )
}

/// The state machine and the codec.
pub(super) fn kernel(rows: &[Kernel]) -> String {
    markdown(
        &["kernel", "ns per tick", "of autopilot"],
        rows.iter().map(|row| {
            vec![row.name.clone(), format!("{:.0}", row.ns_per_tick), format!("{:.2}×", row.ratio_to_peer)]
        }),
    )
}

/// By number of units, and how that grows.
#[expect(clippy::cast_precision_loss, reason = "far below 2⁵³")]
pub(super) fn units(rows: &[Row], zenoh: &[Row], growth: &[Growth]) -> String {
    let table = markdown(
        &BY_UNITS,
        rows.iter().map(|row| {
            let zenoh_alone = alone(row, zenoh);
            vec![
                thousands(row.case.units as f64),
                thousands(row.median.ticks_per_s),
                format!("{:.2}", row.median.cpu_us_per_tick),
                row.median.lost.to_string(),
                format!("{:.1}", row.median.resident_kib as f64 / 1024.0),
                beyond_first(row, rows),
                format!("{:.2}", row.median.start_s),
                format!("{:.1}", row.median.swap_ms),
                zenoh_alone.map_or_else(String::new, |row| format!("{:.2}", row.median.cpu_us_per_tick)),
                zenoh_alone.map_or_else(String::new, |row| beyond_first(row, zenoh)),
            ]
        }),
    );
    let exponents = markdown(
        &["grows with the number of units", "exponent"],
        growth.iter().map(|growth| vec![growth.what.clone(), format!("{:.2}", growth.exponent)]),
    );
    format!("{table}\n{exponents}")
}

/// The greatest number of units at its rate.
#[expect(clippy::cast_precision_loss, reason = "far below 2⁵³")]
pub(super) fn rated(rows: &[Row]) -> String {
    let mut last = "";
    let head = [
        "load",
        "in the middle",
        "p50 µs",
        "p99",
        "p99 ratio",
        "lost",
        "CPU µs/tick",
        "cores",
        "resident KiB per unit",
    ];
    markdown(
        &head,
        rows.iter().map(|row| {
            let name = load(row, &mut last);
            let [p50, _, p99, _] = row.median.latency_us;
            let reference = !name.is_empty();
            vec![
                name,
                middle(row),
                thousands(p50),
                thousands(p99),
                ratio(row.latency_ratio[2], reference),
                row.median.lost.to_string(),
                format!("{:.2}", row.median.cpu_us_per_tick),
                format!("{:.2}", row.median.cpu_share),
                format!("{:.1}", row.median.resident_kib as f64 / row.case.units as f64),
            ]
        }),
    )
}

/// Offline correction.
pub(super) fn offline(offline: &Offline) -> String {
    let own = [
        ("`isotherm-replay correct`, from MCAP", offline.correct_per_s),
        ("the same, chunks not compressed", offline.uncompressed_per_s),
    ];
    let mut rows: Vec<_> =
        own.map(|(name, per_s)| vec![name.to_owned(), thousands(per_s), String::new()]).to_vec();
    if let Some(numpy) = &offline.numpy {
        let ways = [
            ("numpy, vectorised, from MCAP", numpy.vectorised_per_s),
            ("numpy, vectorised, from arrays in memory", numpy.vectorised_in_memory_per_s),
            ("numpy, tick by tick, from MCAP", numpy.tick_by_tick_per_s),
            ("numpy, tick by tick, from arrays in memory", numpy.tick_by_tick_in_memory_per_s),
        ];
        rows.extend(
            ways.into_iter().zip(numpy.ratios).map(|((name, per_s), ratio)| {
                vec![name.to_owned(), thousands(per_s), format!("{ratio:.1}×")]
            }),
        );
    }
    markdown(&["one core", "ticks/s", "`correct` is faster by"], rows)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thousands_are_spaced() {
        let spaced = [0.4, 999.0, 1000.0, 1_234_567.4].map(thousands);
        assert_eq!(spaced, ["0", "999", "1 000", "1 234 567"]);
    }

    #[test]
    fn a_table_has_a_line_for_each_row() {
        let table = markdown(&["a", "b"], [vec!["x".to_owned(), "1".to_owned()]]);
        assert_eq!(table, "| a | b |\n|---|---:|\n| x | 1 |\n");
    }
}
