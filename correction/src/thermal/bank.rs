//! The thermal terms of all sensors of a kind, each on a straight line from one evaluation to the next; and other values that move so.

use core::array;

use alloc::vec::Vec;

use arrayvec::ArrayVec;
use serde::{Deserialize, Serialize};

use super::terms::{Others, SensorState, Terms};
use super::trail::{MAX_TRAILS, Trail, Trailed, advance, resume, settled};
use crate::calibration::RegressorParts;
use crate::channel::{ThermalFilter, ThermalState};
use crate::lanes::Line;
use crate::orientation::SensorMask;
use crate::sample::MAX_SENSORS;
use crate::units::{Span, Timestamp};

/// A sensor model with `T` terms that follow one temperature channel.
pub(crate) trait Follows<const T: usize> {
    /// The channel, by index; `None` for a sensor that stands at the assumed temperature.
    fn channel(&self) -> Option<usize>;
    /// Those among its terms that more enters than the temperature as it is, if any.
    fn with_memory(&self) -> Option<&Terms> {
        None
    }
    /// What trails behind the temperature and enters the terms.
    fn trails(&self) -> &[Trail] {
        self.with_memory().map_or(&[], Terms::trails)
    }
    /// Every term in a state, and whether an argument was clamped to its fitted range.
    fn terms(&self, state: &SensorState<'_>, filter: &ThermalFilter) -> ([f64; T], bool);
    /// Every term on a ramp that has lasted for long, so that everything that trails has settled on it.
    fn steady(&self, thermal: &ThermalState, filter: &ThermalFilter, others: Others<'_>) -> [f64; T] {
        let trailed = settled(self.trails(), thermal, filter);
        self.terms(&SensorState { thermal, trailed: &trailed, others }, filter).0
    }
}

/// Most channels that all sensors of a unit follow: one for each gyro, each accelerometer and each accelerometer's board.
const MOST_FOLLOWED: usize = 3 * MAX_SENSORS;

/// How far along its way everything is that follows a channel, at one time. What follows none stands still anyway.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Shares<'a> {
    /// Everything is equally far, as it is where a unit's channels are read together.
    together: f64,
    /// By the channel's place among those that are followed, where that is not so.
    apart: Option<&'a [f64; MOST_FOLLOWED]>,
}

/// When a way begins, and what part of it is made in a second; a way that is over at once has no pace.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub(crate) struct Pace {
    start: Timestamp,
    per_second: f64,
}

impl Pace {
    /// A way that takes this long from `start` on.
    pub(crate) fn new(start: Timestamp, over: Span) -> Self {
        if over == Span::ZERO { Self::default() } else { Self { start, per_second: 1.0 / over.as_s() } }
    }

    /// What is left of the way at `time`, as a way that begins there.
    fn left(self, time: Timestamp) -> Self {
        let left = 1.0 - self.share(time);
        if left > 0.0 { Self { start: time, per_second: self.per_second / left } } else { Self::default() }
    }

    /// Whether the way begins at `time`.
    pub(crate) fn starts(&self, time: Timestamp) -> bool {
        self.per_second > 0.0 && self.start == time
    }

    /// How far along the way `time` is, 0…1: exactly 0 before the start, exactly 1 at and after the end; 0 without a pace.
    #[inline]
    pub(crate) fn share(&self, time: Timestamp) -> f64 {
        let way = time.seconds_from(self.start) * self.per_second;
        // Not `clamp`: without a pace −0 is to become 0, and these are two instructions without a branch.
        let way = if way > 0.0 { way } else { 0.0 };
        if way < 1.0 { way } else { 1.0 }
    }
}

/// A value on its way.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct Ramp {
    /// How fast it goes; a value that stands still has no pace.
    pub(crate) pace: Pace,
    from: f64,
    step: f64,
}

impl Ramp {
    /// A value that stands still.
    pub(crate) fn hold(value: f64) -> Self {
        Self { pace: Pace::default(), from: value, step: 0.0 }
    }

    /// The value at `time`: exactly the starting one before the start.
    pub(crate) fn at(&self, time: Timestamp) -> f64 {
        self.from + self.step * self.pace.share(time)
    }

    /// Turns towards `target`, to be reached `over` later; from where the value is at `start`.
    pub(crate) fn turn(&mut self, start: Timestamp, over: Span, target: f64) {
        let from = self.at(start);
        *self = if over == Span::ZERO {
            Self::hold(target)
        } else {
            Self { pace: Pace::new(start, over), from, step: target - from }
        };
    }

    /// Goes on as before, on a way that begins at `time`.
    pub(crate) fn set_out(&mut self, time: Timestamp) {
        let (from, to) = (self.at(time), self.from + self.step);
        *self = Self { pace: self.pace.left(time), from, step: to - from };
    }

    /// Arrives at once.
    pub(crate) fn settle(&mut self) {
        *self = Self::hold(self.from + self.step);
    }
}

/// The channels that sensors follow. Whatever follows one is turned at once with all the rest: hence one pace for each.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub(crate) struct Paces {
    followed: ArrayVec<(usize, Pace), MOST_FOLLOWED>,
    /// Whether some differ from others.
    apart: bool,
}

impl Paces {
    /// Place of a channel, which is followed from now on.
    fn place(&mut self, channel: Option<usize>) -> u8 {
        let place = channel.map_or(0, |channel| {
            let known = self.followed.iter().position(|(followed, _)| *followed == channel);
            known.unwrap_or_else(|| {
                self.followed.push((channel, Pace::default()));
                self.followed.len() - 1
            })
        });
        u8::try_from(place).unwrap_or_default()
    }

    /// How far along everything is at `time`; `each` is room for what is not equally far.
    #[inline]
    pub(crate) fn shares<'a>(
        &self,
        time: Timestamp,
        each: &'a mut Option<[f64; MOST_FOLLOWED]>,
    ) -> Shares<'a> {
        let together = self.followed.first().map_or(0.0, |(_, pace)| pace.share(time));
        Shares { together, apart: if self.apart { Some(self.each(time, each)) } else { None } }
    }

    /// How far along whatever follows each channel is at `time`.
    #[inline(never)]
    fn each<'a>(
        &self,
        time: Timestamp,
        each: &'a mut Option<[f64; MOST_FOLLOWED]>,
    ) -> &'a [f64; MOST_FOLLOWED] {
        let each = each.insert([0.0; MOST_FOLLOWED]);
        each.iter_mut().zip(&self.followed).for_each(|(share, (_, pace))| *share = pace.share(time));
        each
    }

    /// How far along whatever follows a channel is at `time`.
    pub(crate) fn share(&self, channel: usize, time: Timestamp) -> f64 {
        let place = self.followed.iter().find(|(followed, _)| *followed == channel);
        place.map_or(0.0, |(_, pace)| pace.share(time))
    }

    /// Whether whatever follows a channel sets out at `time`.
    fn starts(&self, channel: usize, time: Timestamp) -> bool {
        self.followed.iter().any(|(followed, pace)| *followed == channel && pace.starts(time))
    }

    /// Goes on as others do.
    pub(crate) fn carry(&mut self, old: &Self) {
        old.followed.iter().for_each(|(channel, pace)| self.set(*channel, *pace));
    }

    /// Has everything that follows a channel go another way.
    pub(crate) fn set(&mut self, channel: usize, pace: Pace) {
        self.followed
            .iter_mut()
            .filter(|(followed, _)| *followed == channel)
            .for_each(|(_, old)| *old = pace);
        let first = self.followed.first().map(|(_, pace)| *pace);
        self.apart = self.followed.iter().any(|(_, pace)| Some(*pace) != first);
    }
}

/// `T` terms of each sensor of a kind.
///
/// Each line runs from one thermal evaluation to the next, so that the corrected rate has no staircase.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct Bank<const T: usize> {
    #[serde(with = "crate::written::array")]
    lines: [Line; T],
    /// Which of the shares is the sensor's.
    share_of: [u8; MAX_SENSORS],
    /// Sensors that have seen a reading: the first one is not approached from the assumed temperature, but met.
    started: SensorMask,
    /// Sensors of which an argument was outside its fitted range at the last evaluation.
    clamped: SensorMask,
    /// States of what trails behind the temperature, by sensor; empty where nothing does.
    trailed: Vec<Trailed>,
}

/// What of a unit's terms follows motion: force along the case axes and asymmetry of the gyros, squares of the accelerometers.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct MotionBanks {
    pub(crate) gyros: Bank<4>,
    pub(crate) accels: Bank<1>,
}

impl<const T: usize> Bank<T> {
    /// Starts with the terms as they are at the assumed temperature.
    pub(crate) fn new<S: Follows<T>>(sensors: &[S], filter: &ThermalFilter, paces: &mut Paces) -> Self {
        let any_trails = sensors.iter().any(|sensor| !sensor.trails().is_empty());
        let mut bank = Self {
            lines: [Line::ZERO; T],
            share_of: [paces.place(None); MAX_SENSORS],
            started: SensorMask::NONE,
            clamped: SensorMask::NONE,
            trailed: alloc::vec![[filter.assumed_deg_c; MAX_TRAILS]; if any_trails { sensors.len() } else { 0 }],
        };
        let assumed = ThermalState { temperature: filter.assumed_deg_c, ..ThermalState::default() };
        for (lane, sensor) in sensors.iter().take(MAX_SENSORS).enumerate() {
            bank.share_of[lane] = paces.place(sensor.channel());
            bank.head(lane, sensor, &assumed, (filter, &|_| None), None);
        }
        bank
    }

    /// States of what trails behind one sensor's temperature; anything for a sensor without.
    fn trailed(&self, lane: usize) -> &Trailed {
        const NOTHING: &Trailed = &[0.0; MAX_TRAILS];
        self.trailed.get(lane).unwrap_or(NOTHING)
    }

    /// Evaluates the terms of one sensor, which then are on their way to the result from where they are at a share of their present
    /// way; without one they are there.
    fn head<S: Follows<T>>(
        &mut self,
        lane: usize,
        sensor: &S,
        thermal: &ThermalState,
        (filter, others): (&ThermalFilter, Others<'_>),
        share: Option<f64>,
    ) {
        let state = SensorState { thermal, trailed: self.trailed(lane), others };
        let (terms, clamped) = sensor.terms(&state, filter);
        self.lines.iter_mut().zip(terms).for_each(|(line, term)| match share {
            Some(share) => line.turn(lane, share, term),
            None => line.hold(lane, term),
        });
        self.clamped = self.clamped.set(lane, clamped);
    }

    /// Goes on, after a silence, with what trails behind the temperature (°C) of a channel's sensors; where the sensor had no reading
    /// yet, from a temperature that is taken to have stood for ever.
    pub(crate) fn resume_trails<S: Follows<T>>(&mut self, sensors: &[S], channel: usize, temperature: f64) {
        for (lane, (sensor, trailed)) in sensors.iter().zip(&mut self.trailed).enumerate() {
            if sensor.channel() == Some(channel) {
                resume(sensor.trails(), trailed, temperature, !self.started.contains(lane));
            }
        }
    }

    /// Goes on with what trails in an earlier bank, where it is the same and `same` says so of the channels that the sensors follow.
    pub(crate) fn carry_trails<S: Follows<T>>(
        &mut self,
        sensors: &[S],
        (old_sensors, old): (&[S], &Self),
        same: impl Fn(Option<usize>, Option<usize>) -> bool,
    ) {
        let trailed = self.trailed.iter_mut().zip(&old.trailed);
        for ((sensor, before), (trailed, old)) in sensors.iter().zip(old_sensors).zip(trailed) {
            if same(sensor.channel(), before.channel()) && sensor.trails() == before.trails() {
                *trailed = *old;
            }
        }
    }

    /// Goes on with everything of the sensors that are the same in an earlier bank, on its way as it is.
    pub(crate) fn carry<S: PartialEq>(&mut self, sensors: &[S], (old_sensors, old): (&[S], &Self)) {
        for (lane, (sensor, before)) in sensors.iter().zip(old_sensors).enumerate() {
            if sensor != before {
                continue;
            }
            self.lines.iter_mut().zip(&old.lines).for_each(|(line, old)| line.copy_lane(old, lane));
            self.started = self.started.set(lane, old.started.contains(lane));
            self.clamped = self.clamped.set(lane, old.clamped.contains(lane));
            if let (Some(trailed), Some(old)) = (self.trailed.get_mut(lane), old.trailed.get(lane)) {
                *trailed = *old;
            }
        }
    }

    /// Moves on by one grid point what trails behind the temperature of a channel's sensors.
    pub(crate) fn grid_point<S: Follows<T>>(
        &mut self,
        sensors: &[S],
        channel: usize,
        thermal: &ThermalState,
    ) {
        for (sensor, trailed) in sensors.iter().zip(&mut self.trailed) {
            if sensor.channel() == Some(channel) {
                advance(sensor.trails(), trailed, thermal.temperature);
            }
        }
    }

    /// Evaluates every term of a channel's sensors, which then are on their way to the result from where they are at a share of their
    /// present way; without one, and those that had no reading yet, are there at once.
    pub(crate) fn update<S: Follows<T>>(
        &mut self,
        sensors: &[S],
        (channel, thermal): (usize, &ThermalState),
        within: (&ThermalFilter, Others<'_>),
        share: Option<f64>,
    ) {
        for (lane, sensor) in sensors.iter().enumerate() {
            if sensor.channel() == Some(channel) {
                self.head(lane, sensor, thermal, within, share.filter(|_| self.started.contains(lane)));
                self.started = self.started.with(lane);
            }
        }
    }

    /// Evaluates every term of the sensors that have a channel as a regressor, from which a reading came at `start`.
    ///
    /// Readings of one moment act together, in whatever order they come: a sensor that sets out at `start` sets out for the new
    /// result. A reading between acts with the next one of the sensor's own temperature; the `first` of all is met at once.
    pub(crate) fn join<S: Follows<T>>(
        &mut self,
        sensors: &[S],
        rests_on: impl Fn(&RegressorParts) -> bool,
        own_state: impl Fn(usize) -> Option<ThermalState>,
        within: (&ThermalFilter, Others<'_>),
        (paces, start, first): (&Paces, Timestamp, bool),
    ) {
        for (lane, sensor) in sensors.iter().enumerate() {
            let regressors = sensor.with_memory().map_or(&[][..], Terms::regressors);
            let concerned = self.started.contains(lane) && regressors.iter().any(&rests_on);
            let Some(own) = sensor.channel().filter(|_| concerned) else { continue };
            if let Some(thermal) = own_state(own).filter(|_| first || paces.starts(own, start)) {
                self.head(lane, sensor, &thermal, within, (!first).then_some(0.0));
            }
        }
    }

    /// Arrives at once where the terms are heading: after a step of the producer's clock the way there means nothing.
    pub(crate) fn settle(&mut self) {
        self.lines.iter_mut().for_each(Line::settle);
    }

    /// The first `F` terms so far along, term by term.
    #[expect(clippy::inline_always, reason = "once per tick: lanes that stay in registers")]
    #[inline(always)]
    pub(crate) fn at<const N: usize, const F: usize>(&self, shares: Shares<'_>) -> [[f64; N]; F] {
        const { assert!(F <= T, "no more terms than there are") }
        let share = match shares.apart {
            None => [shares.together; N],
            Some(apart) => array::from_fn(|lane| apart[usize::from(self.share_of[lane]) % MOST_FOLLOWED]),
        };
        array::from_fn(|term| self.lines[term].at(&share))
    }

    /// Whether any of these terms is not zero, or on its way from zero.
    pub(crate) fn has_any(&self, terms: [usize; 2]) -> bool {
        terms.into_iter().filter_map(|term| self.lines.get(term)).any(|line| *line != Line::ZERO)
    }

    /// Whether an argument of a sensor was outside its fitted range at the last evaluation.
    pub(crate) fn clamped(&self, lane: usize) -> bool {
        self.clamped.contains(lane)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    #[expect(clippy::float_cmp, reason = "continuity is to the bit")]
    fn a_turn_in_mid_way_is_continuous() {
        let at = |ms: i64| Timestamp::from_ns(ms * 1_000_000);
        for (from, to) in [(1.0, 2.0), (-1.0, -3.0)] {
            let mut ramp = Ramp::hold(from);
            ramp.turn(at(0), Span::from_ms(100), to);
            let before = ramp.at(at(40));
            ramp.turn(at(40), Span::from_ms(100), 0.0);
            assert_eq!(ramp.at(at(40)), before);
            assert_eq!(ramp.at(at(39)), before);
            assert!(ramp.at(at(140)).abs() < 1e-15);
        }
    }
}
