//! The mapping as types: key for key what stands in the file.

use isotherm_log::mapping::{AccelUnit, GyroUnit, Marks, TemperatureUnit};
use schemars::JsonSchema;
use serde::Deserialize;

use super::{m_per_s2, rad_per_s};
use crate::name::{MUST_BE, PATTERN};
use crate::qos::Qos;

/// Which topics are which unit.
#[derive(Debug, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields, title = "Isotherm ROS 2 mapping")]
pub(super) struct Keys {
    /// Version of the mapping's form.
    #[schemars(range(min = 1))]
    #[expect(dead_code, reason = "checked before anything else is read")]
    pub(super) version: u32,
    /// Name of the bridge's node.
    #[serde(default = "node")]
    #[schemars(
        regex(pattern = r"^_?[A-Za-z][A-Za-z0-9]*(_[A-Za-z0-9]+)*$"),
        extend("x-must-be" = "letters, digits and single underscores, not beginning with a digit")
    )]
    pub(super) node: String,
    /// Its namespace.
    #[serde(default = "root")]
    #[schemars(
        regex(pattern = r"^(/|(/_?[A-Za-z][A-Za-z0-9]*(_[A-Za-z0-9]+)*_?)+)$"),
        extend("x-must-be" = "/, or a name with its leading slash, such as /vehicle")
    )]
    pub(super) namespace: String,
    /// Topic of the diagnostics.
    #[serde(default = "diagnostics")]
    #[schemars(regex(pattern = PATTERN), extend("x-must-be" = MUST_BE))]
    pub(super) diagnostics: String,
    /// Units.
    #[schemars(length(min = 1, max = 64))]
    pub(super) unit: Vec<UnitKeys>,
}

fn node() -> String {
    "isotherm".to_owned()
}

fn root() -> String {
    "/".to_owned()
}

fn diagnostics() -> String {
    "/diagnostics".to_owned()
}

/// One unit.
#[derive(Debug, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields)]
pub(super) struct UnitKeys {
    /// Serial, as the calibration document has it.
    #[schemars(
        regex(pattern = "^[A-Za-z0-9._-]{1,64}$"),
        extend("x-must-be" = "1 to 64 letters A-Z a-z, digits, '.', '_' or '-'")
    )]
    pub(super) serial: String,
    /// Topic of the raw messages.
    #[schemars(regex(pattern = PATTERN), extend("x-must-be" = MUST_BE))]
    pub(super) raw: String,
    /// Topic of the corrected ones.
    #[schemars(regex(pattern = PATTERN), extend("x-must-be" = MUST_BE))]
    pub(super) corrected: String,
    /// Frame of the corrected messages.
    #[schemars(length(min = 1, max = 255))]
    pub(super) frame_id: Option<String>,
    /// What stamps mean.
    pub(super) time: TimeKeys,
    /// Angular velocities.
    #[serde(default)]
    pub(super) gyro: GyroKeys,
    /// Linear accelerations.
    pub(super) accel: Option<AccelKeys>,
    /// Temperature topics.
    #[serde(default)]
    #[schemars(length(max = 16))]
    pub(super) temperature: Vec<TemperatureKeys>,
    /// Quality of service of the corrected messages.
    #[serde(default)]
    pub(super) output: Qos,
}

/// What stamps mean.
#[derive(Debug, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields)]
pub(super) struct TimeKeys {
    /// Nominal duration of a tick.
    #[schemars(range(min = 0.01, max = 9500.0))]
    pub(super) tick_ms: f64,
    /// Which end of its tick a stamp marks.
    #[serde(default = "end")]
    pub(super) stamp: Marks,
    /// Where a tick's duration comes from.
    pub(super) duration: Option<DurationRule>,
    /// More than this many nominal ticks between two stamps are a gap.
    #[serde(default = "one_and_a_half")]
    #[schemars(range(min = 1.25, max = 1e6), extend("x-must-be" = "1.25 to 1000000, or jitter would count as a gap"))]
    pub(super) gap_after_ticks: f64,
    /// Standard deviation of a stamp.
    #[schemars(range(min = 0.0, max = 1e6))]
    pub(super) uncertainty_us: Option<f64>,
}

fn end() -> Marks {
    Marks::End
}

fn one_and_a_half() -> f64 {
    1.5
}

#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[schemars(inline)]
pub(super) enum DurationRule {
    Measured,
    Nominal,
}

/// Angular velocities.
#[derive(Debug, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields)]
pub(super) struct GyroKeys {
    /// Their unit.
    #[serde(default = "rad_per_s")]
    pub(super) unit: GyroUnit,
    /// White noise of the corrected rate, where the calibration document states none.
    #[schemars(range(min = 1e-8, max = 3000.0))]
    pub(super) angle_random_walk_deg_per_sqrt_h: Option<f64>,
}

impl Default for GyroKeys {
    fn default() -> Self {
        Self { unit: rad_per_s(), angle_random_walk_deg_per_sqrt_h: None }
    }
}

/// Linear accelerations.
#[derive(Debug, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields)]
pub(super) struct AccelKeys {
    /// Their unit.
    #[serde(default = "m_per_s2")]
    pub(super) unit: AccelUnit,
    /// White noise of the corrected specific force.
    #[schemars(range(min = 1e-8, max = 3000.0))]
    pub(super) velocity_random_walk_m_per_s_per_sqrt_h: Option<f64>,
}

/// One temperature topic.
#[derive(Debug, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields)]
pub(super) struct TemperatureKeys {
    /// Its name.
    #[schemars(regex(pattern = PATTERN), extend("x-must-be" = MUST_BE))]
    pub(super) topic: String,
    /// Channel, as the calibration document spells it.
    #[schemars(
        length(min = 1, max = 24),
        regex(pattern = r"\S"),
        extend("x-must-be" = "a name of 1 to 24 bytes")
    )]
    pub(super) channel: String,
    /// Unit of its readings.
    #[serde(default = "deg_c")]
    pub(super) unit: TemperatureUnit,
}

fn deg_c() -> TemperatureUnit {
    TemperatureUnit::DegC
}
