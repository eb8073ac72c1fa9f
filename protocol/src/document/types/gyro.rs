//! The gyros of a document.

use isotherm_correction::servo::DEFAULT_SETTLE_TIME_CONSTANTS;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::super::curve::{Curve, frequency, relative_over_rate};
use super::super::terms::{Gyros, Terms};
use super::{Drift, GyroSigma, Orientation};

/// The gyros of the unit: `θ = K(T)·P − Ω·Δt`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields, title = "Gyros")]
pub struct Gyro {
    /// Raw readings: counts of the tick, or the mean rate over the tick (rad/s).
    pub output: GyroOutput,
    /// Gyros, in the order of the raw readings, each with the terms of its bias Ω. Source: models §2.
    #[schemars(length(min = 3, max = 8))]
    pub sensor: Vec<GyroSensor>,
    /// Input axes in case axes: `s = C(T)·v`, `C(T) = C0 + C1·(T − T_ref)`. Source: models §4, 003, 004.
    pub orientation: GyroOrientation,
}

/// What a gyro's raw reading is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
#[schemars(inline)]
pub enum GyroOutput {
    /// Counts of the tick.
    Counts,
    /// Mean rate over the tick (rad/s).
    Mean,
}

/// Orientation of the gyros.
pub type GyroOrientation = Orientation<GyroParity>;

/// One gyro and the terms of its bias Ω; any of them may be left out.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields, title = "Gyro")]
pub struct GyroSensor {
    /// Unique name, 1 to 24 bytes.
    #[schemars(length(min = 1, max = 24), extend("x-must-be" = "a name of 1 to 24 bytes"))]
    pub name: String,
    /// Temperature channel; default: `assumed_deg_c`.
    #[schemars(length(min = 1, max = 24), extend("x-must-be" = "a name of 1 to 24 bytes"))]
    pub channel: Option<String>,
    /// K0 for counts: angle per count, negative for a reversed axis. Source: models §2, 003.
    #[schemars(extend("not" = { "const": 0 }))]
    pub increment_weight_arcsec_per_count: Option<f64>,
    /// K0 for means: true rate per stated rate. Source: models §2.
    #[schemars(extend("not" = { "const": 0 }))]
    pub increment_weight_rad_per_rad: Option<f64>,
    /// Overrange from this magnitude, for counts; default: none.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub input_limit_counts_per_tick: Option<f64>,
    /// Overrange from this magnitude, for means; default: none.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub input_limit_deg_per_s: Option<f64>,
    /// Terms of its bias Ω and of its scale.
    #[serde(flatten)]
    pub terms: Terms<Gyros>,
    /// K(ω)/K(T) − 1, ω the rate that the gyro reads. Source: models §2, IEEE 528.
    #[serde(default)]
    #[schemars(schema_with = "relative_over_rate")]
    pub increment_weight_over_rate: Option<Curve>,
    /// Polynomial of the time since turn-on. Source: 002.
    pub trend: Option<Trend>,
    /// Lag of its reading, in ticks; all sensors are delayed to the slowest. Source: models §3.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub delay_ticks: Option<f64>,
    /// Transient of the path-length servo after a mode switch; needs `[mode_reversal]`. Source: models §6, 003.
    pub servo: Option<Servo>,
    /// Statistics of the remaining drift (constant, Markov process, trend), for the in-run estimator. Source: models §7, 002.
    pub drift: Option<Drift>,
    /// Standard errors: σ is published with every output. Source: models §2, IEEE 952.
    pub sigma: Option<GyroSigma>,
}

/// Polynomial of the time since turn-on, held outside its interval.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields, title = "Trend since turn-on")]
pub struct Trend {
    /// Coefficients of powers 0, 1, 2 of the time.
    #[schemars(length(min = 1, max = 3))]
    pub coefficients_deg_per_h: Vec<f64>,
    /// Fitted interval since turn-on; the trend is held outside.
    #[schemars(inner(range(min = 0.0, max = 250_000.0)), extend("x-rising" = true))]
    pub interval_h: [f64; 2],
}

/// Transient of the path-length servo after a mode switch.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields, title = "Path-length servo transient")]
pub struct Servo {
    /// From each tick's half-period counts, from the first of them and τ, or fitted to all so far.
    pub form: ServoKind,
    /// τ of the servo.
    #[schemars(range(min = 1e-4, max = 1e3))]
    pub time_constant_s: f64,
    /// f0: settled dither frequency.
    #[schemars(schema_with = "frequency")]
    pub rest_frequency: Curve,
    /// End of the transient after the switch, in τ.
    #[serde(default = "Servo::default_settling")]
    #[schemars(range(min = 1.0, max = 20.0))]
    pub settle_time_constants: f64,
}

impl Servo {
    /// Multiples of τ where nothing else is stated.
    pub(in super::super) fn default_settling() -> f64 {
        DEFAULT_SETTLE_TIME_CONSTANTS
    }
}

/// Where the dither frequency comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
#[schemars(inline)]
pub enum ServoKind {
    /// From the half-period counts of each tick.
    Measured,
    /// From the first frequency after the switch and τ.
    Modelled,
    /// From all frequencies after the switch and τ, by least squares.
    Fitted,
}

/// Detection and exclusion of a failed gyro.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields, title = "Parity check of the gyros")]
pub struct GyroParity {
    /// Limit of the parity vector's length.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub limit_deg_per_h: f64,
    /// Ticks in a row before a sensor is excluded.
    #[schemars(range(min = 1, max = 1_000_000))]
    pub confirm_ticks: u32,
}
