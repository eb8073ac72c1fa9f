//! Where the numbers of a document come from.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fmt;

use isotherm_document::is_complete;
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Deserialize, Serialize};
use toml::value::Datetime;

/// Where the numbers come from: for readers and reports, never for the correction.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields, title = "Origin")]
pub struct Origin {
    /// Program and version.
    pub tool: Option<String>,
    /// Command line.
    pub command: Option<String>,
    /// Method of the fit, such as "joint".
    pub method: Option<String>,
    /// Temperatures in the logs.
    #[schemars(extend("x-rising" = true))]
    pub range_deg_c: Option<[f64; 2]>,
    /// Temperature rates in the logs.
    #[schemars(extend("x-rising" = true))]
    pub rate_range_deg_c_per_s: Option<[f64; 2]>,
    /// Logs of the fit.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[schemars(length(max = 64))]
    pub log: Vec<Log>,
    /// Residuals before and after the correction.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[schemars(length(max = 256))]
    pub residual: Vec<Residual>,
    /// Anything else, such as the covariance.
    #[schemars(with = "Option<BTreeMap<String, serde_json::Value>>")]
    pub details: Option<toml::Table>,
}

/// One log.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields, title = "Log")]
pub struct Log {
    /// File name.
    pub name: String,
    /// SHA-256 of the file, 64 lower-case hexadecimal digits.
    #[schemars(regex(pattern = "^[0-9a-f]{64}$"), extend("x-must-be" = "64 lower-case hexadecimal digits"))]
    pub sha256: String,
}

/// Residual of one sensor over one set of samples.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields, title = "Residual")]
pub struct Residual {
    /// Sensor, such as "gyro.x".
    pub of: String,
    /// In or out of sample.
    pub sample: Sample,
    /// Unit of the values.
    pub measure: Measure,
    /// RMS before the correction.
    #[schemars(range(min = 0.0))]
    pub rms_before: f64,
    /// RMS after it.
    #[schemars(range(min = 0.0))]
    pub rms_after: f64,
    /// Peak to peak before the correction.
    #[schemars(range(min = 0.0))]
    pub peak_to_peak_before: Option<f64>,
    /// Peak to peak after it.
    #[schemars(range(min = 0.0))]
    pub peak_to_peak_after: Option<f64>,
}

/// Whether a residual was taken over the samples of the fit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
#[schemars(inline)]
pub enum Sample {
    /// In sample.
    In,
    /// Out of sample.
    Out,
}

/// Unit of a residual.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[schemars(inline)]
pub enum Measure {
    /// °/h.
    #[serde(rename = "deg/h")]
    DegPerH,
    /// m/s².
    #[serde(rename = "m/s2")]
    MetresPerSecondSquared,
}

/// Date, or date and time with offset.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Created(Datetime);

impl Created {
    /// Accepts a date, or a date and time with offset.
    #[must_use]
    pub fn new(datetime: Datetime) -> Option<Self> {
        is_complete(&datetime).then_some(Self(datetime))
    }

    /// The date and time.
    #[must_use]
    pub fn datetime(&self) -> &Datetime {
        &self.0
    }
}

impl fmt::Display for Created {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

impl JsonSchema for Created {
    fn schema_name() -> Cow<'static, str> {
        "Created".into()
    }

    fn inline_schema() -> bool {
        true
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({ "type": "string", "anyOf": [{ "format": "date" }, { "format": "date-time" }] })
    }
}
