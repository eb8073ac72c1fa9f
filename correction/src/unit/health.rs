//! How each sensor has been doing.

use serde::{Deserialize, Serialize};

use crate::sample::{MAX_SENSORS, SensorFlags, Sensors};

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

/// Accounts of all sensors of a kind.
#[derive(Debug, Default, Serialize, Deserialize)]
pub(super) struct Health {
    /// All but the flags and the ticks, which stand below: in most ticks nothing else is to be written down.
    accounts: Sensors<SensorHealth>,
    flags: [SensorFlags; MAX_SENSORS],
    ticks: u64,
}

impl Health {
    /// Of so many sensors that have not been seen.
    pub(super) fn new(sensors: usize) -> Self {
        let accounts = core::iter::repeat_n(SensorHealth::default(), sensors).collect();
        Self { accounts, ..Self::default() }
    }

    /// Enters a tick in which every sensor was valid and nothing else.
    #[inline]
    pub(super) fn note_sound(&mut self) {
        self.flags = [SensorFlags::VALID; MAX_SENSORS];
        self.ticks += 1;
    }

    /// Enters the flags of one tick.
    pub(super) fn note(&mut self, flags: [SensorFlags; MAX_SENSORS]) {
        self.flags = flags;
        self.ticks += 1;
        for (account, flags) in self.accounts.iter_mut().zip(flags) {
            account.invalid += u64::from(!flags.contains(SensorFlags::VALID));
            account.overrange += u64::from(flags.contains(SensorFlags::OVERRANGE));
            account.not_finite += u64::from(flags.contains(SensorFlags::NOT_FINITE));
            let clamped = SensorFlags::CLAMPED_TEMPERATURE | SensorFlags::CLAMPED_RATE;
            account.clamped += u64::from(flags.intersects(clamped));
            account.stale += u64::from(flags.contains(SensorFlags::STALE_TEMPERATURE));
            account.excluded += u64::from(flags.contains(SensorFlags::EXCLUDED));
        }
    }

    /// Sensor by sensor.
    pub(super) fn accounts(&self) -> Sensors<SensorHealth> {
        let accounts = self.accounts.iter().zip(self.flags);
        accounts.map(|(account, flags)| SensorHealth { flags, ticks: self.ticks, ..*account }).collect()
    }
}
