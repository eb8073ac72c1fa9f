//! What the drift estimator is to expect of a gyro.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Drift that is left after the correction: a constant, a first-order Markov process and a trend whose rate is a
/// first-order Markov process; the in-run estimator runs for gyros that state it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields, title = "Drift")]
pub struct Drift {
    /// σ of the Markov process; 0 for none.
    #[schemars(range(min = 0.0, max = 20_000.0))]
    pub sigma_deg_per_h: f64,
    /// τ, its correlation time.
    #[schemars(range(min = 0.02, max = 250_000.0))]
    pub correlation_time_h: f64,
    /// σ1 of the trend's rate χ; 0 for none.
    #[schemars(range(min = 0.0, max = 70_000.0))]
    pub trend_sigma_deg_per_h2: f64,
    /// τ1, its correlation time.
    #[schemars(range(min = 0.02, max = 250_000.0))]
    pub trend_correlation_time_h: f64,
    /// σ of the constant when the estimator starts.
    #[schemars(range(min = 1e-6, max = 20_000.0))]
    pub initial_sigma_deg_per_h: f64,
    /// N, white noise of the rate.
    #[schemars(range(min = 1e-8, max = 3000.0))]
    pub angle_random_walk_deg_per_sqrt_h: f64,
}
