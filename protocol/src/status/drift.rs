//! Estimate of one gyro's slow drift, and whether the unit is at rest for it (models §7).

use serde::{Deserialize, Serialize};

/// What the drift estimator knows of one gyro.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DriftStatus {
    /// Name of the gyro.
    pub gyro: String,
    /// Estimated drift about its input axis (rad/s), in addition to the calibration's bias.
    pub rate_rad_per_s: f64,
    /// Its standard deviation (rad/s).
    pub sigma_rad_per_s: f64,
    /// Its trend (rad/s²).
    pub trend_rad_per_s2: f64,
    /// References that were taken.
    pub updates: u64,
    /// References that were refused: too far from the estimate.
    pub refused: u64,
    /// Mean normalised innovation squared of the last updates (1 where the parameters are right); `None` before the first.
    pub mean_nis: Option<f64>,
    /// End of the last reference that was taken (ns on the producer's clock); `None` before the first.
    pub last_update_ns: Option<i64>,
    /// Whether the estimate is subtracted from the output.
    pub subtracted: bool,
}

/// The rest that the operator has declared: at rest the unit's own readings feed the drift estimator.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Rest {
    /// Too little has been seen.
    Learning,
    /// The unit stands still.
    Still,
    /// It moved, in words; nothing is fed until it has been still again for long enough.
    Moved(String),
}
