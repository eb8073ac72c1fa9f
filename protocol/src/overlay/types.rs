//! The overlay as types: field for field what stands in the file.
//!
//! The doc comments below are also the descriptions in `config/overlay.schema.json` and in
//! `docs/calibration-document.md`.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::document::Created;

/// Changes of the bias constants of one calibration document.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields, title = "Isotherm calibration overlay")]
pub struct Overlay {
    /// Version of the overlay's schema.
    #[schemars(range(min = super::OVERLAY_SCHEMA, max = super::OVERLAY_SCHEMA))]
    pub schema: u32,
    /// SHA-256 of the base document, 64 lower-case hexadecimal digits.
    #[schemars(regex(pattern = "^[0-9a-f]{64}$"), extend("x-must-be" = "64 lower-case hexadecimal digits"))]
    pub overlay_of: String,
    /// Serial of the unit, as in the document.
    #[schemars(
        regex(pattern = "^[A-Za-z0-9._-]{1,64}$"),
        extend("x-must-be" = "1 to 64 letters A-Z a-z, digits, '.', '_' or '-'")
    )]
    pub unit: String,
    /// Date, or date and time with offset, unquoted.
    pub created: Option<Created>,
    /// Free text for readers.
    pub note: Option<String>,
    /// Gyros that change.
    #[schemars(length(min = 1, max = 8))]
    pub gyro: Vec<GyroOverlay>,
    /// The pre-launch calibration that made it; for readers. Source: models §7.
    pub pre_launch: Option<PreLaunchRecord>,
}

/// Changes of one gyro. A curve keeps its shape: the change is added to all of its values.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields, title = "Changes of one gyro")]
pub struct GyroOverlay {
    /// Name in the document.
    #[schemars(length(min = 1, max = 24), extend("x-must-be" = "a name of 1 to 24 bytes"))]
    pub name: String,
    /// Added to the static bias (C0). Source: models §7, 003.
    #[schemars(range(min = -100_000.0, max = 100_000.0))]
    pub static_bias_change_deg_per_h: f64,
    /// Its standard error.
    #[schemars(range(min = 0.0, max = 100_000.0))]
    pub static_bias_sigma_deg_per_h: f64,
    /// Added to the magnetic bias (B0). Source: models §7, 003.
    #[schemars(range(min = -100_000.0, max = 100_000.0))]
    pub magnetic_bias_change_deg_per_h: Option<f64>,
    /// Its standard error; required with it.
    #[schemars(range(min = 0.0, max = 100_000.0))]
    pub magnetic_bias_sigma_deg_per_h: Option<f64>,
}

/// How and when a pre-launch calibration was made: for readers, never for the correction.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields, title = "Pre-launch calibration")]
pub struct PreLaunchRecord {
    /// Geodetic latitude.
    #[schemars(range(min = -90.0, max = 90.0))]
    pub latitude_deg: f64,
    /// Heading of case x from north towards east.
    #[schemars(range(min = -360.0, max = 360.0))]
    pub heading_deg: f64,
    /// Pitch and roll; default: levelled by the accelerometers.
    #[schemars(inner(range(min = -180.0, max = 180.0)))]
    pub pitch_roll_deg: Option<[f64; 2]>,
    /// Accumulated time.
    #[schemars(range(min = 0.0, max = 1e6))]
    pub duration_s: f64,
    /// Start, on the producer's clock.
    #[schemars(extend("x-must-be" = "a whole number of nanoseconds from -2^63 to 2^63 - 1"))]
    pub start_ns: i64,
    /// End, on the producer's clock.
    #[schemars(extend("x-must-be" = "a whole number of nanoseconds from -2^63 to 2^63 - 1"))]
    pub end_ns: i64,
    /// Mean temperature of each gyro.
    #[schemars(length(min = 3, max = 8), inner(range(min = -273.15, max = 1000.0)))]
    pub mean_temperature_deg_c: Vec<f64>,
}
