//! Figures per unit: as a table for people and as JSON for programs.

use std::path::PathBuf;

use comfy_table::{Table, TableComponent};
use isotherm_cli::grouped;
use serde::Serialize;

use super::fleet::Member;
use super::produce::Pace;
use super::watch::Watched;
use super::windows::{CORRECTED, Mean, RAW, Spread};

/// Names of the case axes.
pub(crate) const AXES: [&str; 3] = ["x", "y", "z"];

/// What came of the demo.
#[derive(Debug, Serialize)]
pub(crate) struct Summary {
    pub(crate) units: Vec<UnitSummary>,
    /// Where the report is; `null` where none was asked for.
    pub(crate) report: Option<PathBuf>,
    /// How long the demo took (s of the wall clock), without the report.
    pub(crate) seconds: f64,
    pub(crate) seed: u64,
}

/// What came of one unit. Rates are means over `averaging_s`; `rms` is over all three axes, peak to peak that of
/// the axis where it is largest.
#[derive(Debug, Serialize)]
pub(crate) struct UnitSummary {
    pub(crate) unit: String,
    pub(crate) kind: &'static str,
    /// Raw gyro ticks sent.
    pub(crate) ticks_in: u64,
    /// Corrected ticks received.
    pub(crate) ticks_out: u64,
    /// Ticks that the corrected stream announces as missing.
    pub(crate) gaps: u64,
    /// Ticks that neither came back nor were announced.
    pub(crate) lost: u64,
    /// Ticks that came back twice.
    pub(crate) duplicated: u64,
    /// Event time of the run (s), and how much faster than the wall clock it was meant to pass.
    pub(crate) event_s: f64,
    pub(crate) compression: f64,
    /// Length of the windows that the rate errors are averaged over (s of event time).
    pub(crate) averaging_s: f64,
    pub(crate) raw_rms_deg_per_h: f64,
    pub(crate) corrected_rms_deg_per_h: f64,
    pub(crate) raw_peak_to_peak_deg_per_h: f64,
    pub(crate) corrected_peak_to_peak_deg_per_h: f64,
    /// From a raw message's arrival in the service to the return of the put it caused.
    pub(crate) added_latency_p50_us: f64,
    pub(crate) added_latency_p99_us: f64,
    /// From handing a raw batch to Zenoh to receiving the corrected one.
    pub(crate) end_to_end_p50_us: f64,
    pub(crate) end_to_end_p99_us: f64,
    pub(crate) axes: Vec<AxisSummary>,
}

/// One case axis.
#[derive(Debug, Serialize)]
pub(crate) struct AxisSummary {
    axis: &'static str,
    raw: Spread,
    corrected: Spread,
}

impl UnitSummary {
    /// `added_latency_ns` is median and 99th percentile from the unit's status.
    pub(crate) fn new(member: &Member, pace: Pace, watched: &Watched, added_latency_ns: [u64; 2]) -> Self {
        let Watched { scored, continuity } = watched;
        let means: &[Mean] = &scored.means;
        let [raw, corrected] = [RAW, CORRECTED].map(|stage| Spread::overall(means, stage));
        let axis = |(axis, index)| AxisSummary {
            axis,
            raw: Spread::about(means, RAW, index),
            corrected: Spread::about(means, CORRECTED, index),
        };
        let [added_latency_p50_us, added_latency_p99_us] = added_latency_ns.map(microseconds);
        let [end_to_end_p50_us, end_to_end_p99_us] = scored.end_to_end_ns.map(microseconds);
        Self {
            unit: member.id.to_string(),
            kind: member.kind.name,
            ticks_in: scored.sent,
            ticks_out: continuity.ticks,
            gaps: continuity.announced_missing,
            // The continuity rule cannot see what is missing at the very start and end; the sum can.
            lost: scored
                .sent
                .saturating_sub(continuity.ticks + continuity.announced_missing)
                .max(continuity.lost),
            duplicated: continuity.duplicated,
            event_s: member.scenario.duration_s,
            compression: pace.compression,
            averaging_s: member.kind.averaging_s,
            raw_rms_deg_per_h: raw.rms_deg_per_h,
            corrected_rms_deg_per_h: corrected.rms_deg_per_h,
            raw_peak_to_peak_deg_per_h: raw.peak_to_peak_deg_per_h,
            corrected_peak_to_peak_deg_per_h: corrected.peak_to_peak_deg_per_h,
            added_latency_p50_us,
            added_latency_p99_us,
            end_to_end_p50_us,
            end_to_end_p99_us,
            axes: AXES.into_iter().zip(0..).map(axis).collect(),
        }
    }

    /// Whether every tick came back once.
    pub(crate) fn is_whole(&self) -> bool {
        self.lost == 0 && self.gaps == 0 && self.duplicated == 0
    }
}

impl Summary {
    /// Head and rows of the table: a column per unit.
    pub(crate) fn rows(&self) -> (Vec<String>, Vec<Vec<String>>) {
        let row = |name: &str, value: &dyn Fn(&UnitSummary) -> String| -> Vec<String> {
            [name.to_owned()].into_iter().chain(self.units.iter().map(value)).collect()
        };
        let head = row("", &|unit| unit.unit.clone());
        let rows = vec![
            row("kind", &|unit| unit.kind.to_owned()),
            row("event time, compressed", &|unit| {
                format!("{}, {:.0}×", event_time(unit.event_s), unit.compression)
            }),
            row("ticks in", &|unit| grouped(unit.ticks_in)),
            row("ticks out", &|unit| grouped(unit.ticks_out)),
            row("ticks in gaps", &|unit| grouped(unit.gaps)),
            row("rate error, averaged over", &|unit| format!("{} s", unit.averaging_s)),
            row("  rms, raw → corrected, °/h", &|unit| {
                arrow(unit.raw_rms_deg_per_h, unit.corrected_rms_deg_per_h)
            }),
            row("  peak to peak, °/h", &|unit| {
                arrow(unit.raw_peak_to_peak_deg_per_h, unit.corrected_peak_to_peak_deg_per_h)
            }),
            row("added latency, p50 / p99, µs", &|unit| {
                slash(unit.added_latency_p50_us, unit.added_latency_p99_us)
            }),
            row("end to end, p50 / p99, µs", &|unit| slash(unit.end_to_end_p50_us, unit.end_to_end_p99_us)),
        ];
        (head, rows)
    }

    /// The table as text.
    pub(crate) fn table(&self) -> Table {
        let (head, rows) = self.rows();
        let mut table = isotherm_cli::table(head, rows, 1..);
        // Two blanks between columns: all of them fit 80.
        table.column_iter_mut().skip(1).for_each(|column| {
            column.set_padding((0, 1));
        });
        table.set_style(TableComponent::HeaderLines, '─');
        table.set_style(TableComponent::MiddleHeaderIntersections, '─');
        table
    }
}

/// Raw and corrected figure.
pub(crate) fn arrow(raw: f64, corrected: f64) -> String {
    format!("{} → {}", figure(raw), figure(corrected))
}

fn slash(p50: f64, p99: f64) -> String {
    format!("{p50:.0} / {p99:.0}")
}

/// About three digits.
fn figure(value: f64) -> String {
    let decimals = match value.abs() {
        size if size >= 100.0 => 0,
        size if size >= 10.0 => 1,
        size if size >= 1.0 => 2,
        _ => 3,
    };
    format!("{value:.decimals$}")
}

fn event_time(seconds: f64) -> String {
    if seconds < 3600.0 { format!("{:.0} min", seconds / 60.0) } else { format!("{:.1} h", seconds / 3600.0) }
}

#[expect(clippy::cast_precision_loss, reason = "latencies are far below 2⁵³ ns (104 days)")]
fn microseconds(ns: u64) -> f64 {
    ns as f64 / 1000.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_read_well() {
        assert_eq!(
            [1234.5, 12.34, 1.684, 0.1904, 0.0].map(figure),
            ["1234", "12.3", "1.68", "0.190", "0.000"]
        );
        assert_eq!([1200.0, 11_400.0].map(event_time), ["20 min", "3.2 h"]);
    }
}
