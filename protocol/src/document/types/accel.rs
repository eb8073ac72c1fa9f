//! The accelerometers of a document.

use isotherm_correction::thermal::Per;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::super::curve::{Curve, relative, scale_factor};
use super::super::measure::{BaseUnit, Unit};
use super::super::terms::{Accels, Terms};
use super::{AccelSigma, Orientation};

/// The accelerometers of the unit: `f = (U − S(T) − lags)·r(T_board)/K(T)`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields, title = "Accelerometers")]
pub struct Accel {
    /// Raw readings: counts of the tick, or the mean output over the tick.
    pub output: AccelOutput,
    /// Accelerometers, in the order of the raw readings.
    #[schemars(length(min = 3, max = 8))]
    pub sensor: Vec<AccelSensor>,
    /// Input axes in case axes: `s = C(T)·v`, `C(T) = C0 + C1·(T − T_ref)`. Source: models §4, 003, 004.
    pub orientation: AccelOrientation,
}

/// What an accelerometer's raw reading is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[schemars(inline)]
pub enum AccelOutput {
    /// Counts of the tick.
    #[serde(rename = "counts")]
    Counts,
    /// Mean output (V).
    #[serde(rename = "V")]
    Volts,
    /// Mean specific force (m/s²).
    #[serde(rename = "m/s2")]
    MetresPerSecondSquared,
}

impl AccelOutput {
    /// What its biases are measured in.
    #[must_use]
    pub const fn base_unit(self) -> BaseUnit {
        match self {
            Self::Counts => BaseUnit::CountsPerS,
            Self::Volts => BaseUnit::V,
            Self::MetresPerSecondSquared => BaseUnit::MPerS2,
        }
    }

    /// Unit of its scale factors.
    #[must_use]
    pub const fn scale_unit(self) -> Unit {
        self.base_unit().per(Per::M_PER_S2)
    }
}

/// Orientation of the accelerometers.
pub type AccelOrientation = Orientation<AccelParity>;

/// One accelerometer.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields, title = "Accelerometer")]
pub struct AccelSensor {
    /// Unique name, 1 to 24 bytes.
    #[schemars(length(min = 1, max = 24), extend("x-must-be" = "a name of 1 to 24 bytes"))]
    pub name: String,
    /// Temperature channel; default: `assumed_deg_c`.
    #[schemars(length(min = 1, max = 24), extend("x-must-be" = "a name of 1 to 24 bytes"))]
    pub channel: Option<String>,
    /// Temperature channel of the electronics board, for `board_ratio_error`. Source: 001.
    #[schemars(length(min = 1, max = 24), extend("x-must-be" = "a name of 1 to 24 bytes"))]
    pub board_channel: Option<String>,
    /// Overrange from this magnitude, for counts; default: none.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub input_limit_counts_per_tick: Option<f64>,
    /// Overrange from this magnitude, for V; default: none.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub input_limit_v: Option<f64>,
    /// Overrange from this magnitude, for m/s²; default: none.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub input_limit_m_per_s2: Option<f64>,
    /// K(T): output per specific force, never 0. Source: models §3, 001 (k1…k3).
    #[schemars(schema_with = "scale_factor")]
    pub scale_factor: Curve,
    /// Terms of its bias S and of what it feels.
    #[serde(flatten)]
    pub terms: Terms<Accels>,
    /// Position in case axes, from the point of the published specific force (default). Source: models §3.
    #[schemars(inner(range(min = -100.0, max = 100.0)))]
    pub position_m: Option<[f64; 3]>,
    /// As for gyros. Source: models §3.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub delay_ticks: Option<f64>,
    /// `r(T_board) − 1`, r the board's scale factor at the calibration temperature over that at `T_board`.
    /// Source: models §3, 001 (y1…y3).
    #[serde(default)]
    #[schemars(schema_with = "relative")]
    pub board_ratio_error: Option<Curve>,
    /// As for gyros. Source: models §3, IEEE 952.
    pub sigma: Option<AccelSigma>,
}

/// Detection and exclusion of a failed accelerometer.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields, title = "Parity check of the accelerometers")]
pub struct AccelParity {
    /// Limit of the parity vector's length.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub limit_m_per_s2: f64,
    /// Ticks in a row before a sensor is excluded.
    #[schemars(range(min = 1, max = 1_000_000))]
    pub confirm_ticks: u32,
}
