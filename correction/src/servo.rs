//! The perimeter-servo transient after a mode switch: "dynamic drift" [003; models §6].
//!
//! The switch leaves the cavity's perimeter off its optimum, and the servo pulls it in with time constant τ. The
//! dither frequency depends on the miss quadratically, so it recovers as
//!
//! ```text
//! f(t) = f0(T) − (f0 − f1)·e^(−2t/τ)
//! ```
//!
//! A tick's counts are the sum over two half periods of the dither of opposite sign, Δt/2 apart. While f is changing
//! the halves do not cancel, and the tick shows an apparent rate that must be subtracted:
//!
//! ```text
//! ΔΩ_i = s·K·tanh(Δt/2τ)·(f_i − f0)      s: sign of the dither in the tick's first half
//! ```
//!
//! The dither of a Zeeman laser is a magnetic field, and its effect changes sign with the lasing mode: where the
//! electronics do not turn the field with the mode, the negative half comes first in mode −. So the counts are taken in
//! order of time, c₁ and c₂, and s is the sign of c₁ − c₂. A frequency farther than f0/2 from f0 is not that of the dither:
//! nothing is subtracted then.
//!
//! models §6 has Δt/2τ, the first term of the hyperbolic tangent; with the tangent the result is exact for any
//! Δt (integrate the exponential over either half), and no duration, however broken, makes it large.
//!
//! The paper applies it from tick i = 2 on. Here it begins with i = 1, the first good tick after the transition:
//! that tick's halves do not cancel either, its own half-period counts measure `f_1 = f_i`, and it enters the
//! two-sided fit over the switch (models §5, step 3), which would carry its error into the restored angle.

mod decay;
mod parts;

use serde::{Deserialize, Serialize};

use decay::Decay;

pub use parts::{
    DEFAULT_SETTLE_TIME_CONSTANTS, SETTLE_RANGE, Servo, ServoForm, ServoParts, TIME_CONSTANT_RANGE_S,
};

use crate::lanes::Lanes;
use crate::sample::{HalfPeriodCounts, MAX_SENSORS};
use crate::units::{Span, Timestamp};

/// Share of f0 by which a frequency may differ from it and be the dither's: the miss of a switch costs less than that.
const FARTHEST_FROM_REST: f64 = 0.5;
/// Tick durations beyond which two ticks say nothing about the input's acceleration between them.
const REACH_TICKS: f64 = 16.0;

/// What the transient needs to know of one gyro in one good tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ServoTick {
    /// End of the tick on the producer's clock.
    pub end_time: Timestamp,
    /// Measured duration of the tick.
    pub duration: Span,
    /// The gyro's temperature (°C).
    pub temperature_deg_c: f64,
    /// K of the gyro at this temperature (rad per count).
    pub scale_rad_per_count: f64,
    /// The tick's half-period counts, where the instrument has them.
    pub half_periods: Option<HalfPeriodCounts>,
}

/// The transient of one gyro in one tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Transient {
    /// No transient: no switch yet, one under way, or the last one has settled.
    Settled,
    /// The apparent rate to subtract (rad/s).
    Apparent {
        /// `ΔΩ_i` of models §6, with the sign of the tick's first half.
        rate_rad_per_s: f64,
    },
    /// There is a transient, but no half-period counts to take it from, or none that the dither explains: nothing is
    /// subtracted.
    Unmeasured,
}

impl Transient {
    /// The rate to subtract: zero where there is none or it is not known (rad/s).
    #[must_use]
    pub const fn rate_rad_per_s(self) -> f64 {
        match self {
            Self::Apparent { rate_rad_per_s } => rate_rad_per_s,
            Self::Settled | Self::Unmeasured => 0.0,
        }
    }
}

/// Memory of the transients of one unit: all gyros switch together, each has its own `f_1`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ServoMemory {
    /// A transition is running: its ticks carry nothing.
    switching: bool,
    /// End of the last transition.
    settles_from: Option<Timestamp>,
    /// Per gyro: middle of the first tick measured after the transition, and its `s·f_1` (Hz).
    first: [Option<(Timestamp, f64)>; MAX_SENSORS],
    /// Per gyro: the exponential through all ticks measured since then.
    decays: [Decay; MAX_SENSORS],
    /// Per gyro: middle of the last good tick.
    last: [Timestamp; MAX_SENSORS],
    /// Per gyro: mean rate in it without the transient (counts/s); NaN where that is not known.
    last_mean_hz: Lanes,
}

impl Default for ServoMemory {
    fn default() -> Self {
        Self {
            switching: false,
            settles_from: None,
            first: [None; MAX_SENSORS],
            decays: [Decay::default(); MAX_SENSORS],
            last: [Timestamp::default(); MAX_SENSORS],
            last_mean_hz: [f64::NAN; MAX_SENSORS],
        }
    }
}

impl ServoMemory {
    /// Follows the transitions: call it once per tick, before the gyros are asked for.
    ///
    /// `lost` says that the tick falls into a transition (see
    /// [`Substitution::is_lost`](crate::reversal::Substitution::is_lost)).
    pub fn advance(&mut self, lost: bool, end_time: Timestamp, duration: Span) {
        if lost {
            let Self { last, last_mean_hz, .. } = *self;
            *self = Self { switching: true, last, last_mean_hz, ..Self::default() };
        } else if self.switching {
            self.switching = false;
            self.settles_from = Some(end_time - duration);
        }
    }

    /// Forgets every switch: call it when the producer restarts.
    pub fn reset(&mut self) {
        *self = Self::default();
    }

    /// The apparent rate of gyro `sensor` in the tick of the last [`advance`](Self::advance). Call it for every good
    /// tick: the last one before a switch tells how the input accelerates over it.
    ///
    /// Measured form: `s·f_i = (c₁ − c₂)/Δt + r·Δt/4` with the sign of rotation in the counts, since either half lasts
    /// Δt/2 and `f_i` is half the difference of their rates. The input rate cancels in it, also one beyond the
    /// dither's own; its acceleration r (counts/s²) does not, and comes from this tick and the last good one. Modelled
    /// form: `f_1` is taken the same way from the first tick that has half-period counts, and decays from that
    /// tick's middle. Fitted form: the exponential through all ticks since the switch, by least squares.
    pub fn apparent_rate(&mut self, sensor: usize, servo: &Servo, tick: &ServoTick) -> Transient {
        let middle = middle(tick.end_time, tick.duration);
        let mean_hz = tick.half_periods.map_or(f64::NAN, |counts| mean_hz(counts, tick.duration.as_s()));
        let (mut mean_left_hz, mut transient) = (mean_hz, Transient::Settled);
        if self.is_running(servo.settle_time_s(), middle) {
            let unbalance = servo.unbalance(tick.duration);
            let found = self.excess(sensor, servo, tick, (middle, mean_hz), unbalance);
            let excess = found.unwrap_or(Excess { sign: 1.0, hz: 0.0, taken_hz: 0.0 });
            mean_left_hz -= excess.sign * (unbalance * excess.hz);
            let rate = excess.sign * (tick.scale_rad_per_count * unbalance * excess.taken_hz);
            transient = if found.is_some() && rate.is_finite() {
                Transient::Apparent { rate_rad_per_s: rate }
            } else {
                Transient::Unmeasured
            };
        }
        if let (Some(last), Some(mean)) = (self.last.get_mut(sensor), self.last_mean_hz.get_mut(sensor)) {
            (*last, *mean) = (middle, mean_left_hz);
        }
        transient
    }

    /// Whether a servo that settles within `settles_s` (s) after a transition has a transient in a tick about `middle`.
    fn is_running(&self, settles_s: f64, middle: Timestamp) -> bool {
        // A tick before the end of the transition cannot be: its clock is broken.
        self.settles_from.is_some_and(|start| (0.0..=settles_s).contains(&middle.seconds_from(start)))
    }

    /// Where no servo has a transient, all of them settling within `settles_s` (s): remembers the tick, as
    /// [`apparent_rate`](Self::apparent_rate) does for each gyro.
    #[inline]
    pub(crate) fn pass_settled(
        &mut self,
        settles_s: f64,
        (end_time, duration): (Timestamp, Span),
        half_periods: &[HalfPeriodCounts],
    ) -> bool {
        let middle = middle(end_time, duration);
        if self.is_running(settles_s, middle) {
            return false;
        }
        let duration_s = duration.as_s();
        self.last = [middle; MAX_SENSORS];
        self.last_mean_hz = [f64::NAN; MAX_SENSORS];
        let known = self.last_mean_hz.iter_mut().zip(half_periods);
        known.for_each(|(mean, counts)| *mean = mean_hz(*counts, duration_s));
        true
    }

    /// `f_i − f0`, measured, modelled or fitted; `None` where there is nothing to take it from.
    fn excess(
        &mut self,
        sensor: usize,
        servo: &Servo,
        tick: &ServoTick,
        (middle, mean_hz): (Timestamp, f64),
        unbalance: f64,
    ) -> Option<Excess> {
        let rest_hz = servo.rest_frequency_hz.at(tick.temperature_deg_c).value.abs();
        let measured = tick.half_periods.and_then(|counts| {
            let signed_hz = frequency_hz(counts, tick.duration)?;
            let sign = if signed_hz < 0.0 { -1.0 } else { 1.0 };
            let (weight, change) = self.input_change(sensor, tick.duration.as_s(), (middle, mean_hz));
            // The change of rate since the last tick has `unbalance` times the excess itself in it.
            let hz = (sign * signed_hz - rest_hz + sign * (weight * change)) / (1.0 + weight * unbalance);
            (hz.abs() <= FARTHEST_FROM_REST * rest_hz).then_some(Excess { sign, hz, taken_hz: hz })
        });
        if servo.form == ServoForm::Measured {
            return measured;
        }
        let first = self.first.get_mut(sensor)?;
        if first.is_none() {
            *first = measured.map(|excess| (middle, excess.sign * (rest_hz + excess.hz)));
        }
        let (since, first_hz) = (*first)?;
        let sign = if first_hz < 0.0 { -1.0 } else { 1.0 };
        let decay = libm::exp(-2.0 * middle.seconds_from(since) / servo.time_constant_s);
        if servo.form == ServoForm::Modelled {
            let hz = (first_hz.abs() - rest_hz) * decay;
            return Some(Excess { sign, hz, taken_hz: hz });
        }
        // A half that came first before comes first now: a tick that says otherwise is broken.
        let measured = measured.filter(|excess| excess.sign.to_bits() == sign.to_bits());
        let gain = unbalance * tick.duration.as_s();
        let (hz, taken_s) =
            self.decays.get_mut(sensor)?.take(decay, measured.map(|excess| excess.hz), gain)?;
        Some(Excess { sign, hz, taken_hz: taken_s / gain })
    }

    /// Change of the mean rate since the last good tick (counts/s), and the weight with which it stands for r·Δt/4;
    /// nothing where that tick is too far away.
    fn input_change(&self, sensor: usize, duration_s: f64, (middle, now): (Timestamp, f64)) -> (f64, f64) {
        let (Some(then), Some(before)) = (self.last.get(sensor), self.last_mean_hz.get(sensor)) else {
            return (0.0, 0.0);
        };
        let (between_s, change) = (middle.seconds_from(*then), now - before);
        let near = between_s > 0.0 && between_s <= REACH_TICKS * duration_s && !change.is_nan();
        if near { (0.25 * duration_s / between_s, change) } else { (0.0, 0.0) }
    }
}

/// What the dither's frequency is in excess of its rest value in a tick.
#[derive(Debug, Clone, Copy)]
struct Excess {
    /// Sign of the dither in the tick's first half.
    sign: f64,
    /// `f_i − f0` (Hz).
    hz: f64,
    /// The same with what earlier ticks took too little of (Hz).
    taken_hz: f64,
}

/// Middle of a tick.
fn middle(end_time: Timestamp, duration: Span) -> Timestamp {
    end_time - duration.half()
}

/// `(c₁ + c₂)/Δt` (counts/s).
fn mean_hz(counts: HalfPeriodCounts, duration_s: f64) -> f64 {
    (f64::from(counts.positive) + f64::from(counts.negative)) / duration_s
}

/// `s·f_i = (c₁ − c₂)/Δt` (Hz); `None` for a tick without duration.
fn frequency_hz(counts: HalfPeriodCounts, duration: Span) -> Option<f64> {
    let difference = f64::from(counts.positive) - f64::from(counts.negative);
    (duration > Span::ZERO).then(|| difference / duration.as_s())
}

#[cfg(test)]
mod tests;
