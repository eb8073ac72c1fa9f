//! What the service did, as it says at its end.

use std::collections::BTreeMap;
use std::fmt::Write;

use comfy_table::presets;
use isotherm_cli::Exit;
use isotherm_protocol::key::UnitId;
use serde::Serialize;

/// Account of one unit since the service started.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct UnitTotals {
    /// Raw gyro ticks received.
    pub ticks_in: u64,
    /// Raw gyro ticks given out corrected.
    pub ticks_out: u64,
    /// Gaps announced.
    pub gaps: u64,
    /// Raw gyro ticks announced as missing in them.
    pub ticks_missed: u64,
    /// Raw gyro ticks refused: late, implausible, or not as the calibration has them. Duplicates are not among them.
    pub ticks_refused: u64,
    /// Messages refused.
    pub bad: u64,
    /// Corrected ticks that could not be published.
    pub unpublished: u64,
    /// Resets after an event thought impossible.
    pub alarms: u64,
    /// Time that the service added, median (ns).
    pub added_latency_p50_ns: u64,
    /// The same, 99th percentile (ns).
    pub added_latency_p99_ns: u64,
}

/// Account of the service.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize)]
pub struct Totals {
    /// Account of each unit, by serial.
    pub units: BTreeMap<String, UnitTotals>,
    /// Messages refused that belong to no unit of these, by kind.
    pub refused: BTreeMap<String, u64>,
    /// Whether the stop finished within its time: everything flushed, the session closed.
    pub stopped_in_time: bool,
}

impl Totals {
    /// The account of one unit; empty where it never appeared.
    #[must_use]
    pub fn unit(&self, unit: &UnitId) -> UnitTotals {
        self.units.get(unit.as_str()).copied().unwrap_or_default()
    }

    /// Whether received data was lost inside the service. Announced gaps are not: they say that nothing was received.
    #[must_use]
    pub fn lost(&self) -> bool {
        !self.stopped_in_time || self.units.values().any(|unit| unit.unpublished > 0 || unit.alarms > 0)
    }

    /// The exit code that these totals stand for.
    #[must_use]
    pub fn exit(&self) -> Exit {
        Exit::of_loss(self.lost())
    }

    /// A table for people.
    #[must_use]
    pub fn table(&self) -> String {
        let us = |ns: u64| format!("{}.{}", ns / 1000, ns % 1000 / 100);
        let counts = |of: &UnitTotals| {
            [
                ("ticks in", of.ticks_in),
                ("ticks out", of.ticks_out),
                ("gaps", of.gaps),
                ("missed", of.ticks_missed),
                ("refused", of.ticks_refused),
                ("bad", of.bad),
                ("unpublished", of.unpublished),
                ("alarms", of.alarms),
            ]
        };
        let names = counts(&UnitTotals::default()).map(|(name, _)| name);
        let head = ["unit"].into_iter().chain(names).chain(["added p50 µs", "added p99 µs"]);
        let row = |(unit, of): (&String, &UnitTotals)| {
            let counts = counts(of).map(|(_, count)| count.to_string());
            let latencies = [us(of.added_latency_p50_ns), us(of.added_latency_p99_ns)];
            std::iter::once(unit.clone()).chain(counts).chain(latencies).collect::<Vec<_>>()
        };
        let mut table = isotherm_cli::table(head, self.units.iter().map(row), 1..);
        let mut text = table.load_preset(presets::UTF8_HORIZONTAL_ONLY).to_string();
        for (kind, count) in &self.refused {
            // Writing to a string cannot fail.
            let _ = write!(text, "\n{kind} (no unit): {count}");
        }
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn announced_gaps_are_no_loss_and_unpublished_ticks_are() {
        let with = |unit: UnitTotals, stopped_in_time| Totals {
            units: BTreeMap::from([("ZLG-1".to_owned(), unit)]),
            stopped_in_time,
            ..Totals::default()
        };
        let whole = UnitTotals {
            ticks_in: 9,
            ticks_out: 9,
            gaps: 1,
            ticks_missed: 4,
            bad: 2,
            ..UnitTotals::default()
        };
        assert_eq!(with(whole, true).exit(), Exit::Ok);
        assert_eq!(with(whole, false).exit(), Exit::DataLoss);
        assert_eq!(with(UnitTotals { unpublished: 1, ..whole }, true).exit(), Exit::DataLoss);
        assert_eq!(with(UnitTotals { alarms: 1, ..whole }, true).exit(), Exit::DataLoss);
        assert!(with(whole, true).table().contains("ZLG-1"));
    }
}
