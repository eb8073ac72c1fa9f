//! What the temperatures say of sensors until the next reading, so that a tick need not gather it.

use serde::{Deserialize, Serialize};

use super::axes::Axes;
use crate::lanes::Lanes;
use crate::sample::{MAX_SENSORS, SensorFlags};
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
    /// Whether there is nothing to say of any sensor in a tick that ends at `time`.
    #[inline]
    pub(super) fn is_sound(&self, time: Timestamp) -> bool {
        self.sound_until.is_some_and(|until| time <= until)
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

    /// What is to be said of a sensor in a tick that ends at `time`.
    pub(super) fn flags(&self, lane: usize, time: Timestamp) -> SensorFlags {
        let stale = time > self.fresh_until[lane];
        if stale { self.flags[lane] | SensorFlags::STALE_TEMPERATURE } else { self.flags[lane] }
    }
}
