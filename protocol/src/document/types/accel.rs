//! The accelerometers of a document.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::super::curve::{
    Curve, OutputBias, OutputHysteresisGain, OutputLagGain, OutputRegressorGain, Relative, ScaleFactor,
    SecondOrder,
};
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

/// Orientation of the accelerometers.
pub type AccelOrientation = Orientation<AccelParity>;

/// One accelerometer.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields, title = "Accelerometer")]
pub struct AccelSensor {
    /// Unique name, 1 to 24 bytes.
    #[schemars(length(min = 1, max = 24), extend("x-must-be" = "a name of 1 to 24 bytes"))]
    pub name: String,
    /// Temperature channel; default: `assumed_deg_c`.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(length(min = 1, max = 24), extend("x-must-be" = "a name of 1 to 24 bytes"))]
    pub channel: Option<String>,
    /// Temperature channel of the electronics board, for `board_ratio_error`. Source: 001.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(length(min = 1, max = 24), extend("x-must-be" = "a name of 1 to 24 bytes"))]
    pub board_channel: Option<String>,
    /// Overrange from this magnitude, for counts; default: none.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub input_limit_counts_per_tick: Option<f64>,
    /// Overrange from this magnitude, for V; default: none.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub input_limit_v: Option<f64>,
    /// Overrange from this magnitude, for m/s²; default: none.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub input_limit_m_per_s2: Option<f64>,
    /// K(T): output per specific force, never 0. Source: models §3, 001 (k1…k3).
    pub scale_factor: Curve<ScaleFactor>,
    /// S(T): output at zero specific force. Source: models §3, 001 (z1…z3).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bias: Option<Curve<OutputBias>>,
    /// Thermal lags of the bias, as for gyros. Source: models §2, §8.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[schemars(length(max = 8))]
    pub lag: Vec<AccelLag>,
    /// As for gyros. Source: models §2.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[schemars(length(max = 8))]
    pub hysteresis: Vec<AccelHysteresis>,
    /// As for gyros. Source: models §2.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[schemars(length(max = 8))]
    pub regressor: Vec<AccelRegressor>,
    /// K2: error per f², f along its input axis. Source: models §3, IEEE 528.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub second_order: Option<Curve<SecondOrder>>,
    /// Position in case axes, from the point of the published specific force (default). Source: models §3.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(inner(range(min = -100.0, max = 100.0)))]
    pub position_m: Option<[f64; 3]>,
    /// As for gyros. Source: models §3.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.0, max = 1.0))]
    pub delay_ticks: Option<f64>,
    /// `r(T_board) − 1`, r the board's scale factor at the calibration temperature over that at `T_board`.
    /// Source: models §3, 001 (y1…y3).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub board_ratio_error: Option<Curve<Relative>>,
    /// As for gyros. Source: models §3, IEEE 952.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sigma: Option<AccelSigma>,
}

/// One thermal lag of an accelerometer's bias.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields, title = "Thermal lag of an accelerometer")]
pub struct AccelLag {
    /// τ, at least `grid_step_s`.
    #[schemars(range(min = 0.001, max = 1e7))]
    pub time_constant_s: f64,
    /// g(T).
    pub gain: Curve<OutputLagGain>,
}

/// One play of an accelerometer's bias.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields, title = "Hysteresis of an accelerometer")]
pub struct AccelHysteresis {
    /// w.
    #[schemars(range(min = 0.001, max = 1000.0))]
    pub half_width_deg_c: f64,
    /// g(T).
    pub gain: Curve<OutputHysteresisGain>,
}

/// One regressor of an accelerometer's bias.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields, title = "Regressor of an accelerometer")]
pub struct AccelRegressor {
    /// x.
    #[schemars(length(min = 1, max = 24), extend("x-must-be" = "a name of 1 to 24 bytes"))]
    pub channel: String,
    /// Subtracted channel.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(length(min = 1, max = 24), extend("x-must-be" = "a name of 1 to 24 bytes"))]
    pub minus: Option<String>,
    /// Subtracted constant.
    #[serde(default)]
    pub reference: f64,
    /// g(T).
    pub gain: Curve<OutputRegressorGain>,
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
