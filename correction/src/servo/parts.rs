//! The servo as a calibration states it, and its checks.

use alloc::vec::Vec;

use serde::{Deserialize, Serialize};

use crate::curve::{Curve, CurveParts};
use crate::defect::{Checker, Defect};
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
    pub fn new(parts: &ServoParts) -> Result<Self, Vec<Defect>> {
        let &ServoParts { form, time_constant_s, ref rest_frequency, settle_time_constants } = parts;
        let mut checker = Checker::default();
        let ([shortest, longest], [fewest, most]) = (TIME_CONSTANT_RANGE_S, SETTLE_RANGE);
        checker.within("time_constant_s", time_constant_s, shortest, longest);
        checker.within("settle_time_constants", settle_time_constants, fewest, most);
        // Refused where it is none.
        let rest_frequency = checker.curve("rest_frequency", rest_frequency);
        let rest_frequency_hz = rest_frequency.unwrap_or_else(|| Curve::constant(f64::NAN));
        checker.finish(Self { form, time_constant_s, rest_frequency_hz, settle_time_constants })
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
