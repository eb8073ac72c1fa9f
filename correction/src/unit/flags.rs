//! Flags of the sensors of a kind: what the temperatures say until the next reading, what a tick's readings say, and the account of both.

use core::array;

use serde::{Deserialize, Serialize};

use super::axes::Axes;
use super::counters::Counters;
use crate::lanes::Lanes;
use crate::orientation::SensorMask;
use crate::sample::{MAX_SENSORS, SensorFlags, Sensors};
use crate::units::Timestamp;

/// What the temperatures say of the sensors of a kind until the next reading.
#[derive(Debug, Default, Serialize, Deserialize)]
pub(super) struct Footing {
    /// Smoothed temperature of each sensor's channel (°C); the assumed one without a channel or before its first reading.
    pub(super) temperature_deg_c: Lanes,
    /// Flags of each sensor in a tick with readings that are sound and temperatures that are fresh.
    flags: [SensorFlags; MAX_SENSORS],
    /// A tick that ends later rests on a temperature that is missing, rejected or too old.
    fresh_until: [Timestamp; MAX_SENSORS],
    /// Up to this time every sensor is valid and nothing else; `None` where one is not.
    sound_until: Option<Timestamp>,
}

impl Footing {
    /// Up to when there is nothing to say of any sensor, as there is not at `time`; `None` where there is something already.
    pub(super) fn sound_from(&self, time: Timestamp) -> Option<Timestamp> {
        self.sound_until.filter(|until| time <= *until)
    }

    /// Enters one sensor, by the temperature that it follows (°C) and up to when that is fresh.
    pub(super) fn note(
        &mut self,
        lane: usize,
        (temperature_deg_c, fresh_until): (f64, Timestamp),
        clamped: bool,
        axes: &Axes,
    ) {
        let mut flags = SensorFlags::VALID;
        flags.set(SensorFlags::CLAMPED_TEMPERATURE, clamped);
        flags.set(SensorFlags::EXCLUDED, !axes.included().contains(lane));
        let before = if lane == 0 { Some(fresh_until) } else { self.sound_until };
        self.sound_until = before.filter(|_| flags == SensorFlags::VALID).map(|until| until.min(fresh_until));
        self.temperature_deg_c[lane] = temperature_deg_c;
        self.flags[lane] = flags;
        self.fresh_until[lane] = fresh_until;
    }

    /// What is to be said of each sensor in a tick that ends at `time`.
    fn at(&self, time: Timestamp) -> [SensorFlags; MAX_SENSORS] {
        array::from_fn(|lane| {
            let stale = time > self.fresh_until[lane];
            if stale { self.flags[lane] | SensorFlags::STALE_TEMPERATURE } else { self.flags[lane] }
        })
    }

    /// Flags of each sensor in a tick whose readings are nothing to go by.
    #[cold]
    pub(super) fn lost(&self, time: Timestamp) -> [SensorFlags; MAX_SENSORS] {
        self.at(time).map(|flags| flags - SensorFlags::VALID)
    }

    /// Flags of each sensor in a tick that ends at `time`, and the sensors whose reading is a number.
    ///
    /// What is beyond its limit becomes the limit: it says no more than that, and stays finite whatever it is. Sensors whose reading
    /// does not count leave `usable`.
    #[cold]
    pub(super) fn patch<const N: usize>(
        &self,
        time: Timestamp,
        (readings, limits, count): (&mut [f64; N], &Lanes, usize),
        usable: &mut SensorMask,
        counters: &mut Counters,
    ) -> ([SensorFlags; MAX_SENSORS], SensorMask) {
        let (mut all, mut numbers) = (self.at(time), SensorMask::all(N));
        let readings = readings.iter_mut().zip(limits).take(count);
        for (lane, ((reading, limit), flags)) in readings.zip(&mut all).enumerate() {
            if !reading.is_finite() {
                *flags |= SensorFlags::NOT_FINITE;
                counters.not_finite_readings += 1;
                numbers = numbers.without(lane);
            } else if reading.abs() >= *limit {
                *flags |= SensorFlags::OVERRANGE;
                counters.overrange_readings += 1;
                *reading = reading.clamp(-limit, *limit);
            }
            if flags.intersects(SensorFlags::OVERRANGE | SensorFlags::NOT_FINITE) {
                *usable = usable.without(lane);
            }
            if flags.intersects(UNSOUND) {
                *flags -= SensorFlags::VALID;
            }
        }
        (all, numbers)
    }
}

/// A reading that does not count as it stands.
const UNSOUND: SensorFlags =
    SensorFlags::OVERRANGE.union(SensorFlags::NOT_FINITE).union(SensorFlags::EXCLUDED);

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
    /// All but ticks, which stand below, and flags, which are those of the last tick: mostly there is nothing else to write down.
    accounts: Sensors<SensorHealth>,
    /// Ticks seen.
    pub(super) ticks: u64,
}

impl Health {
    /// Of so many sensors that have not been seen.
    pub(super) fn new(sensors: usize) -> Self {
        let accounts = core::iter::repeat_n(SensorHealth::default(), sensors).collect();
        Self { accounts, ticks: 0 }
    }

    /// Enters the flags of a tick in which not every sensor was valid and nothing else.
    #[cold]
    pub(super) fn note(&mut self, flags: [SensorFlags; MAX_SENSORS]) {
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

    /// Sensor by sensor, with the flags of the last tick.
    pub(super) fn with(&self, flags: [SensorFlags; MAX_SENSORS]) -> Sensors<SensorHealth> {
        let accounts = self.accounts.iter().zip(flags);
        accounts.map(|(account, flags)| SensorHealth { flags, ticks: self.ticks, ..*account }).collect()
    }
}
