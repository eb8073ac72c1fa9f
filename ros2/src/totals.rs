//! What the bridge did.

use std::collections::BTreeMap;

use comfy_table::presets;
use isotherm_cli::Exit;
use serde::Serialize;

/// Account of one unit.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize)]
pub struct UnitTotals {
    /// Raw Imu messages taken.
    pub imu_in: u64,
    /// Temperature messages taken.
    pub temperature_in: u64,
    /// Messages refused, by kind.
    pub refused: BTreeMap<&'static str, u64>,
    /// Ticks missing between the messages taken.
    pub missing: u64,
    /// Gaps that they make.
    pub gaps: u64,
    /// Runs: a driver that starts anew, or a clock that was set back, begins one.
    pub runs: u64,
    /// Messages taken that could not be handed to a service.
    pub unsent: u64,
    /// Corrected Imu messages published.
    pub imu_out: u64,
    /// Ticks in them.
    pub ticks_out: u64,
    /// Ticks that the service announced as missing.
    pub announced_missing: u64,
    /// Ticks lost between the service and the bridge.
    pub lost: u64,
    /// Ticks of no calibration, which make no message.
    pub uncalibrated: u64,
    /// Corrected ticks that could not be published.
    pub unpublished: u64,
}

impl UnitTotals {
    /// Messages refused, of any kind.
    #[must_use]
    pub fn all_refused(&self) -> u64 {
        self.refused.values().sum()
    }

    /// Ticks taken or corrected that got lost on their way between ROS 2 and the service.
    #[must_use]
    pub fn all_lost(&self) -> u64 {
        self.lost + self.unsent + self.unpublished
    }
}

/// Account of the bridge.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize)]
pub struct Totals {
    /// Account of each unit, by serial.
    pub units: BTreeMap<String, UnitTotals>,
}

impl Totals {
    /// The exit code that these totals stand for: whether what was taken was lost inside.
    #[must_use]
    pub fn exit(&self) -> Exit {
        let lost = |unit: &UnitTotals| unit.all_lost() > 0 || unit.refused.contains_key("queue_full");
        if self.units.values().any(lost) { Exit::DataLoss } else { Exit::Ok }
    }

    /// A table for people.
    #[must_use]
    pub fn table(&self) -> String {
        let head = ["unit", "in", "out", "refused", "missing", "uncalibrated", "lost", "runs"];
        let row = |(unit, totals): (&String, &UnitTotals)| {
            let figures = [
                totals.imu_in,
                totals.imu_out,
                totals.all_refused(),
                totals.missing,
                totals.uncalibrated,
                totals.all_lost(),
                totals.runs,
            ];
            std::iter::once(unit.clone()).chain(figures.map(|figure| figure.to_string()))
        };
        let mut table = isotherm_cli::table(head, self.units.iter().map(row), 1..);
        table.load_preset(presets::UTF8_HORIZONTAL_ONLY).to_string()
    }
}
