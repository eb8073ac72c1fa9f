//! Temperatures in use: channels, the terms that follow them, and readings that wait to take effect.

use alloc::boxed::Box;
use alloc::collections::VecDeque;
use alloc::vec::Vec;

use serde::{Deserialize, Serialize};

use super::axes::Axes;
use super::counters::Counters;
use super::flags::Footing;
use crate::calibration::{Calibration, RegressorParts, Source};
use crate::channel::{ChannelMemory, ThermalState, Verdict};
use crate::sample::{ChannelName, TemperatureReading};
use crate::thermal::{AccelModel, Bank, GyroModel, MotionBanks, Others, Pace, Paces};
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
    /// [`ChannelMemory::raw`].
    pub raw: Option<f64>,
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

    /// Ticks that end later feel the next reading.
    pub(super) fn due_after(&self, delay: Span) -> Timestamp {
        self.readings.front().map_or(Timestamp::from_ns(i64::MAX), |reading| reading.time + delay)
    }

    /// Whether a reading takes effect before a tick which ends at `end_time`.
    pub(super) fn is_due(&self, end_time: Timestamp, delay: Span) -> bool {
        end_time > self.due_after(delay)
    }

    /// The next reading that takes effect before a tick which ends at `end_time`.
    fn pop_before(&mut self, end_time: Timestamp, delay: Span) -> Option<TemperatureReading> {
        if self.is_due(end_time, delay) { self.readings.pop_front() } else { None }
    }

    /// Drops readings from another time, after a step of the producer's clock.
    pub(super) fn restart(&mut self, now: Timestamp) {
        self.readings.retain(|r| r.time.since(now) < Span::HOUR && now.since(r.time) < Span::HOUR);
    }
}

/// Memory of everything that follows temperature; made for one calibration.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct ThermalMemory {
    channels: Vec<ChannelMemory>,
    updated: Vec<Option<Timestamp>>,
    pub(super) paces: Paces,
    /// Increment weight, bias, magnetic and slow-meander term.
    pub(super) gyros: Bank<4>,
    /// S and 1/K.
    pub(super) accels: Bank<2>,
    /// r, which follows the board's channel.
    pub(super) boards: Bank<1>,
    /// `None` where nothing follows motion.
    pub(super) motion: Option<Box<MotionBanks>>,
    pub(super) gyro_axes: Axes,
    pub(super) accel_axes: Option<Axes>,
    pub(super) gyro_footing: Footing,
    pub(super) accel_footing: Footing,
    /// Whether any channel is still warming up.
    pub(super) warming_up: bool,
    /// How often the channels' states may have changed, those under calibrations before included: for whoever keeps what it made of them.
    #[serde(skip)]
    pub(super) changes: u64,
}

impl ThermalMemory {
    /// Makes the memory for a calibration; channels that `before` filtered in the same way go on where they are.
    pub(super) fn new(
        calibration: &Calibration,
        before: Option<(&Calibration, &Self)>,
        now: Timestamp,
    ) -> Self {
        let filter = &calibration.filter;
        let channels = calibration.channels.iter().map(|channel| {
            let kept = before.and_then(|(old, memory)| {
                memory.channels.get(calibration.goes_on_from(old, channel)?).cloned()
            });
            kept.unwrap_or_else(|| ChannelMemory::new(filter))
        });
        let mut paces = Paces::default();
        let axes = |orientation| Axes::new(orientation, filter.assumed_deg_c);
        let mut memory = Self {
            channels: channels.collect(),
            updated: alloc::vec![None; calibration.channels.len()],
            gyros: Bank::new(&calibration.gyros, filter, &mut paces),
            accels: Bank::new(&calibration.accels, filter, &mut paces),
            boards: Bank::new(&calibration.accels, filter, &mut paces),
            motion: calibration.motion.as_deref().map(|motion| {
                Box::new(MotionBanks {
                    gyros: Bank::new(&motion.gyros, filter, &mut paces),
                    accels: Bank::new(&motion.accels, filter, &mut paces),
                })
            }),
            gyro_axes: axes(&calibration.gyro_orientation),
            accel_axes: calibration.accel_orientation.as_ref().map(axes),
            gyro_footing: Footing::default(),
            accel_footing: Footing::default(),
            warming_up: false,
            changes: before.map_or(0, |(_, memory)| memory.changes + 1),
            paces,
        };
        for index in 0..memory.channels.len() {
            if let Some(state) = memory.channels.get(index).and_then(ChannelMemory::state) {
                memory.resume_trails(calibration, index, state.temperature);
                if let Some((old, old_memory)) = before {
                    memory.carry_trails(calibration, (old, old_memory));
                }
                memory.update(calibration, index, now, Span::ZERO);
            }
        }
        if let Some((old, old_memory)) = before.filter(|(old, _)| old.same_thermal_basis(calibration)) {
            memory.carry_unchanged(calibration, (old, old_memory));
        }
        memory.note_footing(calibration);
        memory
    }

    /// Goes on with what trails behind a temperature that was filtered in the same way.
    fn carry_trails(&mut self, calibration: &Calibration, (old, old_memory): (&Calibration, &Self)) {
        let same = |new: Option<usize>, before: Option<usize>| {
            let followed = new.and_then(|index| calibration.channels.get(index));
            followed == before.and_then(|index| old.channels.get(index))
        };
        self.gyros.carry_trails(&calibration.gyros, (&old.gyros, &old_memory.gyros), same);
        let accels: &[AccelModel] = &calibration.accels;
        self.accels.carry_trails(accels, (&old.accels, &old_memory.accels), same);
    }

    /// Goes on with what a swap did not change, on its way as it is: a swap to the same coefficients is no event.
    fn carry_unchanged(&mut self, calibration: &Calibration, (old, old_memory): (&Calibration, &Self)) {
        self.updated.clone_from(&old_memory.updated);
        self.paces.carry(&old_memory.paces);
        self.gyros.carry(&calibration.gyros, (&old.gyros, &old_memory.gyros));
        self.accels.carry(&calibration.accels, (&old.accels, &old_memory.accels));
        self.boards.carry(&calibration.accels, (&old.accels, &old_memory.boards));
        if let (Some(banks), Some(motion)) = (&mut self.motion, &calibration.motion)
            && let (Some(old_banks), Some(old)) = (&old_memory.motion, &old.motion)
        {
            banks.gyros.carry(&motion.gyros, (&old.gyros, &old_banks.gyros));
            banks.accels.carry(&motion.accels, (&old.accels, &old_banks.accels));
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

    /// Applies every waiting reading that takes effect before a tick ending at `end_time`, where [one is due](Waiting::is_due).
    /// Those that `last_end`, the end of the tick before, should have felt are late.
    #[cold]
    pub(super) fn advance(
        &mut self,
        calibration: &Calibration,
        waiting: &mut Waiting,
        delay: Span,
        (last_end, end_time): (Option<Timestamp>, Timestamp),
        counters: &mut Counters,
    ) {
        self.changes += 1;
        while let Some(reading) = waiting.pop_before(end_time, delay) {
            let is_late = last_end.is_some_and(|last_end| reading.time + delay < last_end);
            counters.temperature_late += u64::from(is_late);
            self.read(calibration, &reading, delay, counters);
        }
        self.note_footing(calibration);
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
        let first = memory.state().is_none();
        let verdict = memory.read(channel, &calibration.filter, reading.time, reading.raw, |state| {
            self.gyros.grid_point(&calibration.gyros, index, state);
            self.accels.grid_point(&calibration.accels, index, state);
        });
        let start = reading.time + delay;
        let before = match verdict {
            Verdict::Rejected => return counters.temperature_rejected += 1,
            Verdict::OutOfOrder => return counters.temperature_out_of_order += 1,
            Verdict::Taken(0) => return,
            Verdict::Taken(_) => self.updated.get(index).copied().flatten(),
            Verdict::Restarted => {
                let temperature = memory.state().map(|state| state.temperature);
                self.resume_trails(calibration, index, temperature.unwrap_or_default());
                None
            }
        };
        let over = before.map_or(Span::ZERO, |before| start.since(before));
        self.update(calibration, index, start, over.max(calibration.filter.grid_step));
        self.join(calibration, index, start, first);
    }

    fn resume_trails(&mut self, calibration: &Calibration, channel: usize, temperature: f64) {
        self.gyros.resume_trails(&calibration.gyros, channel, temperature);
        self.accels.resume_trails::<AccelModel>(&calibration.accels, channel, temperature);
    }

    /// Turns everything that follows a channel towards its present state.
    fn update(&mut self, calibration: &Calibration, channel: usize, start: Timestamp, over: Span) {
        let Some(state) = self.channels.get(channel).and_then(ChannelMemory::state) else { return };
        if let Some(updated) = self.updated.get_mut(channel) {
            *updated = Some(start);
        }
        let channels = &self.channels;
        let others = |source| value(channels, calibration, source);
        let (to, filter) = ((channel, &state), &calibration.filter);
        let within: (_, Others<'_>) = (filter, &others);
        let way = (over > Span::ZERO).then(|| self.paces.share(channel, start));
        self.gyros.update(&calibration.gyros, to, within, way);
        self.accels.update(&calibration.accels, to, within, way);
        self.boards.update(&calibration.accels, to, within, way);
        if let (Some(banks), Some(motion)) = (&mut self.motion, &calibration.motion) {
            banks.gyros.update(&motion.gyros, to, within, way);
            banks.accels.update(&motion.accels, to, within, way);
        }
        self.paces.set(channel, Pace::new(start, over));
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

    /// Has the sensors that a channel is a regressor of know its new state.
    fn join(&mut self, calibration: &Calibration, channel: usize, start: Timestamp, first: bool) {
        if !calibration.regresses {
            return;
        }
        let (channels, paces) = (&self.channels, &self.paces);
        let others = |source| value(channels, calibration, source);
        let own = |index: usize| channels.get(index).and_then(ChannelMemory::state);
        let rests_on =
            |parts: &RegressorParts| parts.channels().any(|source| calibration.place(source) == channel);
        let within: (_, Others<'_>) = (&calibration.filter, &others);
        self.gyros.join::<GyroModel>(&calibration.gyros, rests_on, own, within, (paces, start, first));
        self.accels.join::<AccelModel>(&calibration.accels, rests_on, own, within, (paces, start, first));
    }

    /// Forgets time, after a step of the producer's clock.
    pub(super) fn restart(&mut self, calibration: &Calibration) {
        self.changes += 1;
        self.channels.iter_mut().for_each(ChannelMemory::restart);
        self.updated.iter_mut().for_each(|updated| *updated = None);
        self.gyros.settle();
        self.accels.settle();
        self.boards.settle();
        if let Some(banks) = &mut self.motion {
            banks.gyros.settle();
            banks.accels.settle();
        }
        self.gyro_axes.settle();
        self.accel_axes.iter_mut().for_each(Axes::settle);
        self.note_footing(calibration);
    }

    /// Notes what stays as it is until the next reading, so that a tick need not gather it. To be called when a sensor was
    /// excluded, too.
    pub(super) fn note_footing(&mut self, calibration: &Calibration) {
        let filter = &calibration.filter;
        let channel = |index: Option<usize>| index.and_then(|index| self.channels.get(index));
        let fresh_until =
            |index| channel(index).map_or(Timestamp::from_ns(i64::MAX), |c| c.fresh_until(filter));
        let regressors_fresh_until = |regressors: &[RegressorParts]| {
            let sources = regressors.iter().flat_map(RegressorParts::channels);
            let until = sources.map(|source| fresh_until(Some(calibration.place(source))));
            until.min().unwrap_or(Timestamp::from_ns(i64::MAX))
        };
        let temperature = |index| {
            let state = channel(index).and_then(ChannelMemory::state);
            state.map_or(filter.assumed_deg_c, |state| state.temperature)
        };
        let mut gyros = Footing::default();
        let axes = &self.gyro_axes;
        for (lane, model) in calibration.gyros.iter().enumerate() {
            let in_motion = self.motion.as_ref().is_some_and(|banks| banks.gyros.clamped(lane));
            let clamped = self.gyros.clamped(lane) || in_motion || axes.clamped();
            let fresh_until =
                fresh_until(model.channel).min(regressors_fresh_until(model.terms.regressors()));
            gyros.note(lane, (temperature(model.channel), fresh_until), clamped, axes);
        }
        let mut accels = Footing::default();
        for (lane, model) in calibration.accels.iter().enumerate() {
            let Some(axes) = &self.accel_axes else { break };
            let in_motion = self.motion.as_ref().is_some_and(|banks| banks.accels.clamped(lane));
            let clamped =
                self.accels.clamped(lane) || self.boards.clamped(lane) || in_motion || axes.clamped();
            let fresh_until = fresh_until(model.channel)
                .min(fresh_until(model.board_channel))
                .min(regressors_fresh_until(model.terms.regressors()));
            accels.note(lane, (temperature(model.channel), fresh_until), clamped, axes);
        }
        self.warming_up = self.channels.iter().any(|channel| channel.warming_up(filter));
        (self.gyro_footing, self.accel_footing) = (gyros, accels);
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

    /// Every temperature channel that has been read, with its state.
    pub(super) fn temperatures<'a>(
        &'a self,
        calibration: &'a Calibration,
    ) -> impl Iterator<Item = (&'a ChannelName, ThermalState)> + Clone {
        let channels = calibration.channels().iter().zip(&self.channels);
        channels.filter_map(|(channel, memory)| Some((channel.name(), memory.state()?)))
    }

    /// Every channel as it stands at `time`, temperatures first.
    pub(super) fn report<'a>(
        &'a self,
        calibration: &'a Calibration,
        time: Timestamp,
    ) -> impl Iterator<Item = ChannelReport> + 'a {
        calibration.channels.iter().zip(&self.channels).map(move |(channel, memory)| ChannelReport {
            name: *channel.name(),
            state: memory.state(),
            raw: memory.raw(),
            stale: memory.stale(&calibration.filter, time),
            warming_up: memory.warming_up(&calibration.filter),
        })
    }
}

/// Smoothed value of a channel, where it was read.
fn value(channels: &[ChannelMemory], calibration: &Calibration, source: Source) -> Option<f64> {
    channels.get(calibration.place(source)).and_then(ChannelMemory::state).map(|state| state.temperature)
}

/// Mean over the channels that have a temperature.
fn mean_temperature(channels: &[ChannelMemory], following: &[usize]) -> Option<f64> {
    let known = following.iter().filter_map(|&i| channels.get(i).and_then(ChannelMemory::state));
    let (sum, count) = known.fold((0.0, 0.0), |(sum, count), state| (sum + state.temperature, count + 1.0));
    (count > 0.0).then(|| sum / count)
}
