//! The keys, and what the columns mean.

use ratatui::text::{Line, Span};

use crate::page::tone;

/// Titles stand alone; a name and its meaning stand apart.
const TEXT: &[(&str, &str)] = &[
    ("Keys", ""),
    ("↑ ↓ PgUp PgDn", "select a unit, scroll a page; Home and End go to the ends"),
    ("Enter", "everything about the unit; again or Esc: back to the table"),
    ("← →", "on the page of a unit: previous, next unit"),
    ("s", "sort by state (worst first), serial, temperature, latency, gaps"),
    ("S", "sort by what comes before it in that order"),
    ("r", "reverse the order"),
    ("/", "filter by serial, state or note; Enter keeps it, Esc ends it"),
    ("Ctrl-L", "redraw the screen"),
    ("q Ctrl-C", "quit"),
    ("", ""),
    ("Marks and colours", ""),
    ("●", "running, no warning"),
    ("○", "standby, self-test or pre-launch calibration; the line is dim"),
    ("▲", "warning (yellow): outside the calibrated range, stale,"),
    ("", "no calibration or raw ticks, a counter grew in the last minute"),
    ("!", "fault now (red): in the last minute, or as long as it lasts"),
    ("×", "gone: no service answers for the unit; the line is dim"),
    ("", ""),
    ("Columns", ""),
    ("state", "running ± is with, running without reversal of the lasing mode"),
    ("rev, age", "revision of the calibration in force, age of its document"),
    ("°C, °C/min", "of the first channel that is stale or out of range, or the first"),
    ("range", "all temperatures against the calibrated range"),
    ("°/h, mg", "size of the present correction"),
    ("Hz", "raw gyro ticks received per second"),
    ("gaps dup", "gaps announced, duplicates, since the start; yellow: growing"),
    ("late bad", "late ticks and readings, frames refused; likewise"),
    ("p99", "latency added by the service, 99th percentile since the start"),
    ("note", "the most important notice; the page of the unit has all"),
];

/// Width of the names.
const NAME: usize = 14;

/// The lines.
pub(super) fn lines() -> Vec<Line<'static>> {
    let line = |(name, meaning): &(&'static str, &'static str)| match (*name, *meaning) {
        ("", "") => Line::default(),
        (title, "") => Line::from(Span::styled(title, tone::HEAD)),
        (name, meaning) => {
            Line::from_iter([Span::styled(format!("  {name:NAME$}"), tone::HEAD), Span::raw(meaning)])
        }
    };
    TEXT.iter().map(line).collect()
}
