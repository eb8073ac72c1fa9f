//! Faults, and counters that have counted something.

use isotherm_cli::grouped;
use isotherm_protocol::status::{Fault, Status};
use ratatui::text::{Line, Span};

use super::super::figure::{ago, since, width, wrap};
use super::super::{Unit, tone};
use super::Section;

/// Counters that say how much was done; all others say that something was out of the ordinary.
const ORDINARY: [&str; 8] = [
    "gyro_ticks_in",
    "accel_ticks_in",
    "temperature_readings_in",
    "ticks_out",
    "ticks_interpolated",
    "switches_restored",
    "references_received",
    "references_used",
];

/// Faults by kind, the latest first: how many, how long ago, and the first one in words.
pub(super) fn faults(unit: &Unit<'_>, columns: usize) -> Section {
    let mut faults: Vec<&Fault> = unit.status.faults.iter().collect();
    faults.sort_by_key(|fault| std::cmp::Reverse(fault.last_unix_ms));
    let mut section = Section::new("Faults since the start");
    for fault in faults {
        let last = since(ago(fault.last_unix_ms, unit.now_unix_ms));
        let words = format!("{}×, last {last} ago; the first: ", grouped(fault.count));
        section.lines.push(Line::from_iter([
            Span::styled(format!("  {}  ", fault.kind), tone::HEAD),
            Span::raw(words),
        ]));
        for part in wrap(&fault.first, columns.saturating_sub(4)) {
            section.lines.push(Line::from(format!("    {part}")));
        }
    }
    section
}

/// Counters that are not zero, in as many columns as there is room for.
pub(super) fn counters(status: &Status, columns: usize) -> Section {
    let mut counters: Vec<_> = status.counters.iter().filter(|counter| counter.value > 0).collect();
    // Stable: within the ordinary and the others the order of the status stays.
    counters.sort_by_key(|counter| !ORDINARY.contains(&counter.name.as_str()));
    let values: Vec<String> = counters.iter().map(|counter| grouped(counter.value)).collect();
    let name_width = counters.iter().map(|counter| width(&counter.name)).max().unwrap_or(0);
    let value_width = values.iter().map(|value| width(value)).max().unwrap_or(0);
    let entry = 2 + name_width + 2 + value_width;
    let across = (columns.saturating_add(2) / (entry + 2)).max(1);
    let down = counters.len().div_ceil(across);
    let lines = (0..down).map(|row| {
        let mut line = Line::default();
        for (counter, value) in counters.iter().zip(&values).skip(row).step_by(down) {
            let ordinary = ORDINARY.contains(&counter.name.as_str());
            let style = if ordinary { tone::DIM } else { tone::PLAIN };
            let name = format!("  {:name_width$}  ", counter.name);
            line.push_span(Span::styled(name, style));
            line.push_span(Span::styled(format!("{value:>value_width$}"), style));
            line.push_span("  ");
        }
        line
    });
    Section { title: "Counters that are not zero", lines: lines.collect() }
}
