//! The substitution as a calibration states it, and its checks.

use alloc::vec::Vec;

use serde::{Deserialize, Serialize};

use crate::stated::{OutOfRange, outside};

/// Most ticks of one transition.
pub const MAX_TRANSITION_TICKS: u8 = 3;
/// Most readings of one fit on either side of the switch.
pub const MAX_FIT_READINGS: u8 = 8;
/// Highest degree of the prediction.
pub const MAX_PREDICT_DEGREE: u8 = 2;
/// Highest degree of the two-sided fit.
pub const MAX_FIT_DEGREE: u8 = 3;

/// The substitution as the calibration document states it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct ReversalParts {
    /// n: ticks that carry nothing, the commanded one included (1…3).
    pub transition_ticks: u8,
    /// Readings of the prediction (1…8).
    pub predict_readings: u8,
    /// Degree of the prediction (0…2, below `predict_readings`).
    pub predict_degree: u8,
    /// Readings before the switch in the two-sided fit (1…8).
    pub fit_readings_before: u8,
    /// Readings after the switch in the two-sided fit (1…8).
    pub fit_readings_after: u8,
    /// Degree of the two-sided fit (0…3, below the number of its readings).
    pub fit_degree: u8,
}

impl Default for ReversalParts {
    /// The paper's figures, with the linear prediction that was found the most robust to noise.
    fn default() -> Self {
        Self {
            transition_ticks: 3,
            predict_readings: 4,
            predict_degree: 1,
            fit_readings_before: 2,
            fit_readings_after: 2,
            fit_degree: 2,
        }
    }
}

/// What is wrong with a stated substitution.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ReversalError {
    /// A number is outside its range.
    #[error(transparent)]
    OutOfRange(#[from] OutOfRange<u8>),
    /// A polynomial has more coefficients than readings to fit them to.
    #[error("{name} is {got} with {readings} readings; it must be below their number")]
    DegreeNeedsReadings {
        /// Field of [`ReversalParts`].
        name: &'static str,
        /// The degree.
        got: u8,
        /// Readings of that fit.
        readings: u8,
    },
}

impl ReversalError {
    /// Field of [`ReversalParts`] that it speaks of.
    pub(crate) fn field(&self) -> &'static str {
        match self {
            Self::OutOfRange(OutOfRange { name, .. }) | Self::DegreeNeedsReadings { name, .. } => name,
        }
    }
}

/// A validated substitution.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Reversal {
    pub(super) parts: ReversalParts,
}

impl Reversal {
    /// Validates a stated substitution.
    ///
    /// # Errors
    ///
    /// Everything that is wrong with it.
    pub fn new(parts: &ReversalParts) -> Result<Self, Vec<ReversalError>> {
        let outside = outside([
            ("transition_ticks", parts.transition_ticks, [1, MAX_TRANSITION_TICKS]),
            ("predict_readings", parts.predict_readings, [1, MAX_FIT_READINGS]),
            ("predict_degree", parts.predict_degree, [0, MAX_PREDICT_DEGREE]),
            ("fit_readings_before", parts.fit_readings_before, [1, MAX_FIT_READINGS]),
            ("fit_readings_after", parts.fit_readings_after, [1, MAX_FIT_READINGS]),
            ("fit_degree", parts.fit_degree, [0, MAX_FIT_DEGREE]),
        ]);
        let mut errors: Vec<ReversalError> = outside.map(Into::into).collect();
        let fit_readings = parts.fit_readings_before.saturating_add(parts.fit_readings_after);
        for (name, got, readings) in [
            ("predict_degree", parts.predict_degree, parts.predict_readings),
            ("fit_degree", parts.fit_degree, fit_readings),
        ] {
            if got >= readings {
                errors.push(ReversalError::DegreeNeedsReadings { name, got, readings });
            }
        }
        if errors.is_empty() { Ok(Self { parts: *parts }) } else { Err(errors) }
    }

    /// The statement it was made from.
    #[must_use]
    pub const fn parts(&self) -> &ReversalParts {
        &self.parts
    }
}
