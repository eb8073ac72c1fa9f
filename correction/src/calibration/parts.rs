//! The plain parts of a calibration, in SI, as a document or a fit hands them over.

use alloc::vec::Vec;

use serde::{Deserialize, Serialize};

use crate::channel::{ChannelParts, ThermalFilterParts};
use crate::curve::CurveParts;
use crate::drift::DriftParts;
use crate::operation::SelfTestParts;
use crate::orientation::OrientationParts;
use crate::reversal::ReversalParts;
use crate::sample::OutputKind;
use crate::servo::ServoParts;

/// All parts of one unit's calibration.
#[derive(Debug, Clone, PartialEq)]
pub struct CalibrationParts {
    /// Filter and derivative step that every channel uses: part of the fit, not of the service.
    pub filter: ThermalFilterParts,
    /// Temperature channels; sensors name them by index.
    pub channels: Vec<ChannelParts>,
    /// What the gyros' raw readings stand for.
    pub gyro_output: OutputKind,
    /// Three to eight gyros, in the order of the raw readings.
    pub gyros: Vec<GyroParts>,
    /// Input axes of the gyros in case axes.
    pub gyro_orientation: OrientationParts,
    /// Channels whose mean the gyro orientation follows.
    pub gyro_orientation_channels: Vec<usize>,
    /// What the accelerometers' raw readings stand for.
    pub accel_output: OutputKind,
    /// Three to eight accelerometers, or none.
    pub accels: Vec<AccelParts>,
    /// Input axes of the accelerometers in case axes; `None` exactly where there are none.
    pub accel_orientation: Option<OrientationParts>,
    /// Channels whose mean the accelerometer orientation follows.
    pub accel_orientation_channels: Vec<usize>,
    /// The substitution over a mode switch; `None` for an instrument without modes.
    pub reversal: Option<ReversalParts>,
    /// What the producer's own voltages and counters must be in a self-test.
    pub self_test: SelfTestParts,
}

/// One gyro (models §2): θ = K(T)·P − Ω·Δt.
#[derive(Debug, Clone, PartialEq)]
pub struct GyroParts {
    /// Index of the temperature channel that the gyro follows; `None`: the assumed temperature holds for ever.
    pub channel: Option<usize>,
    /// `K_0`: angle that one count stands for (rad per count), or dimensionless (rad per rad) for a mean-rate output;
    /// the raw reading is multiplied by it. Non-zero; negative where the input axis is mounted reversed.
    pub increment_weight: f64,
    /// `κ(T) = K(T)/K_0 − 1` over temperature (dimensionless over °C).
    pub increment_weight_error: Option<CurveParts>,
    /// Readings of this magnitude and above are flagged overrange (counts per tick, or rad/s).
    pub input_limit: f64,
    /// Non-magnetic (static) bias over temperature (rad/s over °C).
    pub static_bias: Option<CurveParts>,
    /// Magnetic bias over temperature, entering with the sign of the lasing mode (rad/s over °C).
    pub magnetic_bias: Option<CurveParts>,
    /// Slow-meander term over temperature (rad/s over °C).
    pub slow_meander: Option<CurveParts>,
    /// K1±: thermal-rate term, rad/s per °C/s.
    pub thermal_rate: Option<BranchedParts>,
    /// K2±: thermal-acceleration term, rad/s per °C/s².
    pub thermal_acceleration: Option<BranchedParts>,
    /// Thermal lags; at most [`crate::thermal::MAX_LAGS`].
    pub lags: Vec<LagParts>,
    /// Trend since turn-on.
    pub trend: Option<TrendParts>,
    /// Perimeter-servo transient after a mode switch.
    pub servo: Option<ServoParts>,
    /// What the drift estimator is to expect; `None`: it is not run for this gyro.
    pub drift: Option<DriftParts>,
}

/// The argument of a branched coefficient.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum BranchArgument {
    /// Smoothed temperature T̄ (°C).
    Temperature,
    /// The derivative that the coefficient multiplies: Ṫ (°C/s) for K1, T̈ (°C/s²) for K2.
    Derivative,
}

/// A coefficient with one curve per thermal branch \[000\]: run-up while Ṫ·T̈ > 0, braking while Ṫ·T̈ < 0.
#[derive(Debug, Clone, PartialEq)]
pub struct BranchedParts {
    /// What the curves are functions of.
    pub argument: BranchArgument,
    /// The "+" curve.
    pub run_up: CurveParts,
    /// The "−" curve.
    pub braking: CurveParts,
}

/// One thermal lag (models §2, §8) of a gyro's or an accelerometer's bias: `g(T)·(T − L_τ[T])/τ`.
#[derive(Debug, Clone, PartialEq)]
pub struct LagParts {
    /// τ (s), at least the filter's grid step.
    pub time_constant_s: f64,
    /// g over temperature (a gyro's: rad/s per °C/s, that is rad/°C; an accelerometer's: output units per °C/s).
    pub gain: CurveParts,
}

/// Polynomial of the time since turn-on, held constant outside its interval.
#[derive(Debug, Clone, PartialEq)]
pub struct TrendParts {
    /// Coefficients of t⁰…t² (rad/s per sʲ), one to three of them.
    pub coefficients: Vec<f64>,
    /// Interval over which it was fitted (s since turn-on).
    pub interval_s: [f64; 2],
}

/// One accelerometer (models §3): `f = (U − S(T) − lags)·r(T_board)/K(T)`.
#[derive(Debug, Clone, PartialEq)]
pub struct AccelParts {
    /// Index of the temperature channel of the sensor; `None`: the assumed temperature holds for ever.
    pub channel: Option<usize>,
    /// Index of the electronics board's channel; needed where `board_ratio` is given.
    pub board_channel: Option<usize>,
    /// K over temperature: output per m/s² (V, counts/s or m/s² per m/s²); divides. Never zero over its range.
    pub scale_factor: CurveParts,
    /// S over temperature, in output units (V, counts/s or m/s²).
    pub bias: Option<CurveParts>,
    /// Thermal lags of the bias, their gains in output units per °C/s; at most [`crate::thermal::MAX_LAGS`].
    pub lags: Vec<LagParts>,
    /// r over the board's temperature (dimensionless); 1 at the calibration temperature.
    pub board_ratio: Option<CurveParts>,
    /// Outputs of this magnitude and above are flagged overrange (counts per tick, or output units).
    pub input_limit: f64,
}
