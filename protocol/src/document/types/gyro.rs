//! The gyros of a document.

use isotherm_correction::servo::DEFAULT_SETTLE_TIME_CONSTANTS;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::super::curve::{
    Curve, DriftByForce, Frequency, HysteresisGain, LagGain, RateBias, RegressorGain, Relative,
    RelativeOverRate, ThermalAcceleration, ThermalRate,
};
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
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields, title = "Gyro")]
pub struct GyroSensor {
    /// Unique name, 1 to 24 bytes.
    #[schemars(length(min = 1, max = 24), extend("x-must-be" = "a name of 1 to 24 bytes"))]
    pub name: String,
    /// Temperature channel; default: `assumed_deg_c`.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(length(min = 1, max = 24), extend("x-must-be" = "a name of 1 to 24 bytes"))]
    pub channel: Option<String>,
    /// K0 for counts: angle per count, negative for a reversed axis. Source: models §2, 003.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("not" = { "const": 0 }))]
    pub increment_weight_arcsec_per_count: Option<f64>,
    /// K0 for means: true rate per stated rate. Source: models §2.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("not" = { "const": 0 }))]
    pub increment_weight_rad_per_rad: Option<f64>,
    /// Overrange from this magnitude, for counts; default: none.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub input_limit_counts_per_tick: Option<f64>,
    /// Overrange from this magnitude, for means; default: none.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub input_limit_deg_per_s: Option<f64>,
    /// K(T)/K0 − 1. Source: models §2, 003.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub increment_weight_error: Option<Curve<Relative>>,
    /// Static (non-magnetic) bias. Source: 003; K0(T) of 000; 001.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub static_bias: Option<Curve<RateBias>>,
    /// Bias with the sign of the lasing mode. Source: 003.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub magnetic_bias: Option<Curve<RateBias>>,
    /// Bias with the sign of the meander's phase, if reported, else +. Source: 003.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub slow_meander: Option<Curve<RateBias>>,
    /// K1±, multiplies Ṫ; over T or Ṫ. Source: 000; 001 (x3).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub thermal_rate: Option<Branches<Curve<ThermalRate>>>,
    /// K2±, multiplies T̈; over T or T̈. Source: 000.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub thermal_acceleration: Option<Branches<Curve<ThermalAcceleration>>>,
    /// Thermal lags `Σ g(T)·(T − L_τ[T])/τ`, `L_τ` a first-order low-pass. Source: models §2, §8.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[schemars(length(max = 8))]
    pub lag: Vec<Lag>,
    /// Hysteresis `Σ g(T)·(p_w[T] − T)`, `p_w` a play. Source: models §2.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[schemars(length(max = 8))]
    pub hysteresis: Vec<Hysteresis>,
    /// Bias by other channels `Σ g(T)·(x − x₀)`; needs `channel`. Source: models §2.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[schemars(length(max = 8))]
    pub regressor: Vec<Regressor>,
    /// Drift by specific force along the case axes; needs `[accel]`. Source: models §2, IEEE 528.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub acceleration_sensitive_drift: Option<AlongAxes<Curve<DriftByForce>>>,
    /// Half the difference of K between positive and negative rates, over their mean. Source: models §2, IEEE 528.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub increment_weight_asymmetry: Option<Curve<Relative>>,
    /// K(ω)/K(T) − 1, ω the rate that the gyro reads. Source: models §2, IEEE 528.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub increment_weight_over_rate: Option<Curve<RelativeOverRate>>,
    /// Polynomial of the time since turn-on. Source: 002.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub trend: Option<Trend>,
    /// Lag of its reading, in ticks; all sensors are delayed to the slowest. Source: models §3.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.0, max = 1.0))]
    pub delay_ticks: Option<f64>,
    /// Transient of the path-length servo after a mode switch; needs `[mode_reversal]`. Source: models §6, 003.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub servo: Option<Servo>,
    /// Statistics of the remaining drift (constant, Markov process, trend), for the in-run estimator. Source: models §7, 002.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub drift: Option<Drift>,
    /// Standard errors: σ is published with every output. Source: models §2, IEEE 952.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sigma: Option<GyroSigma>,
}

/// One curve per thermal branch, both over the same argument.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields)]
pub struct Branches<C> {
    /// "+" curve: Ṫ·T̈ > 0. Source: 000.
    pub run_up: C,
    /// "−" curve, over the same argument: Ṫ·T̈ < 0. Source: 000.
    pub braking: C,
}

/// One curve per case axis; default of each: 0.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields)]
pub struct AlongAxes<C> {
    /// Along x.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub x: Option<C>,
    /// Along y.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub y: Option<C>,
    /// Along z.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub z: Option<C>,
}

/// One thermal lag.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields, title = "Thermal lag")]
pub struct Lag {
    /// τ, at least `grid_step_s`.
    #[schemars(range(min = 0.001, max = 1e7))]
    pub time_constant_s: f64,
    /// g(T).
    pub gain: Curve<LagGain>,
}

/// One play.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields, title = "Hysteresis")]
pub struct Hysteresis {
    /// w.
    #[schemars(range(min = 0.001, max = 1000.0))]
    pub half_width_deg_c: f64,
    /// g(T).
    pub gain: Curve<HysteresisGain>,
}

/// One regressor.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields, title = "Regressor")]
pub struct Regressor {
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
    pub gain: Curve<RegressorGain>,
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
    pub rest_frequency: Curve<Frequency>,
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
