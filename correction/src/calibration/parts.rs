//! The plain parts of a calibration, in SI, as a document or a fit hands them over.

use alloc::vec::Vec;

use serde::{Deserialize, Serialize};

use crate::channel::{ChannelParts, ThermalFilterParts};
use crate::curve::{ANYWHERE, CurveParts};
use crate::drift::DriftParts;
use crate::operation::SelfTestParts;
use crate::orientation::OrientationParts;
use crate::reversal::ReversalParts;
use crate::sample::OutputKind;
use crate::servo::ServoParts;
use crate::sigma::SigmaParts;
use crate::thermal::Feature;

/// All parts of one unit's calibration.
#[derive(Debug, Clone, PartialEq)]
pub struct CalibrationParts {
    /// Filter and derivative step that every channel uses: part of the fit, not of the service.
    pub filter: ThermalFilterParts,
    /// Temperature channels; sensors name them by index.
    pub channels: Vec<ChannelParts>,
    /// Channels that are no temperatures, which regressors name; ranges and limits in units of their own.
    pub auxiliaries: Vec<ChannelParts>,
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

/// Range of what temperature does not change (°C): nothing lies outside.
pub const EVERYWHERE_DEG_C: [f64; 2] = ANYWHERE;
/// Input limit where there is none: beyond every reading.
pub const NO_LIMIT: f64 = 1e100;

impl CalibrationParts {
    /// A unit of gyros, three to eight, that all follow one channel, each with the terms that it is given and nothing else: of readings
    /// of zero it takes what they are. With coefficients of one that is a column of a fit for each gyro, with filter, grid and the
    /// ramps between temperature readings as they are in operation.
    #[must_use]
    pub fn columns(
        filter: ThermalFilterParts,
        channel: ChannelParts,
        terms: impl IntoIterator<Item = Vec<TermParts>>,
    ) -> Self {
        let gyro = |terms| GyroParts {
            channel: Some(0),
            increment_weight: 1.0,
            input_limit: NO_LIMIT,
            terms,
            increment_weight_over_rate: None,
            trend: None,
            servo: None,
            drift: None,
            delay_ticks: 0.0,
            sigma: None,
        };
        let gyros: Vec<_> = terms.into_iter().map(gyro).collect();
        // Any axes that span space: what is looked at is not resolved along them.
        let row = |gyro: usize| [0, 1, 2].map(|axis| if axis == gyro % 3 { 1.0 } else { 0.0 });
        Self {
            filter,
            channels: [channel].into(),
            auxiliaries: Vec::new(),
            gyro_output: OutputKind::Mean,
            gyro_orientation: OrientationParts {
                reference_deg_c: 0.0,
                rows: (0..gyros.len()).map(row).collect(),
                slopes_per_deg_c: Vec::new(),
                plays: Vec::new(),
                weights: Vec::new(),
                range_deg_c: EVERYWHERE_DEG_C,
                parity_limit: None,
                parity_confirm_ticks: 1,
            },
            gyros,
            gyro_orientation_channels: Vec::new(),
            accel_output: OutputKind::Mean,
            accels: Vec::new(),
            accel_orientation: None,
            accel_orientation_channels: Vec::new(),
            reversal: None,
            self_test: SelfTestParts::default(),
        }
    }
}

/// One gyro (models §2): θ = K(T)·P − Ω·Δt.
#[derive(Debug, Clone, PartialEq)]
pub struct GyroParts {
    /// Index of the temperature channel that the gyro follows; `None`: the assumed temperature holds for ever.
    pub channel: Option<usize>,
    /// `K_0`: angle that one count stands for (rad per count), or dimensionless (rad per rad) for a mean-rate output;
    /// the raw reading is multiplied by it. Non-zero; negative where the input axis is mounted reversed.
    pub increment_weight: f64,
    /// Readings of this magnitude and above are flagged overrange (counts per tick, or rad/s).
    pub input_limit: f64,
    /// Terms over temperature: see [`GYRO_TERMS`](crate::thermal::GYRO_TERMS).
    pub terms: Vec<TermParts>,
    /// `K(ω)/K(T) − 1` over the rate ω that the gyro reads (dimensionless over rad/s).
    pub increment_weight_over_rate: Option<CurveParts>,
    /// Trend since turn-on.
    pub trend: Option<TrendParts>,
    /// Perimeter-servo transient after a mode switch.
    pub servo: Option<ServoParts>,
    /// What the drift estimator is to expect; `None`: it is not run for this gyro.
    pub drift: Option<DriftParts>,
    /// By how much of a tick its reading lags behind the tick's time, 0…1.
    pub delay_ticks: f64,
    /// Its standard errors; where a sensor states any, σ goes out with every output.
    pub sigma: Option<SigmaParts>,
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

/// A coefficient of a term.
#[derive(Debug, Clone, PartialEq)]
pub enum CoefficientParts {
    /// Over the sensor's temperature (°C).
    Curve(CurveParts),
    /// By thermal branch.
    Branched(BranchedParts),
}

/// A channel, by its index among those of its kind.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Source {
    /// A temperature channel.
    Temperature(usize),
    /// An auxiliary channel.
    Auxiliary(usize),
}

/// A regressor x − x₀: the smoothed value of a channel, less that of another one and a constant.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct RegressorParts {
    /// The channel.
    pub channel: Source,
    /// What is taken from it, for a difference; of the same unit.
    pub minus: Option<Source>,
    /// The constant (the channel's unit).
    pub reference: f64,
}

impl RegressorParts {
    /// The channels that it rests on.
    pub(crate) fn channels(&self) -> impl Iterator<Item = Source> {
        core::iter::once(self.channel).chain(self.minus)
    }

    /// Its value from the smoothed values of channels; 0 until all of them were read.
    pub(crate) fn value(&self, channels: &dyn Fn(Source) -> Option<f64>) -> f64 {
        let value = || {
            let minus = self.minus.map_or(Some(0.0), channels)?;
            Some(channels(self.channel)? - minus - self.reference)
        };
        value().unwrap_or(0.0)
    }
}

/// One term of a sensor (models §2, §3).
///
/// The unit of a gyro's coefficients is rad/s per unit of the [`Feature`], of an accelerometer's output units per unit of it; where
/// the feature is what the sensor reads, or its magnitude, they are dimensionless, and s²/m where it is the square of a force.
#[derive(Debug, Clone, PartialEq)]
pub struct TermParts {
    /// What the coefficient is multiplied by. Only [`Feature::Lag`], [`Feature::Play`] and [`Feature::Regressor`] may stand more than
    /// once, at most [`MAX_LAGS`](crate::thermal::MAX_LAGS), [`MAX_PLAYS`](crate::thermal::MAX_PLAYS) and
    /// [`MAX_REGRESSORS`](crate::thermal::MAX_REGRESSORS) times.
    pub feature: Feature,
    /// τ of a lag (s), at least the filter's grid step; half width of a play (°C, > 0); no other feature looks at it.
    pub parameter: f64,
    /// What a regressor is, of a sensor that follows a temperature; no other feature looks at it.
    pub regressor: Option<RegressorParts>,
    /// The coefficient.
    pub coefficient: CoefficientParts,
}

impl TermParts {
    /// A term with a coefficient over temperature.
    #[must_use]
    pub fn new(feature: Feature, coefficient: CurveParts) -> Self {
        Self::of(feature, CoefficientParts::Curve(coefficient))
    }

    /// A term with a coefficient by thermal branch.
    #[must_use]
    pub fn branched(feature: Feature, coefficient: BranchedParts) -> Self {
        Self::of(feature, CoefficientParts::Branched(coefficient))
    }

    fn of(feature: Feature, coefficient: CoefficientParts) -> Self {
        Self { feature, parameter: 0.0, regressor: None, coefficient }
    }

    /// A thermal lag `g(T)·(T − L_τ[T])/τ` (models §2, §8); τ in s.
    #[must_use]
    pub fn lag(time_constant_s: f64, gain: CurveParts) -> Self {
        Self { parameter: time_constant_s, ..Self::new(Feature::Lag, gain) }
    }

    /// A regressor `g(T)·(x − x₀)` (models §2).
    #[must_use]
    pub fn regressor(regressor: RegressorParts, gain: CurveParts) -> Self {
        Self { regressor: Some(regressor), ..Self::new(Feature::Regressor, gain) }
    }

    /// A hysteresis `g(T)·(p_w[T] − T)` (models §2); w in °C.
    #[must_use]
    pub fn play(half_width_deg_c: f64, gain: CurveParts) -> Self {
        Self { parameter: half_width_deg_c, ..Self::new(Feature::Play, gain) }
    }
}

/// Polynomial of the time since turn-on, held constant outside its interval.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TrendParts {
    /// Coefficients of t⁰…t² (rad/s per sʲ), one to three of them.
    pub coefficients: Vec<f64>,
    /// Interval over which it was fitted (s since turn-on).
    pub interval_s: [f64; 2],
}

/// One accelerometer (models §3): `f = (U − S(T) − …)·r(T_board)/K(T)`.
#[derive(Debug, Clone, PartialEq)]
pub struct AccelParts {
    /// Index of the temperature channel of the sensor; `None`: the assumed temperature holds for ever.
    pub channel: Option<usize>,
    /// Index of the electronics board's channel; needed where `board_ratio` is given.
    pub board_channel: Option<usize>,
    /// K over temperature: output per m/s² (V, counts/s or m/s² per m/s²); divides. Never zero over its range.
    pub scale_factor: CurveParts,
    /// Terms over temperature: see [`ACCEL_TERMS`](crate::thermal::ACCEL_TERMS).
    pub terms: Vec<TermParts>,
    /// r over the board's temperature (dimensionless); 1 at the calibration temperature.
    pub board_ratio: Option<CurveParts>,
    /// Where it sits, from the point whose specific force is published, in case axes (m).
    pub position_m: [f64; 3],
    /// By how much of a tick its reading lags behind the tick's time, 0…1.
    pub delay_ticks: f64,
    /// Outputs of this magnitude and above are flagged overrange (counts per tick, or output units).
    pub input_limit: f64,
    /// Its standard errors.
    pub sigma: Option<SigmaParts>,
}
