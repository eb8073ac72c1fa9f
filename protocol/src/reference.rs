//! A known angular rate of a unit: what the drift estimator is fed with (models §7).

use isotherm_correction::drift;
use isotherm_correction::units::Timestamp;
use serde::{Deserialize, Serialize};

use crate::codec::{CodecError, Kind, PlainMessage};
use crate::version::{self, Versions};

/// Mean inertial angular rate of a unit over a span of time, as another instrument or the stand knows it.
///
/// The Earth's rate is part of it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Reference {
    /// Start of the span (ns on the producer's clock).
    pub start_ns: i64,
    /// End of the span (ns on the producer's clock); later than its start.
    pub end_ns: i64,
    /// Mean rate about the case axes (rad/s, finite).
    pub angular_rate_rad_per_s: [f64; 3],
    /// Standard deviation of each of the three (rad/s, finite, ≥ 0).
    pub sigma_rad_per_s: f64,
}

impl PlainMessage for Reference {
    const KIND: Kind = Kind::Reference;
    const VERSIONS: Versions = version::REFERENCE;

    fn check(&self) -> Result<(), CodecError> {
        if self.end_ns <= self.start_ns {
            return Err(CodecError::Value { field: "end_ns", must_be: "later than start_ns" });
        }
        if !self.angular_rate_rad_per_s.iter().all(|rate| rate.is_finite()) {
            return Err(CodecError::Value { field: "angular_rate_rad_per_s", must_be: "finite" });
        }
        if !(self.sigma_rad_per_s.is_finite() && self.sigma_rad_per_s >= 0.0) {
            return Err(CodecError::Value { field: "sigma_rad_per_s", must_be: "finite and not negative" });
        }
        Ok(())
    }
}

impl Reference {
    /// The reference as the core takes it.
    #[must_use]
    pub fn to_core(&self) -> drift::Reference {
        drift::Reference {
            start: Timestamp::from_ns(self.start_ns),
            end: Timestamp::from_ns(self.end_ns),
            angular_rate: self.angular_rate_rad_per_s,
            sigma: self.sigma_rad_per_s,
        }
    }
}
