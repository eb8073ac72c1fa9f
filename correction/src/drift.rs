//! In-run drift estimator: what is left of a gyro's bias after its calibration, followed over hours [002; models §7].
//!
//! ```text
//! ε = ε0 + ε1,    ε̇0 = χ,    ε̇1 = −ε1/τ + √(2σ²/τ)·w,    χ̇ = −χ/τ1 + √(2σ1²/τ1)·w1
//! ```
//!
//! ε0 is the constant part and carries the integral of the trend χ, ε1 is a first-order Markov process. 002 finds that
//! a fitted trend does not extrapolate (up to 30 % error), so χ is a Markov process too. A Kalman filter over the three
//! is updated whenever the true rate of the case is known ([`Reference`]) and predicts otherwise.
//!
//! | part | where |
//! |---|---|
//! | exact transition and process noise over any interval | `drift/moments.rs` |
//! | filter of one gyro, gate against wrong references | `drift/filter.rs` |
//! | the last two minutes of each gyro's residual rate | `drift/ring.rs` |
//! | references: checks, waiting, refusals | `drift/reference.rs` |
//! | references made at rest | `drift/rest_feeder.rs` |
//! | one gyro: prediction on a grid, what is subtracted | `drift/gyro.rs` |
//! | the estimator of a unit | `drift/estimator.rs` |
//!
//! The owner calls, per tick and in this order: [`DriftEstimator::advance`], [`DriftEstimator::subtrahend`] where the
//! drift is to be subtracted, [`DriftEstimator::observe`].

mod estimator;
mod filter;
mod gyro;
mod moments;
mod reference;
mod rest_feeder;
mod ring;

use alloc::vec::Vec;

use serde::{Deserialize, Serialize};

pub use estimator::{DriftEstimator, DriftSettings};
pub use filter::{BELIEF_LIMIT, BELIEF_REFUSALS, GATE_SIGMAS, INNOVATIONS_KEPT, MEAN_NIS_BOUNDS};
pub use gyro::{DriftEstimate, SUBTRACTION_RAMP};
pub use reference::{
    LONGEST_REFERENCE, MAX_WAITING_REFERENCES, Reference, ReferenceCounters, ReferenceRefusal,
    SHORTEST_REFERENCE,
};
pub use rest_feeder::{REST_CONFIRMATION, REST_SPAN, RestFeeder};
pub use ring::{CELL, LARGEST_UNOBSERVED_SHARE, RING_CELLS};

use crate::stated::{OutOfRange, outside};

/// Shortest and longest correlation time (s): drift faster than a reference span is noise, not drift.
const CORRELATION_TIME_RANGE_S: [f64; 2] = [60.0, 1e9];

/// The drift of one gyro as the calibration document states it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct DriftParts {
    /// σ: stationary sigma of the first-order Markov part (rad/s, 0…0.1; 0: there is none).
    pub sigma_rad_per_s: f64,
    /// τ: its correlation time (s, 60…10⁹).
    pub correlation_time_s: f64,
    /// σ1: stationary sigma of the trend rate χ (rad/s², 0…10⁻⁴; 0: there is none).
    pub trend_sigma_rad_per_s2: f64,
    /// τ1: correlation time of the trend rate (s, 60…10⁹).
    pub trend_correlation_time_s: f64,
    /// Sigma of the constant part when the estimator starts (rad/s, 10⁻¹²…0.1).
    pub initial_sigma_rad_per_s: f64,
    /// N: white noise of the measured rate (rad/√s, 10⁻¹²…1).
    pub angle_random_walk_rad_per_sqrt_s: f64,
}

/// A validated drift of one gyro.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct DriftModel {
    parts: DriftParts,
}

impl DriftModel {
    /// Validates a stated drift.
    ///
    /// # Errors
    ///
    /// Everything that is wrong with it.
    pub fn new(parts: &DriftParts) -> Result<Self, Vec<OutOfRange>> {
        let outside = outside([
            ("sigma_rad_per_s", parts.sigma_rad_per_s, [0.0, 0.1]),
            ("correlation_time_s", parts.correlation_time_s, CORRELATION_TIME_RANGE_S),
            ("trend_sigma_rad_per_s2", parts.trend_sigma_rad_per_s2, [0.0, 1e-4]),
            ("trend_correlation_time_s", parts.trend_correlation_time_s, CORRELATION_TIME_RANGE_S),
            ("initial_sigma_rad_per_s", parts.initial_sigma_rad_per_s, [1e-12, 0.1]),
            // A measurement without noise is none.
            ("angle_random_walk_rad_per_sqrt_s", parts.angle_random_walk_rad_per_sqrt_s, [1e-12, 1.0]),
        ]);
        let errors: Vec<_> = outside.collect();
        if errors.is_empty() { Ok(Self { parts: *parts }) } else { Err(errors) }
    }

    /// The numbers it was made from.
    #[must_use]
    pub const fn parts(&self) -> &DriftParts {
        &self.parts
    }
}

#[cfg(test)]
mod tests;
