//! How each sensor has been doing.

use serde::{Deserialize, Serialize};

use crate::sample::SensorFlags;

/// Account of one sensor since its unit got a calibration with as many sensors.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct SensorHealth {
    /// Flags at the last tick.
    pub flags: SensorFlags,
    /// Ticks seen.
    pub ticks: u64,
    /// Ticks whose reading did not count as it stood.
    pub invalid: u64,
    /// Ticks at or beyond the input range.
    pub overrange: u64,
    /// Ticks whose reading was no finite number.
    pub not_finite: u64,
    /// Ticks corrected with a temperature outside the fitted range.
    pub clamped: u64,
    /// Ticks corrected with a temperature that was missing, rejected or too old.
    pub stale: u64,
    /// Ticks on which the parity check had excluded the sensor.
    pub excluded: u64,
}

impl SensorHealth {
    /// Enters a tick in which nothing but `VALID` was flagged.
    pub(super) fn note_valid(&mut self) {
        self.flags = SensorFlags::VALID;
        self.ticks += 1;
    }

    /// Enters the flags of one tick.
    pub(super) fn note(&mut self, flags: SensorFlags) {
        self.flags = flags;
        self.ticks += 1;
        if flags == SensorFlags::VALID {
            return;
        }
        self.invalid += u64::from(!flags.contains(SensorFlags::VALID));
        self.overrange += u64::from(flags.contains(SensorFlags::OVERRANGE));
        self.not_finite += u64::from(flags.contains(SensorFlags::NOT_FINITE));
        self.clamped += u64::from(flags.contains(SensorFlags::CLAMPED_TEMPERATURE));
        self.stale += u64::from(flags.contains(SensorFlags::STALE_TEMPERATURE));
        self.excluded += u64::from(flags.contains(SensorFlags::EXCLUDED));
    }
}
