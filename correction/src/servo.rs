//! The perimeter-servo transient after a mode switch: "dynamic drift" [003; models §6].
//!
//! The switch leaves the cavity's perimeter off its optimum, and the servo pulls it in with time constant τ. The
//! dither frequency depends on the miss quadratically, so it recovers as
//!
//! ```text
//! f(t) = f0(T) − (f0 − f1)·e^(−2t/τ)
//! ```
//!
//! A tick's counts are the sum over a positive and a negative half period of the dither, Δt/2 apart. While f
//! is changing the halves do not cancel, and the tick shows an apparent rate that must be subtracted:
//!
//! ```text
//! ΔΩ_i = K·tanh(Δt/2τ)·(f_i − f0)        positive half period first
//! ```
//!
//! models §6 has Δt/2τ, the first term of the hyperbolic tangent; with the tangent the result is exact for any
//! Δt (integrate the exponential over either half), and no duration, however broken, makes it large.
//!
//! The paper applies it from tick i = 2 on. Here it begins with i = 1, the first good tick after the transition:
//! that tick's halves do not cancel either, its own half-period counts measure `f_1 = f_i`, and it enters the
//! two-sided fit over the switch (models §5, step 3), which would carry its error into the restored angle.

use alloc::vec::Vec;

use serde::{Deserialize, Serialize};

use crate::curve::{Curve, CurveError, CurveParts};
use crate::lanes::Lanes;
use crate::sample::{HalfPeriodCounts, MAX_SENSORS};
use crate::stated::{OutOfRange, outside};
use crate::units::{Span, Timestamp};

/// Shortest and longest time constant of a servo (s).
pub const TIME_CONSTANT_RANGE_S: [f64; 2] = [1e-4, 1e3];
/// Fewest and most time constants after which the transient counts as settled.
pub const SETTLE_RANGE: [f64; 2] = [1.0, 20.0];
/// Time constants after which the transient counts as settled, where nothing else is stated: e⁻¹⁶ remains.
pub const DEFAULT_SETTLE_TIME_CONSTANTS: f64 = 8.0;

/// Tick durations beyond which two ticks say nothing about the input's acceleration between them.
const REACH_TICKS: f64 = 16.0;

/// Where `f_i` comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum ServoForm {
    /// From the half-period counts of each tick.
    Measured,
    /// From those of the first good tick and the exponential: less noise where τ is well known.
    Modelled,
}

/// The servo of one gyro as the calibration document states it.
#[derive(Debug, Clone, PartialEq)]
pub struct ServoParts {
    /// Where `f_i` comes from.
    pub form: ServoForm,
    /// τ (s, 10⁻⁴…10³).
    pub time_constant_s: f64,
    /// f0: dither frequency at rest (Hz: counts per second within a half period) over temperature (°C).
    pub rest_frequency: CurveParts,
    /// The correction stops this many τ after the transition (1…20).
    pub settle_time_constants: f64,
}

/// What is wrong with a stated servo.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ServoError {
    /// A number is outside its range, or not a number.
    #[error(transparent)]
    OutOfRange(OutOfRange),
    /// The rest frequency is not a valid curve.
    #[error("rest_frequency: {0}")]
    RestFrequency(CurveError),
}

/// A validated servo of one gyro.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Servo {
    form: ServoForm,
    time_constant_s: f64,
    rest_frequency_hz: Curve,
    settle_time_constants: f64,
}

impl Servo {
    /// Validates a stated servo.
    ///
    /// # Errors
    ///
    /// Everything that is wrong with it.
    pub fn new(parts: &ServoParts) -> Result<Self, Vec<ServoError>> {
        let stated = outside([
            ("time_constant_s", parts.time_constant_s, TIME_CONSTANT_RANGE_S),
            ("settle_time_constants", parts.settle_time_constants, SETTLE_RANGE),
        ]);
        let mut errors: Vec<_> = stated.map(ServoError::OutOfRange).collect();
        match Curve::new(&parts.rest_frequency) {
            Ok(rest_frequency_hz) if errors.is_empty() => Ok(Self {
                form: parts.form,
                time_constant_s: parts.time_constant_s,
                rest_frequency_hz,
                settle_time_constants: parts.settle_time_constants,
            }),
            Ok(_) => Err(errors),
            Err(error) => {
                errors.push(ServoError::RestFrequency(error));
                Err(errors)
            }
        }
    }

    /// Time after the transition from which nothing is subtracted (s).
    #[must_use]
    pub fn settle_time_s(&self) -> f64 {
        self.settle_time_constants * self.time_constant_s
    }
}

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
        /// `ΔΩ_i` of models §6.
        rate_rad_per_s: f64,
    },
    /// There is a transient, but no half-period counts to take it from: nothing is subtracted.
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
    /// Per gyro: middle of the first tick measured after the transition, and its `f_1` (Hz).
    first: [Option<(Timestamp, f64)>; MAX_SENSORS],
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
            last: [Timestamp::default(); MAX_SENSORS],
            last_mean_hz: [f64::NAN; MAX_SENSORS],
        }
    }
}

impl ServoMemory {
    /// A memory that has seen no switch.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

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
    /// Measured form: `f_i = (c⁺ − c⁻)/Δt + r·Δt/4` with the sign of rotation in the counts, since either half lasts
    /// Δt/2 and `f_i` is half the difference of their rates. The input rate cancels in it, also one beyond the
    /// dither's own; its acceleration r (counts/s²) does not, and comes from this tick and the last good one. Modelled
    /// form: `f_1` is taken the same way from the first tick that has half-period counts, and decays from that
    /// tick's middle.
    pub fn apparent_rate(&mut self, sensor: usize, servo: &Servo, tick: &ServoTick) -> Transient {
        let middle = middle(tick.end_time, tick.duration);
        let mean_hz = tick.half_periods.map_or(f64::NAN, |counts| mean_hz(counts, tick.duration.as_s()));
        let (mut mean_left_hz, mut transient) = (mean_hz, Transient::Settled);
        if self.is_running(servo.settle_time_s(), middle) {
            let unbalance = libm::tanh(tick.duration.as_s() / (2.0 * servo.time_constant_s));
            let excess_hz = self.frequency_excess_hz(sensor, servo, tick, (middle, mean_hz), unbalance);
            mean_left_hz -= unbalance * excess_hz.unwrap_or(0.0);
            let rate = excess_hz.map(|excess_hz| tick.scale_rad_per_count * unbalance * excess_hz);
            transient = match rate.filter(|rate| rate.is_finite()) {
                Some(rate_rad_per_s) => Transient::Apparent { rate_rad_per_s },
                None => Transient::Unmeasured,
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
        let mut means_hz = [f64::NAN; MAX_SENSORS];
        let known = means_hz.iter_mut().zip(half_periods);
        known.for_each(|(mean, counts)| *mean = mean_hz(*counts, duration_s));
        (self.last, self.last_mean_hz) = ([middle; MAX_SENSORS], means_hz);
        true
    }

    /// `f_i − f0` (Hz), measured or modelled.
    fn frequency_excess_hz(
        &mut self,
        sensor: usize,
        servo: &Servo,
        tick: &ServoTick,
        (middle, mean_hz): (Timestamp, f64),
        unbalance: f64,
    ) -> Option<f64> {
        let rest_hz = servo.rest_frequency_hz.at(tick.temperature_deg_c).value;
        let measured = tick.half_periods.and_then(|counts| {
            let excess = frequency_hz(counts, tick.duration)? - rest_hz;
            let (weight, change) = self.input_change(sensor, tick.duration.as_s(), (middle, mean_hz));
            // The change of rate since the last tick has `unbalance` times the excess itself in it.
            Some((excess + weight * change) / (1.0 + weight * unbalance))
        });
        if servo.form == ServoForm::Measured {
            return measured;
        }
        let first = self.first.get_mut(sensor)?;
        if first.is_none() {
            *first = measured.map(|excess| (middle, rest_hz + excess));
        }
        let (since, first_hz) = (*first)?;
        let decay = libm::exp(-2.0 * middle.seconds_from(since) / servo.time_constant_s);
        Some((first_hz - rest_hz) * decay)
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

/// Middle of a tick.
fn middle(end_time: Timestamp, duration: Span) -> Timestamp {
    end_time - Span::from_ns(duration.as_ns() / 2)
}

/// `(c⁺ + c⁻)/Δt` (counts/s).
fn mean_hz(counts: HalfPeriodCounts, duration_s: f64) -> f64 {
    (f64::from(counts.positive) + f64::from(counts.negative)) / duration_s
}

/// `f_i = (c⁺ − c⁻)/Δt` (Hz); `None` for a tick without duration.
fn frequency_hz(counts: HalfPeriodCounts, duration: Span) -> Option<f64> {
    let difference = f64::from(counts.positive) - f64::from(counts.negative);
    (duration > Span::ZERO).then(|| difference / duration.as_s())
}

#[cfg(test)]
mod tests;
