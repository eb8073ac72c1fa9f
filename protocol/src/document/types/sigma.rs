//! Standard errors of the sensors.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Standard errors of a gyro. Where any sensor has this table, σ goes out with every output; what is not stated is unknown.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields, title = "Standard errors of a gyro")]
pub struct GyroSigma {
    /// N; default: that of `drift`. Source: IEEE 952.
    #[schemars(range(min = 0.0, max = 3000.0))]
    pub angle_random_walk_deg_per_sqrt_h: Option<f64>,
    /// Q; default: a count/√12, without counts 0. Source: IEEE 952.
    #[schemars(range(min = 0.0, max = 1e6))]
    pub quantisation_arcsec: Option<f64>,
    /// B; default: 0. Source: IEEE 952.
    #[schemars(range(min = 0.0, max = 20_000.0))]
    pub bias_instability_deg_per_h: Option<f64>,
    /// K, from turn-on; default: 0. Source: IEEE 952.
    #[schemars(range(min = 0.0, max = 20_000.0))]
    pub rate_random_walk_deg_per_h_per_sqrt_h: Option<f64>,
    /// Of the bias; default: `initial_sigma` and `sigma` of `drift`.
    pub bias: Option<GyroBiasSigma>,
    /// Of K.
    #[schemars(range(min = 0.0, max = 1e6))]
    pub increment_weight_ppm: Option<f64>,
    /// Of the input axis, about either transverse axis.
    #[schemars(range(min = 0.0, max = 1e6))]
    pub misalignment_arcsec: Option<f64>,
    /// Of the bias beyond the fitted temperatures.
    #[schemars(range(min = 0.0, max = 20_000.0))]
    pub clamping_deg_per_h_per_deg_c: Option<f64>,
}

/// Standard error of a gyro's bias: of the coefficients of `Σ c_j·(T − T_ref)^j`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields, title = "Standard error of a gyro's bias")]
pub struct GyroBiasSigma {
    /// `T_ref`.
    #[serde(default)]
    #[schemars(range(min = -273.15, max = 1000.0))]
    pub reference_deg_c: f64,
    /// σ of c₀, c₁, ….
    #[schemars(length(min = 1, max = 4), inner(range(min = 0.0, max = 20_000.0)))]
    pub sigma_deg_per_h: Vec<f64>,
    /// Their correlation matrix; default: independent.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[schemars(length(max = 4), inner(length(max = 4)))]
    pub correlation_ratio: Vec<Vec<f64>>,
}

/// Standard errors of an accelerometer, as of a gyro.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields, title = "Standard errors of an accelerometer")]
pub struct AccelSigma {
    /// N. Source: IEEE 952.
    #[schemars(range(min = 0.0, max = 1e4))]
    pub velocity_random_walk_m_per_s_per_sqrt_h: Option<f64>,
    /// Q; default: a count/√12, without counts 0. Source: IEEE 952.
    #[schemars(range(min = 0.0, max = 1e3))]
    pub quantisation_m_per_s: Option<f64>,
    /// B; default: 0. Source: IEEE 952.
    #[schemars(range(min = 0.0, max = 1e3))]
    pub bias_instability_m_per_s2: Option<f64>,
    /// K, from turn-on; default: 0. Source: IEEE 952.
    #[schemars(range(min = 0.0, max = 1e3))]
    pub acceleration_random_walk_m_per_s2_per_sqrt_h: Option<f64>,
    /// Of the bias.
    pub bias: Option<AccelBiasSigma>,
    /// Of K.
    #[schemars(range(min = 0.0, max = 1e6))]
    pub scale_factor_ppm: Option<f64>,
    /// Of the input axis, about either transverse axis.
    #[schemars(range(min = 0.0, max = 1e6))]
    pub misalignment_arcsec: Option<f64>,
    /// Of the bias beyond the fitted temperatures.
    #[schemars(range(min = 0.0, max = 1e3))]
    pub clamping_m_per_s2_per_deg_c: Option<f64>,
}

/// Standard error of an accelerometer's bias, as of a gyro's.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields, title = "Standard error of an accelerometer's bias")]
pub struct AccelBiasSigma {
    /// `T_ref`.
    #[serde(default)]
    #[schemars(range(min = -273.15, max = 1000.0))]
    pub reference_deg_c: f64,
    /// σ of c₀, c₁, ….
    #[schemars(length(min = 1, max = 4), inner(range(min = 0.0, max = 1e3)))]
    pub sigma_m_per_s2: Vec<f64>,
    /// Their correlation matrix; default: independent.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[schemars(length(max = 4), inner(length(max = 4)))]
    pub correlation_ratio: Vec<Vec<f64>>,
}
