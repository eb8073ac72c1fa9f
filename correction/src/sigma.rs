//! σ of every output: the standard errors of its increments by cause, from what the calibration states of each sensor.
//!
//! Nothing here changes an increment. Errors of sensors are taken as independent of one another, and go through the inverse of the
//! axes in use: `σ²_axis = Σ_i c²_axis,i · σ²_i`. What is not stated is unknown, which is NaN, and so is all that rests on it.

mod budget;
mod parts;

use serde::{Deserialize, Serialize};

pub(crate) use budget::{Resolved, SigmaMemory, Watched};
pub use parts::{BiasSigma, MAX_BIAS_TERMS, SigmaModel, SigmaParts};

/// Standard errors of three increments about or along the case axes, by cause (rad or m/s); NaN where unknown.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Causes {
    /// Noise of the sensors: white noise, quantisation, bias instability, rate random walk.
    pub noise: [f64; 3],
    /// Noise of the readings that a mode switch was bridged with, and of the servo transient that was subtracted.
    pub restoration: [f64; 3],
    /// Biases, scale factors and axes as they were calibrated.
    pub calibration: [f64; 3],
    /// Temperatures outside the fitted range.
    pub clamping: [f64; 3],
}

/// Standard errors of one output.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Sigma {
    /// Of the angle increments (rad).
    pub angle: Causes,
    /// Of the velocity increments (m/s).
    pub velocity: Causes,
}

impl Causes {
    /// Nothing is known.
    pub const UNKNOWN: Self = Self {
        noise: [f64::NAN; 3],
        restoration: [f64::NAN; 3],
        calibration: [f64::NAN; 3],
        clamping: [f64::NAN; 3],
    };

    /// All causes, in the order of the fields.
    #[must_use]
    pub const fn all(&self) -> [[f64; 3]; 4] {
        [self.noise, self.restoration, self.calibration, self.clamping]
    }

    /// Variance of each increment from all causes together (rad² or m²/s²); NaN where one of them is unknown.
    #[must_use]
    pub fn variance(&self) -> [f64; 3] {
        core::array::from_fn(|axis| self.all().iter().map(|cause| cause[axis] * cause[axis]).sum())
    }

    /// That of a sum of two outputs: noise is new in each of them, what was calibrated and clamped is the same. So is what the other one
    /// was bridged with, in that part of this restoration that stems from the same readings.
    fn plus(&self, other: &Self, same: [f64; 3]) -> Self {
        let apart = |a: [f64; 3], b: [f64; 3], same: [f64; 3]| {
            core::array::from_fn(|i| libm::sqrt(a[i] * a[i] + b[i] * b[i] + 2.0 * same[i] * b[i]))
        };
        let together = |a: [f64; 3], b: [f64; 3]| core::array::from_fn(|i| a[i] + b[i]);
        Self {
            noise: apart(self.noise, other.noise, [0.0; 3]),
            restoration: apart(self.restoration, other.restoration, same),
            calibration: together(self.calibration, other.calibration),
            clamping: together(self.clamping, other.clamping),
        }
    }
}

impl Sigma {
    /// Nothing is known.
    pub const UNKNOWN: Self = Self { angle: Causes::UNKNOWN, velocity: Causes::UNKNOWN };

    /// That of a sum of two outputs; `same`: restoration of this angle that stems from the readings that bridged the other one (rad).
    pub(crate) fn plus(&self, other: &Self, same: [f64; 3]) -> Self {
        Self {
            angle: self.angle.plus(&other.angle, same),
            velocity: self.velocity.plus(&other.velocity, [0.0; 3]),
        }
    }
}
