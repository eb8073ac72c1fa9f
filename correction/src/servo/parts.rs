//! The servo as a calibration states it, and its checks.

use alloc::borrow::ToOwned;
use alloc::format;
use alloc::string::String;
use alloc::vec::Vec;

use serde::{Deserialize, Serialize};

use crate::curve::{Curve, CurveError, CurveParts};
use crate::stated::{OutOfRange, outside};
use crate::units::Span;

/// Shortest and longest time constant of a servo (s).
pub const TIME_CONSTANT_RANGE_S: [f64; 2] = [1e-4, 1e3];
/// Fewest and most time constants after which the transient counts as settled.
pub const SETTLE_RANGE: [f64; 2] = [1.0, 20.0];
/// Time constants after which the transient counts as settled, where nothing else is stated: e⁻¹⁶ remains.
pub const DEFAULT_SETTLE_TIME_CONSTANTS: f64 = 8.0;

/// Where `f_i` comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum ServoForm {
    /// From the half-period counts of each tick.
    Measured,
    /// From those of the first good tick and the exponential: less noise where τ is well known.
    Modelled,
    /// From the exponential through those of all good ticks so far, by least squares: less noise still. What earlier ticks
    /// took too much or too little of comes back with the next one.
    Fitted,
}

/// The servo of one gyro as the calibration document states it.
#[derive(Debug, Clone, PartialEq)]
pub struct ServoParts {
    /// Where `f_i` comes from.
    pub form: ServoForm,
    /// τ (s, 10⁻⁴…10³).
    pub time_constant_s: f64,
    /// f0: dither frequency at rest (Hz: counts per second within a half period) over temperature (°C); its sign does not matter.
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
    #[error(transparent)]
    RestFrequency(CurveError),
}

impl ServoError {
    /// Field that it speaks of, and where in it.
    pub(crate) fn field(&self) -> String {
        match self {
            Self::OutOfRange(OutOfRange { name, .. }) => (*name).to_owned(),
            Self::RestFrequency(error) => format!("rest_frequency{}", error.place()),
        }
    }
}

/// A validated servo of one gyro.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Servo {
    pub(super) form: ServoForm,
    pub(super) time_constant_s: f64,
    pub(super) rest_frequency_hz: Curve,
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

    /// Share by which the halves of a tick of a duration do not cancel: tanh(Δt/2τ).
    pub(crate) fn unbalance(&self, duration: Span) -> f64 {
        libm::tanh(duration.as_s() / (2.0 * self.time_constant_s))
    }

    /// Time after the transition from which nothing is subtracted (s).
    #[must_use]
    pub fn settle_time_s(&self) -> f64 {
        self.settle_time_constants * self.time_constant_s
    }
}
