//! What a tick's correction rests on and only a temperature reading changes: gathered once per reading, looked at per tick.

use serde::{Deserialize, Serialize};

use super::axes::Axes;
use super::thermal_memory::ThermalMemory;
use crate::calibration::Calibration;
use crate::channel::ChannelMemory;
use crate::sample::{SensorFlags, Sensors};
use crate::units::Timestamp;

/// What the terms of one sensor rest on since the last reading.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub(super) struct Footing {
    /// Smoothed temperature of the sensor's channel (°C); the assumed one without a channel or before its first reading.
    pub(super) temperature_deg_c: f64,
    /// What the temperatures say of the sensor, but for their age.
    flags: SensorFlags,
    /// A tick that ends later is corrected with a temperature that is missing, rejected or too old.
    fresh_until: Timestamp,
}

impl Footing {
    /// What the temperatures say of the sensor, and in ticks up to which end.
    pub(super) const fn until(&self) -> (SensorFlags, Timestamp) {
        (self.flags, self.fresh_until)
    }

    /// What the temperatures say of the sensor in a tick that ends at `time`.
    pub(super) fn flags(&self, time: Timestamp) -> SensorFlags {
        if time > self.fresh_until { self.flags | SensorFlags::STALE_TEMPERATURE } else { self.flags }
    }
}

/// The footings of every sensor.
#[derive(Debug, Default, Serialize, Deserialize)]
pub(super) struct Footings {
    pub(super) gyros: Sensors<Footing>,
    pub(super) accels: Sensors<Footing>,
    /// Whether any channel is still warming up.
    pub(super) warming_up: bool,
}

impl Footings {
    /// As the memory stands.
    pub(super) fn of(calibration: &Calibration, memory: &ThermalMemory) -> Self {
        let filter = &calibration.filter;
        let channel = |index: Option<usize>| index.and_then(|index| memory.channels.get(index));
        let fresh_until = |index| {
            channel(index).map_or(Timestamp::from_ns(i64::MAX), |channel| channel.fresh_until(filter))
        };
        let footing = |index, other, clamped| {
            let mut flags = SensorFlags::VALID;
            flags.set(SensorFlags::CLAMPED_TEMPERATURE, clamped);
            let state = channel(index).and_then(ChannelMemory::state);
            Footing {
                temperature_deg_c: state.map_or(filter.assumed_deg_c, |state| state.temperature),
                flags,
                fresh_until: fresh_until(index).min(fresh_until(other)),
            }
        };
        let gyros = calibration.gyros.iter().zip(&memory.gyros);
        let accels = calibration.accels.iter().zip(&memory.accels);
        let gyro_axes = memory.gyro_axes.clamped();
        let accel_axes = memory.accel_axes.as_ref().is_some_and(Axes::clamped);
        Self {
            gyros: gyros
                .map(|(model, thermal)| footing(model.channel, None, thermal.clamped() || gyro_axes))
                .collect(),
            accels: accels
                .map(|(model, thermal)| {
                    footing(model.channel, model.board_channel, thermal.clamped() || accel_axes)
                })
                .collect(),
            warming_up: memory.channels.iter().any(|channel| channel.warming_up(filter)),
        }
    }
}
