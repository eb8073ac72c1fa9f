//! Temperatures in use: channels, the terms that follow them, and readings that wait to take effect.

use alloc::collections::VecDeque;
use alloc::vec::Vec;

use serde::{Deserialize, Serialize};

use super::axes::Axes;
use super::counters::Counters;
use super::footing::Footings;
use crate::calibration::Calibration;
use crate::channel::{ChannelMemory, ThermalState, Verdict};
use crate::sample::{ChannelName, TemperatureReading};
use crate::thermal::{AccelThermal, GyroThermal};
use crate::units::{Span, Timestamp};

/// Most readings that wait to take effect: two messages of 4096 times with 16 channels each, since a producer sends a
/// message's readings before its ticks.
const MAX_WAITING: usize = 2 * 4096 * 16;

/// A temperature channel as it stands.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ChannelReport {
    /// Name of the channel.
    pub name: ChannelName,
    /// Smoothed temperature and derivatives; `None` before the first reading.
    pub state: Option<ThermalState>,
    /// Missing, rejected or older than its limit.
    pub stale: bool,
    /// Derivatives do not rest on readings alone yet.
    pub warming_up: bool,
}

/// Readings that wait for the first tick which is to feel them.
#[derive(Debug, Default, Serialize, Deserialize)]
pub(super) struct Waiting {
    readings: VecDeque<TemperatureReading>,
}

impl Waiting {
    /// Puts a reading in its place in time.
    pub(super) fn push(&mut self, reading: &TemperatureReading, counters: &mut Counters) {
        let place = self.readings.iter().rposition(|r| r.time <= reading.time).map_or(0, |i| i + 1);
        self.readings.insert(place, *reading);
        if self.readings.len() > MAX_WAITING {
            // The one furthest in the future: a broken time stamp would otherwise stay for ever.
            self.readings.pop_back();
            counters.temperature_overflow += 1;
        }
    }

    /// Whether a reading takes effect before a tick which ends at `end_time`.
    pub(super) fn is_due(&self, end_time: Timestamp, delay: Span) -> bool {
        self.readings.front().is_some_and(|reading| reading.time + delay < end_time)
    }

    /// The next reading that takes effect before a tick which ends at `end_time`.
    fn pop_before(&mut self, end_time: Timestamp, delay: Span) -> Option<TemperatureReading> {
        if self.is_due(end_time, delay) { self.readings.pop_front() } else { None }
    }

    /// Drops readings from another time, after a step of the producer's clock.
    pub(super) fn restart(&mut self, now: Timestamp) {
        const NEAR: Span = Span::from_ns(3_600_000_000_000);
        self.readings.retain(|r| r.time.since(now) < NEAR && now.since(r.time) < NEAR);
    }
}

/// Memory of everything that follows temperature; made for one calibration.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct ThermalMemory {
    pub(super) channels: Vec<ChannelMemory>,
    updated: Vec<Option<Timestamp>>,
    pub(super) gyros: Vec<GyroThermal>,
    pub(super) accels: Vec<AccelThermal>,
    pub(super) gyro_axes: Axes,
    pub(super) accel_axes: Option<Axes>,
    /// What changes with a reading only, so that a tick need not gather it anew.
    pub(super) footings: Footings,
}

impl ThermalMemory {
    /// Makes the memory for a calibration; channels that `before` filtered in the same way go on where they are.
    pub(super) fn new(
        calibration: &Calibration,
        before: Option<(&Calibration, &Self)>,
        now: Timestamp,
    ) -> Self {
        let channels = calibration.channels.iter().map(|channel| {
            let kept =
                before.filter(|(old, _)| old.filter == calibration.filter).and_then(|(old, memory)| {
                    let index = old.channels.iter().position(|c| c == channel)?;
                    memory.channels.get(index).cloned()
                });
            kept.unwrap_or_else(|| ChannelMemory::new(&calibration.filter))
        });
        let mut memory = Self {
            channels: channels.collect(),
            updated: alloc::vec![None; calibration.channels.len()],
            gyros: calibration
                .gyros
                .iter()
                .map(|model| GyroThermal::new(model, &calibration.filter))
                .collect(),
            accels: calibration
                .accels
                .iter()
                .map(|model| AccelThermal::new(model, &calibration.filter))
                .collect(),
            gyro_axes: Axes::new(&calibration.gyro_orientation, calibration.filter.assumed_deg_c),
            accel_axes: calibration
                .accel_orientation
                .as_ref()
                .map(|o| Axes::new(o, calibration.filter.assumed_deg_c)),
            footings: Footings::default(),
        };
        for index in 0..memory.channels.len() {
            if let Some(state) = memory.channels.get(index).and_then(ChannelMemory::state) {
                memory.restart_lags(calibration, index, state.temperature);
                if let Some((old, old_memory)) = before {
                    memory.carry_lags(calibration, (old, old_memory));
                }
                memory.update(calibration, index, now, Span::ZERO);
            }
        }
        if let Some((old, old_memory)) = before.filter(|(old, _)| old.same_thermal_basis(calibration)) {
            memory.carry_unchanged(calibration, (old, old_memory));
        }
        memory.footings = Footings::of(calibration, &memory);
        memory
    }

    /// Goes on with lags that were filtered in the same way.
    fn carry_lags(&mut self, calibration: &Calibration, (old, old_memory): (&Calibration, &Self)) {
        let models = calibration.gyros.iter().zip(&old.gyros);
        for ((model, old_model), (thermal, kept)) in models.zip(self.gyros.iter_mut().zip(&old_memory.gyros))
        {
            let followed = model.channel.and_then(|index| calibration.channels.get(index));
            if followed == old_model.channel.and_then(|index| old.channels.get(index)) {
                thermal.carry_lags(model, (old_model, kept));
            }
        }
        let models = calibration.accels.iter().zip(&old.accels);
        for ((model, old_model), (thermal, kept)) in
            models.zip(self.accels.iter_mut().zip(&old_memory.accels))
        {
            let followed = model.channel.and_then(|index| calibration.channels.get(index));
            if followed == old_model.channel.and_then(|index| old.channels.get(index)) {
                thermal.carry_lags(model, (old_model, kept));
            }
        }
    }

    /// Goes on with what a swap did not change, on its way as it is: a swap to the same coefficients is no event.
    fn carry_unchanged(&mut self, calibration: &Calibration, (old, old_memory): (&Calibration, &Self)) {
        self.updated.clone_from(&old_memory.updated);
        let models = calibration.gyros.iter().zip(&old.gyros);
        for ((new, old), (thermal, kept)) in models.zip(self.gyros.iter_mut().zip(&old_memory.gyros)) {
            if new == old {
                thermal.clone_from(kept);
            }
        }
        let models = calibration.accels.iter().zip(&old.accels);
        for ((new, old), (thermal, kept)) in models.zip(self.accels.iter_mut().zip(&old_memory.accels)) {
            if new == old {
                thermal.clone_from(kept);
            }
        }
        if calibration.gyro_orientation == old.gyro_orientation
            && calibration.gyro_orientation_channels == old.gyro_orientation_channels
        {
            self.gyro_axes.clone_from(&old_memory.gyro_axes);
        }
        if calibration.accel_orientation == old.accel_orientation
            && calibration.accel_orientation_channels == old.accel_orientation_channels
        {
            self.accel_axes.clone_from(&old_memory.accel_axes);
        }
    }

    /// Applies every waiting reading that takes effect before a tick ending at `end_time`.
    pub(super) fn advance(
        &mut self,
        calibration: &Calibration,
        waiting: &mut Waiting,
        delay: Span,
        end_time: Timestamp,
        counters: &mut Counters,
    ) {
        let mut any = false;
        while let Some(reading) = waiting.pop_before(end_time, delay) {
            self.read(calibration, &reading, delay, counters);
            any = true;
        }
        if any {
            self.footings = Footings::of(calibration, self);
        }
    }

    fn read(
        &mut self,
        calibration: &Calibration,
        reading: &TemperatureReading,
        delay: Span,
        counters: &mut Counters,
    ) {
        let found = calibration.channels.iter().position(|channel| *channel.name() == reading.channel);
        let Some(((index, channel), memory)) =
            found.and_then(|i| Some(((i, calibration.channels.get(i)?), self.channels.get_mut(i)?)))
        else {
            counters.temperature_unknown_channel += 1;
            return;
        };
        let (gyros, accels) = (&mut self.gyros, &mut self.accels);
        let verdict = memory.read(channel, &calibration.filter, reading.time, reading.raw, |state| {
            for (model, thermal) in calibration.gyros.iter().zip(&mut *gyros) {
                if model.channel == Some(index) {
                    thermal.grid_point(model, state);
                }
            }
            for (model, thermal) in calibration.accels.iter().zip(&mut *accels) {
                if model.channel == Some(index) {
                    thermal.grid_point(model, state);
                }
            }
        });
        let start = reading.time + delay;
        match verdict {
            Verdict::Rejected => counters.temperature_rejected += 1,
            Verdict::OutOfOrder => counters.temperature_out_of_order += 1,
            Verdict::Taken(0) => {}
            Verdict::Taken(_) => {
                let before = self.updated.get(index).copied().flatten();
                let over = before.map_or(Span::ZERO, |before| start.since(before));
                self.update(calibration, index, start, over.max(calibration.filter.grid_step));
            }
            Verdict::Restarted => {
                if let Some(state) = memory.state() {
                    self.restart_lags(calibration, index, state.temperature);
                }
                self.update(calibration, index, start, calibration.filter.grid_step);
            }
        }
    }

    fn restart_lags(&mut self, calibration: &Calibration, channel: usize, temperature: f64) {
        for (model, thermal) in calibration.gyros.iter().zip(&mut self.gyros) {
            if model.channel == Some(channel) {
                thermal.restart(temperature);
            }
        }
        for (model, thermal) in calibration.accels.iter().zip(&mut self.accels) {
            if model.channel == Some(channel) {
                thermal.restart(temperature);
            }
        }
    }

    /// Turns everything that follows a channel towards its present state.
    fn update(&mut self, calibration: &Calibration, channel: usize, start: Timestamp, over: Span) {
        let Some(state) = self.channels.get(channel).and_then(ChannelMemory::state) else { return };
        if let Some(updated) = self.updated.get_mut(channel) {
            *updated = Some(start);
        }
        for (model, thermal) in calibration.gyros.iter().zip(&mut self.gyros) {
            if model.channel == Some(channel) {
                thermal.update(model, &state, calibration.filter.branch_dead_band, start, over);
            }
        }
        for (model, thermal) in calibration.accels.iter().zip(&mut self.accels) {
            if model.channel == Some(channel) {
                thermal.update_sensor(model, state.temperature, start, over);
            }
            if model.board_channel == Some(channel) {
                thermal.update_board(model, state.temperature, start, over);
            }
        }
        let channels = &self.channels;
        let follow = |axes: &mut Axes, orientation, following: &[usize]| {
            if following.contains(&channel)
                && let Some(mean) = mean_temperature(channels, following)
            {
                axes.update(orientation, mean, start, over);
            }
        };
        follow(&mut self.gyro_axes, &calibration.gyro_orientation, &calibration.gyro_orientation_channels);
        if let (Some(axes), Some(orientation)) = (&mut self.accel_axes, &calibration.accel_orientation) {
            follow(axes, orientation, &calibration.accel_orientation_channels);
        }
    }

    /// Forgets time, after a step of the producer's clock.
    pub(super) fn restart(&mut self, calibration: &Calibration) {
        self.channels.iter_mut().for_each(ChannelMemory::restart);
        self.updated.iter_mut().for_each(|updated| *updated = None);
        self.gyros.iter_mut().for_each(GyroThermal::settle);
        self.accels.iter_mut().for_each(AccelThermal::settle);
        self.gyro_axes.settle();
        self.accel_axes.iter_mut().for_each(Axes::settle);
        self.footings = Footings::of(calibration, self);
    }

    /// Smoothed temperature of the channel of a name (°C), where it is neither missing nor stale.
    pub(super) fn alive(
        &self,
        calibration: &Calibration,
        name: &ChannelName,
        time: Timestamp,
    ) -> Option<f64> {
        let index = calibration.channels.iter().position(|channel| channel.name() == name)?;
        let memory = self.channels.get(index).filter(|memory| !memory.stale(&calibration.filter, time))?;
        memory.state().map(|state| state.temperature)
    }

    /// Every channel as it stands at `time`.
    pub(super) fn report<'a>(
        &'a self,
        calibration: &'a Calibration,
        time: Timestamp,
    ) -> impl Iterator<Item = ChannelReport> + 'a {
        calibration.channels.iter().zip(&self.channels).map(move |(channel, memory)| ChannelReport {
            name: *channel.name(),
            state: memory.state(),
            stale: memory.stale(&calibration.filter, time),
            warming_up: memory.warming_up(&calibration.filter),
        })
    }
}

/// Mean over the channels that have a temperature.
fn mean_temperature(channels: &[ChannelMemory], following: &[usize]) -> Option<f64> {
    let known = following.iter().filter_map(|&i| channels.get(i).and_then(ChannelMemory::state));
    let (sum, count) = known.fold((0.0, 0.0), |(sum, count), state| (sum + state.temperature, count + 1.0));
    (count > 0.0).then(|| sum / count)
}
