//! Sums of ticks as output steps, with coning and sculling terms where asked for (models §10).
//!
//! Over the ticks l of a step, with α and ν the sums of angle and velocity increments before tick l:
//!
//! ```text
//! β  += ½·(α + Δα_{l−1}/6) × Δα_l
//! σ  += ½·[(α + Δα_{l−1}/6) × Δν_l + (ν + Δν_{l−1}/6) × Δα_l]
//! Δθ  = α + β
//! Δv  = ν + ρ + σ,    ρ = (1 − cos a)/a²·α×ν + (1 − sin a/a)/a²·α×(α×ν),   a = |α|
//! ```
//!
//! Source: P. G. Savage, Strapdown inertial navigation integration algorithm design, J. Guidance, Control and
//! Dynamics 21 (1998): part 1, the coning integral with the 1/6 term of the preceding increment; part 2, the
//! sculling integral of the same form and the exact velocity rotation compensation.
//!
//! *Frame*: Δθ is the rotation vector over the step, Δv is in case axes as they stood at its start; without the
//! terms both are plain sums of the ticks' own increments. The preceding increment is carried from step to step
//! and dropped at a gap.

use alloc::boxed::Box;

use serde::{Deserialize, Serialize};

use crate::sample::{CorrectedTick, SensorFlags, Sensors, TickFlags};
use crate::sigma::Sigma;
use crate::units::Span;
use crate::vector::{cross, plus};

/// Most ticks of one step.
pub const MAX_STEP_TICKS: u16 = 1000;
/// Squared angle below which the rotation's coefficients are taken from their series (rad²): four terms leave
/// less than 10⁻¹⁵ there, where the closed forms would lose digits.
const SERIES_LIMIT: f64 = 0.01;

/// A step without ticks, or of too many.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("a step of {got} ticks; from 1 to {MAX_STEP_TICKS} are allowed")]
pub struct NavigationError {
    /// Ticks stated.
    pub got: u16,
}

/// How ticks are summed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct NavigationStep {
    ticks: u16,
    coning_sculling: bool,
}

impl Default for NavigationStep {
    /// Every tick as it is.
    fn default() -> Self {
        Self { ticks: 1, coning_sculling: false }
    }
}

impl NavigationStep {
    /// Steps of `ticks` (1…1000), as plain sums or with coning and sculling terms.
    ///
    /// # Errors
    ///
    /// [`NavigationError`] outside that range.
    pub const fn new(ticks: u16, coning_sculling: bool) -> Result<Self, NavigationError> {
        if ticks == 0 || ticks > MAX_STEP_TICKS {
            return Err(NavigationError { got: ticks });
        }
        Ok(Self { ticks, coning_sculling })
    }

    /// Ticks of a full step.
    #[must_use]
    pub const fn ticks(&self) -> u16 {
        self.ticks
    }

    /// Whether coning and sculling terms are applied.
    #[must_use]
    pub const fn coning_sculling(&self) -> bool {
        self.coning_sculling
    }
}

/// The step that is being summed.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct StepSum {
    /// Plain sums and flags so far; `None` between steps.
    open: Option<CorrectedTick>,
    /// Counter of the revision that makes the open step and its series, which a tick's form leaves out.
    revision: u64,
    series: u64,
    /// β of the open step (rad).
    coning: [f64; 3],
    /// σ of the open step (m/s).
    sculling: [f64; 3],
    /// Increments of the tick before: Δα (rad) and Δν (m/s); zero where there is none next to it, or it is of a raw step.
    last: ([f64; 3], [f64; 3]),
    /// Standard errors of the open step, which a tick's form leaves out.
    errors: Option<Box<Sigma>>,
    /// What ticks next to one another have of one switch: their flags of it, and their restoration's standard errors so far (rad).
    bridged: (TickFlags, [f64; 3]),
}

impl StepSum {
    /// Takes one tick and emits each step that it closes.
    ///
    /// A step ends early, shorter than stated, before a tick that announces missing ticks or a restart, and
    /// where the calibration revision changes or the unit becomes calibrated or ceases to be. Raw readings of
    /// an uncalibrated unit are summed plainly: cross products of counts mean nothing.
    #[inline]
    pub fn push<E: FnMut(&CorrectedTick) + ?Sized>(
        &mut self,
        step: &NavigationStep,
        tick: &CorrectedTick,
        emit: &mut E,
    ) {
        if self.sums(*step) {
            self.sum(*step, tick, emit);
        } else {
            emit(tick);
        }
    }

    /// Whether the next tick is summed, and not a step by itself.
    #[inline]
    pub(crate) const fn sums(&self, step: NavigationStep) -> bool {
        step.ticks > 1 || step.coning_sculling || self.open.is_some()
    }

    /// Takes one tick of a step.
    fn sum<E: FnMut(&CorrectedTick) + ?Sized>(
        &mut self,
        step: NavigationStep,
        tick: &CorrectedTick,
        emit: &mut E,
    ) {
        let breaks = tick.missed > 0 || tick.flags.intersects(TickFlags::GAP | TickFlags::RESTART);
        let differs = self.open.as_ref().is_some_and(|open| {
            let changed = open.flags.symmetric_difference(tick.flags);
            self.revision != tick.revision || changed.contains(TickFlags::UNCALIBRATED)
        });
        if breaks || differs {
            self.flush(&step, emit);
        }
        if breaks {
            self.last = Default::default();
        }

        let sums = self.open.as_ref().map(|open| (open.delta_angle, open.delta_velocity));
        let (angle, velocity) = sums.unwrap_or_default();
        let arm = plus(angle, self.last.0.map(|c| c / 6.0));
        let drive = plus(velocity, self.last.1.map(|c| c / 6.0));
        let coning = cross(arm, tick.delta_angle);
        let sculling = plus(cross(arm, tick.delta_velocity), cross(drive, tick.delta_angle));
        self.coning = plus(self.coning, coning.map(|c| c / 2.0));
        self.sculling = plus(self.sculling, sculling.map(|c| c / 2.0));
        self.last = (tick.delta_angle, tick.delta_velocity);

        if let Some(errors) = tick.sigma.as_deref() {
            let flags = tick.flags & (TickFlags::INTERPOLATED | TickFlags::ANGLE_RESTORED);
            if self.errors.is_none() || flags.is_empty() || flags != self.bridged.0 {
                self.bridged = (flags, [0.0; 3]);
            }
            let same = self.bridged.1;
            let sum = self.errors.as_deref().map_or(*errors, |sum| sum.plus(errors, same));
            if !flags.is_empty() {
                self.bridged.1 = plus(same, errors.angle.restoration);
            }
            **self.errors.get_or_insert_default() = sum;
        }
        let full = if let Some(open) = &mut self.open {
            add(open, tick);
            open.ticks >= step.ticks
        } else {
            self.open = Some(tick.clone());
            (self.revision, self.series) = (tick.revision, tick.series);
            tick.ticks.max(1) >= step.ticks
        };
        if full {
            self.flush(&step, emit);
        }
    }

    /// Revision of the open step.
    pub(crate) fn revision(&self) -> Option<u64> {
        self.open.as_ref().map(|_| self.revision)
    }

    /// Whether no step is open.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.open.is_none()
    }

    /// Closes the open step, if there is one, and emits it.
    pub fn flush<E: FnMut(&CorrectedTick) + ?Sized>(&mut self, step: &NavigationStep, emit: &mut E) {
        let coning = core::mem::take(&mut self.coning);
        let sculling = core::mem::take(&mut self.sculling);
        let Some(mut sum) = self.open.take() else {
            return;
        };
        (sum.revision, sum.series) = (self.revision, self.series);
        sum.sigma = self.errors.take();
        if sum.flags.contains(TickFlags::UNCALIBRATED) {
            // From counts nothing follows for the next step.
            self.last = Default::default();
        } else if step.coning_sculling {
            let rotated = rotation(sum.delta_angle, sum.delta_velocity);
            sum.delta_velocity = plus(sum.delta_velocity, plus(rotated, sculling));
            sum.delta_angle = plus(sum.delta_angle, coning);
            sum.flags |= TickFlags::CONING_SCULLING;
        }
        emit(&sum);
    }
}

/// Adds a tick to a sum, with the increments as they are.
///
/// What has no sum (time, sequence, mode, parity) is that of the last tick.
fn add(sum: &mut CorrectedTick, tick: &CorrectedTick) {
    sum.sequence = tick.sequence;
    sum.end_time = tick.end_time;
    sum.duration = Span::from_ns(sum.duration.as_ns().saturating_add(tick.duration.as_ns()));
    sum.ticks = sum.ticks.saturating_add(tick.ticks.max(1));
    sum.missed = sum.missed.saturating_add(tick.missed);
    sum.delta_angle = plus(sum.delta_angle, tick.delta_angle);
    sum.delta_velocity = plus(sum.delta_velocity, tick.delta_velocity);
    sum.mode = tick.mode;
    sum.flags |= tick.flags;
    merge(&mut sum.gyro_flags, &tick.gyro_flags);
    merge(&mut sum.accel_flags, &tick.accel_flags);
    sum.gyro_parity.clone_from(&tick.gyro_parity);
    sum.accel_parity.clone_from(&tick.accel_parity);
}

/// A sensor is valid over a step where it is valid in every tick; anything else is told if it happened once.
fn merge(sum: &mut Sensors<SensorFlags>, tick: &Sensors<SensorFlags>) {
    let mut all = tick.iter();
    for sum in sum.iter_mut() {
        let flags = all.next().copied().unwrap_or_default();
        let valid = *sum & flags & SensorFlags::VALID;
        *sum = (*sum | flags).difference(SensorFlags::VALID) | valid;
    }
    // A sensor that the first ticks did not have was not valid in them.
    sum.extend(all.map(|flags| flags.difference(SensorFlags::VALID)));
}

/// ρ: what the rotation over the step adds to the velocity in the axes at its start.
fn rotation(angle: [f64; 3], velocity: [f64; 3]) -> [f64; 3] {
    let square: f64 = angle.iter().map(|c| c * c).sum();
    let (first, second) = if square < SERIES_LIMIT {
        (
            1.0 / 2.0 - square * (1.0 / 24.0 - square * (1.0 / 720.0 - square / 40_320.0)),
            1.0 / 6.0 - square * (1.0 / 120.0 - square * (1.0 / 5040.0 - square / 362_880.0)),
        )
    } else {
        let a = libm::sqrt(square);
        ((1.0 - libm::cos(a)) / square, (1.0 - libm::sin(a) / a) / square)
    };
    let once = cross(angle, velocity);
    let twice = cross(angle, once);
    plus(once.map(|c| c * first), twice.map(|c| c * second))
}

#[cfg(test)]
mod tests;
