//! Pre-launch calibration: how far it is, and what came of the last one (models §7).

use isotherm_correction::sample::{LasingMode, MAX_SENSORS};
use serde::{Deserialize, Serialize};

use crate::codec::bounded;
use crate::digest::Digest;

/// Most lasing modes: plus, minus and none.
const MAX_MODES: usize = 3;
/// Most reasons of a refusal.
const MAX_REASONS: usize = 64;

/// What was accumulated of one gyro in one lasing mode.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PreLaunchMode {
    /// The mode; `None` for an instrument without modes.
    pub mode: Option<LasingMode>,
    /// Good ticks.
    pub ticks: u64,
    /// Their duration together (s).
    pub time_s: f64,
    /// Mean temperature of the gyro over them (°C); `None` before the first.
    pub mean_temperature_deg_c: Option<f64>,
}

/// One gyro so far.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PreLaunchGyro {
    /// Name.
    pub name: String,
    /// The lasing modes in which there was a good tick.
    #[serde(deserialize_with = "bounded::<_, _, MAX_MODES>")]
    pub modes: Vec<PreLaunchMode>,
    /// Standard error that the constants would have now (rad/s); `None` while too little is known.
    pub sigma_rad_per_s: Option<f64>,
}

/// A pre-launch calibration that is running.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PreLaunchProgress {
    /// Event time since its first tick (s).
    pub elapsed_s: f64,
    /// Event time that it takes (s).
    pub duration_s: f64,
    /// Each gyro.
    #[serde(deserialize_with = "bounded::<_, _, MAX_SENSORS>")]
    pub gyros: Vec<PreLaunchGyro>,
}

/// What was found for the constants of one gyro.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ConstantsChange {
    /// Name of the gyro.
    pub gyro: String,
    /// Change of C0, the constant of the static bias (rad/s).
    pub static_bias_change_rad_per_s: f64,
    /// Its standard error (rad/s).
    pub static_bias_sigma_rad_per_s: f64,
    /// Change of B0, the constant of the magnetic bias (rad/s); `None` without modes.
    pub magnetic_bias_change_rad_per_s: Option<f64>,
    /// Its standard error (rad/s); `None` without modes.
    pub magnetic_bias_sigma_rad_per_s: Option<f64>,
    /// Rate of the Earth along the input axis that was subtracted (rad/s).
    pub earth_rate_rad_per_s: f64,
    /// What it rests on, by lasing mode.
    #[serde(deserialize_with = "bounded::<_, _, MAX_MODES>")]
    pub modes: Vec<PreLaunchMode>,
}

/// What came of it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum PreLaunchVerdict {
    /// New constants, gyro by gyro.
    Accepted(#[serde(deserialize_with = "bounded::<_, _, MAX_SENSORS>")] Vec<ConstantsChange>),
    /// The old constants stay; every reason in words.
    Refused(#[serde(deserialize_with = "bounded::<_, _, MAX_REASONS>")] Vec<String>),
    /// It was ended by a command; the old constants stay.
    Aborted,
}

/// The last pre-launch calibration.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PreLaunchOutcome {
    /// End of its last tick (ns on the producer's clock); `None` where no tick came.
    pub ended_ns: Option<i64>,
    /// What came of it.
    pub verdict: PreLaunchVerdict,
    /// SHA-256 of the overlay document that holds the new constants; `None` where none was stored.
    pub overlay: Option<Digest>,
}
