//! What the fits over a mode switch make of the noise of the readings.
//!
//! Predictions and fits are linear in the readings. Their weights are found by the fits themselves, one reading at a time, and
//! only in ticks of a switch.

use arrayvec::ArrayVec;
use serde::{Deserialize, Serialize};

use super::fit::{Fit, Points};
use super::history::{Reading, mid_time_s};
use super::{LostTick, MAX_LOST_TICKS, Reversal, Substitution, fit_points, predicting};
use crate::later::Later;
use crate::sample::{MAX_SENSORS, TickFlags};
use crate::units::{Span, Timestamp};

/// Readings that fits rest on: eight on either side.
const READINGS: usize = 2 * super::MAX_FIT_READINGS as usize;

/// Variance of an angle that fits made, per variance of the readings.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct Gain {
    /// Times N² (s).
    pub(crate) white: f64,
    /// Times Q²: a reading is the difference of two instants, each of them shared with its neighbour.
    pub(crate) instants: f64,
}

impl Gain {
    const UNKNOWN: Self = Self { white: f64::NAN, instants: f64::NAN };
}

/// The lost ticks whose fit is to come, and what the angle that waits to be restored has in it.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub(crate) struct Restoration {
    lost: Later<LostTick, MAX_LOST_TICKS>,
    pending: Option<[Gain; MAX_SENSORS]>,
}

impl Restoration {
    /// Follows a tick that the substitution has just taken, with what flags; how much of the readings' noise each sensor's increment
    /// has through fits, beside its own reading. `None` where it has none.
    pub(crate) fn follow(
        &mut self,
        substitution: &Substitution,
        reversal: Reversal,
        (end_time, duration): (Timestamp, Span),
        flags: TickFlags,
    ) -> Option<[Gain; MAX_SENSORS]> {
        if flags.contains(TickFlags::INTERPOLATED) {
            let lost = LostTick { end_time, duration, predicted: [0.0; MAX_SENSORS], sensors: MAX_SENSORS };
            let room = self.lost.room();
            if substitution.lost.len() <= 1 {
                room.clear();
            }
            if substitution.pending.is_some() {
                // The switch before was resolved with what readings there were between the two.
                self.pending = Some([Gain::UNKNOWN; MAX_SENSORS]);
            }
            if room.is_full() {
                room.remove(0);
            }
            room.push(lost);
            return Some(core::array::from_fn(|sensor| {
                let mut weights = Weights::default();
                let known = weights.predict(substitution, reversal, (sensor, 0), &lost, 1.0);
                if known { weights.gain(substitution) } else { Gain::UNKNOWN }
            }));
        }
        let restored = flags.contains(TickFlags::ANGLE_RESTORED).then(|| {
            let gains = self.pending.take().unwrap_or([Gain::UNKNOWN; MAX_SENSORS]);
            if flags.contains(TickFlags::SWITCH_UNRESOLVED) { [Gain::UNKNOWN; MAX_SENSORS] } else { gains }
        });
        if substitution.pending.is_none() {
            self.pending = None;
        } else if self.pending.is_none() && substitution.lost.is_empty() {
            let after = usize::from(reversal.parts.fit_readings_after);
            self.pending =
                Some(core::array::from_fn(|sensor| self.fitted(substitution, reversal, sensor, after)));
            self.lost.take();
        }
        restored
    }

    /// What `Σ_j (P_fit(j) − P_pred(j))` of one sensor has, right after the last of `after` readings.
    fn fitted(&self, substitution: &Substitution, reversal: Reversal, sensor: usize, after: usize) -> Gain {
        let points = fit_points(&substitution.history, reversal, &self.lost, after, sensor);
        let (Some(first), Some(points)) = (self.lost.first(), points) else { return Gain::UNKNOWN };
        let origin = first.end_time;
        let mut weights = Weights::default();
        for (place, [at, _]) in points.iter().enumerate() {
            let fit = Fit::new(&unit(&points, place), reversal.parts.fit_degree.into());
            let over_lost = self.lost.iter().map(|tick| {
                let x = mid_time_s(tick.end_time, tick.duration, origin);
                fit.map_or(0.0, |fit| fit.at(x) * tick.duration.as_s())
            });
            let is_it = |reading: &Reading| reading.mid_time_s(origin).to_bits() == at.to_bits();
            weights.add(substitution, is_it, over_lost.sum());
        }
        for tick in &*self.lost {
            weights.predict(substitution, reversal, (sensor, after), tick, -1.0);
        }
        weights.gain(substitution)
    }
}

/// The points with ordinates of 0, but for one of 1.
fn unit(points: &Points, place: usize) -> Points {
    points.iter().enumerate().map(|(i, [at, _])| [*at, if i == place { 1.0 } else { 0.0 }]).collect()
}

/// Weights of the rates of readings in an angle (s), the newest reading first.
#[derive(Debug, Default)]
struct Weights([f64; READINGS]);

impl Weights {
    fn add(&mut self, substitution: &Substitution, is_it: impl Fn(&Reading) -> bool, weight: f64) {
        let place = substitution.history.newest_first().position(is_it);
        if let Some(to) = place.and_then(|place| self.0.get_mut(place)) {
            *to += weight;
        }
    }

    /// Adds `times` the prediction of a lost tick from the readings before the newest `after`. Whether there are any.
    fn predict(
        &mut self,
        substitution: &Substitution,
        reversal: Reversal,
        (sensor, after): (usize, usize),
        tick: &LostTick,
        times: f64,
    ) -> bool {
        let x = mid_time_s(tick.end_time, tick.duration, tick.end_time);
        let readings = predicting(&substitution.history, reversal, after, (tick.end_time, x));
        let used = readings.filter_map(|(place, at, reading)| Some((place, reading.point(at, sensor)?)));
        let used: ArrayVec<(usize, [f64; 2]), READINGS> = used.collect();
        let points: Points = used.iter().map(|(_, point)| *point).collect();
        for (index, (place, _)) in used.iter().enumerate() {
            let fit = Fit::new(&unit(&points, index), reversal.parts.predict_degree.into());
            let weight = fit.map_or(0.0, |fit| fit.at(x) * tick.duration.as_s());
            if let Some(to) = self.0.get_mut(*place) {
                *to += times * weight;
            }
        }
        !used.is_empty()
    }

    /// Variance of the angle.
    fn gain(&self, substitution: &Substitution) -> Gain {
        let mut gain = Gain { white: 0.0, instants: 0.0 };
        // Weight of the later neighbour per time, and where that begins.
        let mut later: Option<(f64, Timestamp)> = None;
        for (weight, reading) in self.0.iter().zip(substitution.history.newest_first()) {
            let (start, end) = reading.ends();
            let share = weight / reading.duration.as_s();
            gain.white += weight * share;
            gain.instants += match later {
                Some((next, from)) if from == end => (share - next) * (share - next),
                Some((next, _)) => next * next + share * share,
                None => share * share,
            };
            later = Some((share, start));
        }
        gain.instants += later.map_or(0.0, |(share, _)| share * share);
        gain
    }
}
