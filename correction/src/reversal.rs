//! The four-step substitution over a mode switch [003; models §5].
//!
//! While the lasing mode switches, n = 1…32 ticks carry nothing. Tick j = 0 is the last good one, j = 1 the
//! commanded one:
//!
//! 1. before: a polynomial is fitted to the last good readings (by default j = −3…0);
//! 2. during, j = 1…n: the predicted increments are published, flagged interpolated;
//! 3. after: a second polynomial is fitted to readings from both sides (by default j = −1, 0, n+1, n+2);
//! 4. `Σ_j (P_fit(j) − P_pred(j))` over the published ticks is added to the next good reading (j = n+3).
//!
//! Everything runs on the ticks' own times, so a gap in the stream shifts no abscissa, and a tick that is
//! missing is not restored: it is announced as a gap, which the navigator bridges by itself. The mode-dependent
//! bias must already be out of the increments; it would be fitted as a step.

mod fit;
mod history;
mod parts;
mod restoration;
mod window;

use arrayvec::ArrayVec;
use serde::{Deserialize, Serialize};

use fit::{Fit, Points};
use history::{History, Reading, mid_time_s};

pub use parts::{
    FitWindow, MAX_FIT_DEGREE, MAX_FIT_READINGS, MAX_PREDICT_DEGREE, MAX_TRANSITION_TICKS, Reversal,
    ReversalParts, TRANSITION_RANGE_S, Transition,
};
pub(crate) use restoration::{Gain, Restoration};
pub use window::MIN_ADAPTIVE_READINGS;

use crate::lanes::Lanes;
use crate::later::Later;
use crate::orientation::SensorMask;
use crate::sample::{LasingMode, MAX_SENSORS, TickFlags};
use crate::units::{Span, Timestamp};

/// Most interpolated ticks that can wait for one two-sided fit: two of the longest transitions (switches back to back).
pub const MAX_LOST_TICKS: usize = 2 * MAX_TRANSITION_TICKS as usize;

/// What the substitution must know of a tick besides its increments.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct TickInput {
    /// End of the tick on the producer's clock.
    pub end_time: Timestamp,
    /// Measured duration of the tick.
    pub duration: Span,
    /// Lasing mode commanded at the end of the tick; `None` for an instrument without modes.
    pub mode: Option<LasingMode>,
    /// The switch was commanded at the start of this tick: j = 1.
    pub switch_command: bool,
    /// Ticks that were lost right before this one.
    pub missed: u64,
    /// The producer restarted: nothing before this tick can be related to it.
    pub restart: bool,
}

/// An interpolated tick that has been published and waits for the two-sided fit.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
struct LostTick {
    end_time: Timestamp,
    duration: Span,
    /// What was published per sensor (rad).
    predicted: [f64; MAX_SENSORS],
    /// Sensors of the tick.
    sensors: usize,
}

/// Good readings on one side of a switch, with their places among all and their abscissas (s).
type Window<'a> = ArrayVec<(usize, f64, &'a Reading), { MAX_FIT_READINGS as usize }>;
/// Those of one sensor.
type Side = ArrayVec<[f64; 2], { MAX_FIT_READINGS as usize }>;

/// Memory of the substitution of one unit: all gyros switch together.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct Substitution {
    /// Good readings, uncorrected.
    history: History,
    /// Interpolated ticks without their fit; no good reading lies between two of them.
    lost: Later<LostTick, MAX_LOST_TICKS>,
    /// Good readings since the last tick of `lost`.
    after: usize,
    /// Angle per sensor that the next good reading brings back (rad).
    pending: Option<[f64; MAX_SENSORS]>,
    /// Sensors of which the switch at hand has no reading to predict from, or none to fit.
    apart: SensorMask,
    /// Ticks of the running transition that are still to come.
    left: u8,
    /// Mode of the last tick that stated one.
    mode: Option<LasingMode>,
    /// A command has been seen, but the mode has not changed yet: the change, when it comes, is that
    /// command's and not a second switch.
    change_due: bool,
}

impl Substitution {
    /// Whether the coming tick carries nothing: it falls into a transition that is running or begins with it.
    ///
    /// For terms that need to know before [`tick`](Self::tick) is called (the perimeter servo).
    #[must_use]
    pub fn is_lost(&self, reversal: &Reversal, input: &TickInput) -> bool {
        (self.left > 0 || self.may_switch(input)) && self.left_from(*reversal, input) > 0
    }

    /// Whether a tick says anything of a switch.
    fn may_switch(&self, input: &TickInput) -> bool {
        input.switch_command || input.mode != self.mode
    }

    /// Whether no transition is running and no angle waits to be restored.
    #[must_use]
    pub fn is_settled(&self) -> bool {
        self.left == 0 && self.lost.is_empty() && self.pending.is_none()
    }

    /// Takes one tick: replaces the increments of a lost tick, restores angle in a good one.
    ///
    /// `increments` are the angle increments per sensor (rad), scaled and with every bias removed; those of a
    /// lost tick are overwritten unread. The readings of sensors outside `counted` are no basis of a bridge. Returns
    /// which of `INTERPOLATED`, `ANGLE_RESTORED` and `SWITCH_UNRESOLVED` apply to all sensors but those without a
    /// reading about the switch, which stand apart.
    ///
    /// A mode that differs from the last one without a command begins a transition at this tick; where ticks
    /// are missing before it the switch may have come later than the gap's start, so all n are counted
    /// from here. Ticks missing inside a transition count as ticks of it.
    pub fn tick(
        &mut self,
        reversal: &Reversal,
        input: TickInput,
        increments: &mut [f64],
        counted: SensorMask,
    ) -> TickFlags {
        let mut flags = TickFlags::empty();
        if input.restart {
            if !(self.lost.is_empty() && self.pending.is_none()) {
                flags |= TickFlags::SWITCH_UNRESOLVED;
            }
            *self = Self::default();
        }

        let left = self.left_from(*reversal, &input);
        self.note_mode(&input, left > 0);
        self.left = left.saturating_sub(1);
        let resolved = if left > 0 {
            self.take_lost(*reversal, &input, increments, &mut flags)
        } else {
            self.take_good(*reversal, &input, (increments, counted), &mut flags)
        };
        if !resolved {
            flags |= TickFlags::SWITCH_UNRESOLVED;
        }
        flags
    }

    /// Sensors whose increment in an `INTERPOLATED` or `ANGLE_RESTORED` tick just taken is none that a bridge made: without a reading to
    /// predict from, or without one to fit behind the switch.
    pub(crate) fn apart(&self) -> SensorMask {
        self.apart
    }

    /// Whether a tick has nothing to do with a switch: it [passes](Self::pass) as it is, and [`tick`](Self::tick) would do the same.
    #[inline]
    pub(crate) fn passes(&self, input: &TickInput) -> bool {
        self.is_settled() && !input.restart && !self.may_switch(input)
    }

    /// Remembers the rates (rad/s) of the sensors in a tick that [passes](Self::passes); NaN where no reading counts.
    #[expect(clippy::inline_always, reason = "once per tick: the reading is made where it is put")]
    #[inline(always)]
    pub(crate) fn pass(&mut self, input: &TickInput, rates: Lanes) {
        self.change_due = false;
        if let Some(reading) = Reading::of(input.end_time, input.duration, rates) {
            self.history.push(reading);
        }
    }

    /// Ticks of the transition still to come, the coming one included.
    fn left_from(&self, reversal: Reversal, input: &TickInput) -> u8 {
        let changed = matches!((self.mode, input.mode), (Some(old), Some(new)) if old != new);
        if input.switch_command || (changed && !input.restart && !self.change_due) {
            reversal.parts.transition.ticks(input.duration)
        } else if input.restart {
            0
        } else {
            self.left.saturating_sub(u8::try_from(input.missed).unwrap_or(u8::MAX))
        }
    }

    /// Remembers the mode and whether a command's change is still due.
    fn note_mode(&mut self, input: &TickInput, lost: bool) {
        let changed = matches!((self.mode, input.mode), (Some(old), Some(new)) if old != new);
        if input.switch_command {
            self.change_due = self.mode.is_some() && !changed;
        } else if changed || !lost {
            // A producer that reports the mode as it is, not as it is commanded, changes it at the
            // latest with the first good tick.
            self.change_due = false;
        }
        self.mode = input.mode.or(self.mode);
    }

    /// Step 2. Returns false where an angle had to be given up.
    fn take_lost(
        &mut self,
        reversal: Reversal,
        input: &TickInput,
        increments: &mut [f64],
        flags: &mut TickFlags,
    ) -> bool {
        let mut resolved = true;
        // The switch before this one gets the fit that its readings allow; without any it is bridged
        // together with this one.
        if self.after > 0 || self.is_overdue(reversal, input, None) {
            resolved = self.resolve(reversal);
        }
        *flags |= TickFlags::INTERPOLATED;
        if self.lost.is_empty() && self.pending.is_none() {
            self.apart = SensorMask::NONE;
        }
        let predicted = self.predict(reversal, input);
        for (increment, predicted) in increments.iter_mut().zip(&predicted) {
            *increment = *predicted;
        }
        let most = usize::from(reversal.reach_ticks(input.duration));
        let lost = self.lost.room();
        while lost.len() >= most {
            lost.remove(0);
            resolved = false;
        }
        let (end_time, duration) = (input.end_time, input.duration);
        lost.push(LostTick { end_time, duration, predicted, sensors: increments.len() });
        // What comes behind a transition that is cut is still part of it, and taken as it reads.
        resolved && !(self.left == 0 && reversal.parts.transition.is_cut(duration))
    }

    /// Steps 3 and 4. Returns false where an angle had to be given up.
    fn take_good(
        &mut self,
        reversal: Reversal,
        input: &TickInput,
        (increments, counted): (&mut [f64], SensorMask),
        flags: &mut TickFlags,
    ) -> bool {
        let rates = rates(increments, input.duration, counted);
        let reading = Reading::of(input.end_time, input.duration, rates);
        let mut resolved = true;
        if self.is_overdue(reversal, input, reading.as_ref()) {
            resolved = self.resolve(reversal);
        }
        if let Some(pending) = self.pending.take() {
            for (increment, angle) in increments.iter_mut().zip(&pending) {
                *increment += angle;
            }
            *flags |= TickFlags::ANGLE_RESTORED;
        }
        if let Some(reading) = reading {
            self.history.push(reading);
            if !self.lost.is_empty() {
                self.after += 1;
                if self.after >= usize::from(reversal.parts.fit_readings_after) {
                    resolved &= self.resolve(reversal);
                }
            }
        }
        resolved
    }

    /// Whether the readings after the switch are no longer to be waited for.
    fn is_overdue(&self, reversal: Reversal, input: &TickInput, reading: Option<&Reading>) -> bool {
        let Some(last) = self.lost.last() else {
            return false;
        };
        let known = self.history.newest().or(reading);
        let nominal = known.map_or(last.duration, |reading| reading.duration);
        let waited = mid_time_s(input.end_time, input.duration, last.end_time)
            - mid_time_s(last.end_time, last.duration, last.end_time);
        waited.abs() > reach_s(reversal, nominal)
    }

    /// `P_pred` of the coming tick per sensor (rad); zero where nothing is known. A sensor of which less is known than of others stands
    /// apart.
    fn predict(&mut self, reversal: Reversal, input: &TickInput) -> [f64; MAX_SENSORS] {
        let mut predicted = [0.0; MAX_SENSORS];
        let x = mid_time_s(input.end_time, input.duration, input.end_time);
        let window: Window<'_> = predicting(&self.history, reversal, 0, (input.end_time, x)).collect();
        for (sensor, predicted) in predicted.iter_mut().enumerate() {
            let points: Points = window.iter().filter_map(|(_, at, r)| r.point(*at, sensor)).collect();
            if points.is_empty() && !window.is_empty() {
                self.apart = self.apart.with(sensor);
            }
            let fit = Fit::new(&points, reversal.parts.predict_degree.into());
            let angle = fit.map_or(0.0, |fit| fit.at(x) * input.duration.as_s());
            *predicted = if angle.is_finite() { angle } else { 0.0 };
        }
        predicted
    }

    /// Step 3 for the ticks in `lost`, with the readings at hand; the correction becomes pending.
    ///
    /// Returns false where the angle of a tick could not be restored.
    fn resolve(&mut self, reversal: Reversal) -> bool {
        let waiting = self.lost.take();
        let after = core::mem::take(&mut self.after);
        let (Some(first), Some(last), Some(newest)) =
            (waiting.first(), waiting.last(), self.history.newest())
        else {
            return waiting.is_empty();
        };
        if after == 0 {
            return false;
        }
        let origin = first.end_time;
        let reach = reach_s(reversal, newest.duration);
        let mut resolved = true;
        let mut any_restored = false;
        let mut restored = [0.0; MAX_SENSORS];
        for (sensor, restored) in restored.iter_mut().enumerate().take(last.sensors) {
            let Some(points) = fit_points(&self.history, reversal, &waiting, after, sensor) else {
                // Nothing new is known of this sensor: the prediction stands.
                self.apart = self.apart.with(sensor);
                continue;
            };
            let Some(fit) = Fit::new(&points, reversal.parts.fit_degree.into()) else {
                continue;
            };
            for (tick, predicted) in
                waiting.iter().filter_map(|tick| Some((tick, tick.predicted.get(sensor)?)))
            {
                let x = mid_time_s(tick.end_time, tick.duration, origin);
                let correction = fit.at(x) * tick.duration.as_s() - predicted;
                let within = points.iter().any(|[at, _]| (at - x).abs() <= reach);
                if within && tick.duration.as_s() <= reach && correction.is_finite() {
                    *restored += correction;
                    any_restored = true;
                } else {
                    resolved = false;
                }
            }
        }
        if !any_restored {
            return false;
        }
        let pending = self.pending.get_or_insert([0.0; MAX_SENSORS]);
        for (pending, restored) in pending.iter_mut().zip(&restored) {
            *pending += restored;
        }
        resolved
    }
}

/// Rates (rad/s) of the sensors that gained these angles (rad) in a tick; NaN where no reading counts.
fn rates(increments: &[f64], duration: Span, counted: SensorMask) -> Lanes {
    let (mut rates, duration_s) = ([f64::NAN; MAX_SENSORS], duration.as_s());
    let lanes = rates.iter_mut().zip(increments).enumerate().filter(|(lane, _)| counted.contains(*lane));
    lanes.for_each(|(_, (rate, increment))| *rate = increment / duration_s);
    rates
}

/// How far a reading may be from a lost tick to say something about it (s), at ticks of a duration.
fn reach_s(reversal: Reversal, duration: Span) -> f64 {
    f64::from(reversal.reach_ticks(duration)) * duration.as_s()
}

/// Readings that a lost tick is predicted from, of those before the newest `after`: the newest first, with their places among all and
/// their abscissas from `origin`, from which `x` is that of the tick (s).
fn predicting(
    history: &History,
    reversal: Reversal,
    after: usize,
    (origin, x): (Timestamp, f64),
) -> impl Iterator<Item = (usize, f64, &Reading)> {
    let mut readings = history.newest_first().enumerate().skip(after).peekable();
    let reach = readings.peek().map_or(0.0, |(_, newest)| reach_s(reversal, newest.duration));
    let timed = readings.take(reversal.parts.predict_readings.into());
    let timed = timed.map(move |(place, reading)| (place, reading.mid_time_s(origin), reading));
    timed.filter(move |(_, at, _)| (x - at).abs() <= reach)
}

/// Readings of one sensor for the fit over lost ticks: the first of the newest `after`, which came behind the switch, and the last ones
/// before them; `None` where none came behind it.
fn fit_points(
    history: &History,
    reversal: Reversal,
    bridged: &[LostTick],
    after: usize,
    sensor: usize,
) -> Option<Points> {
    let (first, last, newest) = (bridged.first()?, bridged.last()?, history.newest()?);
    let (parts, origin) = (&reversal.parts, first.end_time);
    let reach = reach_s(reversal, newest.duration);
    let side = |skip: usize, take: usize, tick: &LostTick| -> Side {
        let edge = mid_time_s(tick.end_time, tick.duration, origin);
        let readings = history.newest_first().skip(skip).take(take);
        let timed = readings.map(|reading| (reading.mid_time_s(origin), reading));
        let near = timed.filter(|(at, _)| (at - edge).abs() <= reach);
        near.filter_map(|(at, reading)| reading.point(at, sensor)).collect()
    };
    let taken = after.min(parts.fit_readings_after.into());
    let mut new = side(after - taken, taken, last);
    let mut old = side(after, parts.fit_readings_before.into(), first);
    if new.is_empty() {
        return None;
    }
    if parts.fit_window == FitWindow::Adaptive {
        shorten(&mut old, &mut new, bridged, origin, parts.fit_degree.into());
    }
    Some(new.into_iter().chain(old).collect())
}

/// Leaves the readings of one sensor, newest first on either side, that make the best fit over the lost ticks.
fn shorten(old: &mut Side, new: &mut Side, lost: &[LostTick], origin: Timestamp, degree: usize) {
    let bridged: ArrayVec<[f64; 2], MAX_LOST_TICKS> = (lost.iter().take(MAX_LOST_TICKS))
        .map(|tick| [mid_time_s(tick.end_time, tick.duration, origin), tick.duration.as_s()])
        .collect();
    let outwards: Side = new.iter().rev().copied().collect();
    let readings = window::choose(old, &outwards, &bridged, degree);
    old.truncate(readings);
    new.drain(..new.len().saturating_sub(readings));
}

#[cfg(test)]
mod tests;
