//! The thermal terms of all sensors of a kind, each on a straight line from one evaluation to the next.

use core::array;

use alloc::vec::Vec;

use arrayvec::ArrayVec;
use serde::{Deserialize, Serialize};

use super::lag::{Lag, MAX_LAGS};
use super::ramp::Pace;
use crate::channel::{ThermalFilter, ThermalState};
use crate::lanes::Line;
use crate::orientation::SensorMask;
use crate::sample::MAX_SENSORS;
use crate::units::{Span, Timestamp};

/// A sensor model with `T` terms that follow one temperature channel.
pub(crate) trait Follows<const T: usize> {
    /// The channel, by index; `None` for a sensor that stands at the assumed temperature.
    fn channel(&self) -> Option<usize>;
    /// Thermal lags that enter the terms.
    fn lags(&self) -> &[Lag];
    /// Every term at a thermal state, and whether an argument was clamped to its fitted range.
    fn terms(
        &self,
        thermal: &ThermalState,
        lagged: &[f64; MAX_LAGS],
        filter: &ThermalFilter,
    ) -> ([f64; T], bool);
}

/// `T` terms of each sensor of a kind.
///
/// Each line runs from one thermal evaluation to the next, so that the corrected rate has no staircase. All sensors that follow
/// one channel are turned together; hence one pace for each channel.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct Bank<const T: usize> {
    #[serde(with = "crate::written::array")]
    lines: [Line; T],
    /// Of each channel that is followed; `None` for the sensors that follow none.
    paces: ArrayVec<(Option<usize>, Pace), MAX_SENSORS>,
    /// Which of the paces is the sensor's.
    pace_of: [u8; MAX_SENSORS],
    /// Sensors that have seen a reading: the first one is not approached from the assumed temperature, but met.
    started: SensorMask,
    /// Sensors of which an argument was outside its fitted range at the last evaluation.
    clamped: SensorMask,
    /// `L_τ[T]` of each lag (°C), by sensor; empty where no sensor has lags.
    lagged: Vec<[f64; MAX_LAGS]>,
}

impl<const T: usize> Bank<T> {
    /// Starts with the terms as they are at the assumed temperature.
    pub(crate) fn new<S: Follows<T>>(sensors: &[S], filter: &ThermalFilter) -> Self {
        let any_lags = sensors.iter().any(|sensor| !sensor.lags().is_empty());
        let mut bank = Self {
            lines: [Line::ZERO; T],
            paces: ArrayVec::new(),
            pace_of: [0; MAX_SENSORS],
            started: SensorMask::NONE,
            clamped: SensorMask::NONE,
            lagged: alloc::vec![[filter.assumed_deg_c; MAX_LAGS]; if any_lags { sensors.len() } else { 0 }],
        };
        let assumed = ThermalState { temperature: filter.assumed_deg_c, ..ThermalState::default() };
        for (lane, sensor) in sensors.iter().take(MAX_SENSORS).enumerate() {
            let known = bank.paces.iter().position(|(channel, _)| *channel == sensor.channel());
            let pace = known.unwrap_or(bank.paces.len());
            if known.is_none() {
                bank.paces.push((sensor.channel(), Pace::default()));
            }
            bank.pace_of[lane] = u8::try_from(pace).unwrap_or_default();
            let (terms, clamped) = sensor.terms(&assumed, &bank.lagged(lane), filter);
            bank.hold(lane, terms, clamped);
        }
        bank
    }

    /// `L_τ[T]` of one sensor's lags; anything for a sensor without.
    fn lagged(&self, lane: usize) -> [f64; MAX_LAGS] {
        self.lagged.get(lane).copied().unwrap_or_default()
    }

    fn hold(&mut self, lane: usize, terms: [f64; T], clamped: bool) {
        self.lines.iter_mut().zip(terms).for_each(|(line, term)| line.hold(lane, term));
        self.clamped = self.clamped.set(lane, clamped);
    }

    /// Starts the lags of a channel's sensors anew, from a temperature (°C) that is taken to have stood for ever.
    pub(crate) fn restart_lags<S: Follows<T>>(&mut self, sensors: &[S], channel: usize, temperature: f64) {
        for (sensor, lagged) in sensors.iter().zip(&mut self.lagged) {
            if sensor.channel() == Some(channel) {
                *lagged = [temperature; MAX_LAGS];
            }
        }
    }

    /// Goes on with the lags of an earlier bank, of the sensors that `kept` names and whose time constants are the same.
    pub(crate) fn carry_lags<S: Follows<T>>(
        &mut self,
        sensors: &[S],
        (old_sensors, old): (&[S], &Self),
        kept: impl Fn(usize) -> bool,
    ) {
        let decays =
            |sensor: &S| sensor.lags().iter().map(|lag| lag.decay).collect::<ArrayVec<_, MAX_LAGS>>();
        let lagged = self.lagged.iter_mut().zip(&old.lagged);
        for (lane, ((sensor, before), (lagged, old))) in
            sensors.iter().zip(old_sensors).zip(lagged).enumerate()
        {
            if kept(lane) && decays(sensor) == decays(before) {
                *lagged = *old;
            }
        }
    }

    /// Goes on with everything of one sensor in an earlier bank, on its way as it is.
    pub(crate) fn carry(&mut self, old: &Self, lane: usize) {
        self.lines.iter_mut().zip(&old.lines).for_each(|(line, old)| line.copy_lane(old, lane));
        self.started = self.started.set(lane, old.started.contains(lane));
        self.clamped = self.clamped.set(lane, old.clamped.contains(lane));
        if let (Some(lagged), Some(old)) = (self.lagged.get_mut(lane), old.lagged.get(lane)) {
            *lagged = *old;
        }
        let before = old.paces.get(usize::from(old.pace_of[lane]));
        if let (Some((_, pace)), Some((_, old))) =
            (self.paces.get_mut(usize::from(self.pace_of[lane])), before)
        {
            *pace = *old;
        }
    }

    /// Moves the lags of a channel's sensors on by one grid point.
    pub(crate) fn grid_point<S: Follows<T>>(
        &mut self,
        sensors: &[S],
        channel: usize,
        thermal: &ThermalState,
    ) {
        for (sensor, lagged) in sensors.iter().zip(&mut self.lagged) {
            if sensor.channel() == Some(channel) {
                super::lag::advance(sensor.lags(), lagged, thermal.temperature);
            }
        }
    }

    /// Evaluates every term of a channel's sensors and turns towards the result, `over` a sample interval from `start` on.
    pub(crate) fn update<S: Follows<T>>(
        &mut self,
        sensors: &[S],
        (channel, thermal): (usize, &ThermalState),
        filter: &ThermalFilter,
        (start, over): (Timestamp, Span),
    ) {
        let Some(place) = self.paces.iter().position(|(followed, _)| *followed == Some(channel)) else {
            return;
        };
        let share = self.paces[place].1.share(start);
        for (lane, sensor) in sensors.iter().enumerate() {
            if sensor.channel() != Some(channel) {
                continue;
            }
            let (terms, clamped) = sensor.terms(thermal, &self.lagged(lane), filter);
            if over == Span::ZERO || !self.started.contains(lane) {
                self.hold(lane, terms, clamped);
            } else {
                self.lines.iter_mut().zip(terms).for_each(|(line, term)| line.turn(lane, share, term));
                self.clamped = self.clamped.set(lane, clamped);
            }
            self.started = self.started.with(lane);
        }
        self.paces[place].1 = Pace::new(start, over);
    }

    /// Arrives at once where the terms are heading: after a step of the producer's clock the way there means nothing.
    pub(crate) fn settle(&mut self) {
        self.lines.iter_mut().for_each(Line::settle);
    }

    /// The terms in use at `time`, term by term.
    #[inline]
    pub(crate) fn at<const N: usize>(&self, time: Timestamp) -> [[f64; N]; T] {
        let mut shares = [0.0; MAX_SENSORS];
        for (share, (_, pace)) in shares.iter_mut().zip(&self.paces) {
            *share = pace.share(time);
        }
        let share = array::from_fn(|lane| shares[usize::from(self.pace_of[lane]) % MAX_SENSORS]);
        array::from_fn(|term| self.lines[term].at(&share))
    }

    /// Whether an argument of a sensor was outside its fitted range at the last evaluation.
    pub(crate) fn clamped(&self, lane: usize) -> bool {
        self.clamped.contains(lane)
    }
}
