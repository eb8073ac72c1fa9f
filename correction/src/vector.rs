//! Vectors in case axes.

use serde::{Deserialize, Serialize};

/// Sum of two vectors.
#[must_use]
pub fn plus(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

/// Difference of two vectors.
#[must_use]
pub fn minus(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// Scalar product of two vectors.
#[must_use]
pub fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Vector product of two vectors.
#[must_use]
pub fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// Mean of a vector over time.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize)]
pub(crate) struct TimeMean {
    /// ∫v dt.
    integral: [f64; 3],
    /// Time over which it was taken (s).
    pub(crate) time_s: f64,
}

impl TimeMean {
    /// Adds what it was over this time.
    pub(crate) fn add(&mut self, value: [f64; 3], time_s: f64) {
        self.integral = plus(self.integral, value.map(|value| value * time_s));
        self.time_s += time_s;
    }

    /// The mean; `None` over no time.
    pub(crate) fn mean(&self) -> Option<[f64; 3]> {
        (self.time_s > 0.0).then(|| self.integral.map(|integral| integral / self.time_s))
    }
}
