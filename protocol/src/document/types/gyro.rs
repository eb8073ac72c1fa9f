//! The gyros of a document.

use isotherm_correction::servo::DEFAULT_SETTLE_TIME_CONSTANTS;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::super::curve::{Curve, Frequency, LagGain, RateBias, Relative, ThermalAcceleration, ThermalRate};
use super::{Drift, Orientation};

/// The gyros of the unit: `θ = K(T)·P − Ω·Δt`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields, title = "Gyros")]
pub struct Gyro {
    /// What a raw reading is: "counts" of the tick, or "mean" rate over the tick (rad/s).
    pub output: GyroOutput,
    /// The gyros, in the order of the raw readings.
    #[schemars(length(min = 3, max = 8))]
    pub sensor: Vec<GyroSensor>,
    /// Their input axes in case axes. Source: models §4, 003, 004.
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
    /// Name for readers and reports, different from the other gyros' (1 to 24 bytes).
    #[schemars(length(min = 1, max = 24), extend("x-must-be" = "a name of 1 to 24 bytes"))]
    pub name: String,
    /// Temperature channel that the gyro follows; `temperature.assumed_deg_c` holds where left out.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(length(min = 1, max = 24), extend("x-must-be" = "a name of 1 to 24 bytes"))]
    pub channel: Option<String>,
    /// K0, where the output is "counts": the angle that one count stands for; multiplies. Negative where the
    /// input axis is mounted reversed. Source: models §2, 003.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("not" = { "const": 0 }))]
    pub increment_weight_arcsec_per_count: Option<f64>,
    /// K0, where the output is "mean": true rate per stated rate; multiplies. Source: models §2.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("not" = { "const": 0 }))]
    pub increment_weight_rad_per_rad: Option<f64>,
    /// Readings of this magnitude and above are flagged overrange, where the output is "counts"; no limit where left out.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub input_limit_counts_per_tick: Option<f64>,
    /// Readings of this magnitude and above are flagged overrange, where the output is "mean"; no limit where left out.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub input_limit_deg_per_s: Option<f64>,
    /// K(T)/K0 − 1. Source: models §2, 003.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub increment_weight_error: Option<Curve<Relative>>,
    /// Non-magnetic (static) bias. Source: 003; K0(T) of 000; 001.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub static_bias: Option<Curve<RateBias>>,
    /// Magnetic bias, entering with the sign of the lasing mode. Source: 003.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub magnetic_bias: Option<Curve<RateBias>>,
    /// Slow-meander term, entering with the sign of the meander's phase where the producer reports it. Source: 003.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub slow_meander: Option<Curve<RateBias>>,
    /// K1±, multiplied by Ṫ; its argument is T or Ṫ. Source: 000; 001 (x3).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub thermal_rate: Option<Branches<Curve<ThermalRate>>>,
    /// K2±, multiplied by T̈; its argument is T or T̈. Source: 000.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub thermal_acceleration: Option<Branches<Curve<ThermalAcceleration>>>,
    /// Thermal lags: `Σ g(T)·(T − L_τ[T])/τ`, `L_τ` being a first-order low-pass. Source: models §2, §8.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[schemars(length(max = 8))]
    pub lag: Vec<Lag>,
    /// Trend since turn-on. Source: 002.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub trend: Option<Trend>,
    /// Transient of the perimeter servo after a mode switch; needs `[mode_reversal]`. Source: models §6, 003.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub servo: Option<Servo>,
    /// What the in-run drift estimator is to expect; it does not run for the gyro where left out. Source: models §7, 002.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub drift: Option<Drift>,
}

/// One curve per thermal branch, both over the same argument.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields)]
pub struct Branches<C> {
    /// The "+" curve, in use while Ṫ·T̈ > 0. Source: 000.
    pub run_up: C,
    /// The "−" curve, in use while Ṫ·T̈ < 0. Source: 000.
    pub braking: C,
}

/// One thermal lag.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields, title = "Thermal lag")]
pub struct Lag {
    /// τ; not below `temperature.grid_step_s`.
    #[schemars(range(min = 0.001, max = 1e7))]
    pub time_constant_s: f64,
    /// g(T).
    pub gain: Curve<LagGain>,
}

/// Polynomial of the time since turn-on, held outside its interval.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields, title = "Trend since turn-on")]
pub struct Trend {
    /// Coefficients of power j = 0, 1, 2 of the time in hours: °/h per hʲ.
    #[schemars(length(min = 1, max = 3))]
    pub coefficients_deg_per_h: Vec<f64>,
    /// Interval that it was fitted over, since turn-on.
    #[schemars(inner(range(min = 0.0, max = 250_000.0)), extend("x-rising" = true))]
    pub interval_h: [f64; 2],
}

/// Transient of the perimeter servo after a mode switch.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields, title = "Perimeter-servo transient")]
pub struct Servo {
    /// "measured" from the half-period counts of each tick, "modelled" from the first of them and τ, or "fitted" from all of
    /// them so far and τ, by least squares.
    pub form: ServoKind,
    /// τ, with which the perimeter is pulled in.
    #[schemars(range(min = 1e-4, max = 1e3))]
    pub time_constant_s: f64,
    /// f0: frequency of the dither at rest.
    pub rest_frequency: Curve<Frequency>,
    /// Time after the switch, in multiples of τ, after which the transient counts as settled.
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
    /// Length of the parity vector beyond which a gyro must be at fault.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub limit_deg_per_h: f64,
    /// Ticks in a row that must point at the same gyro before it is excluded.
    #[schemars(range(min = 1, max = 1_000_000))]
    pub confirm_ticks: u32,
}
