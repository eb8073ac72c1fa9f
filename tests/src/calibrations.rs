//! Calibrations for tests, built from plain parts.

use std::sync::Arc;

use isotherm_correction::calibration::{
    AccelParts, BranchedParts, Calibration, CalibrationParts, GyroParts, RegressorParts, Source, TermParts,
};
use isotherm_correction::channel::{ChannelParts, ThermalFilterParts};
use isotherm_correction::curve::CurveParts;
use isotherm_correction::drift::DriftParts;
use isotherm_correction::operation::SelfTestParts;
use isotherm_correction::orientation::{AxesPlay, OrientationParts};
use isotherm_correction::reversal::ReversalParts;
use isotherm_correction::sample::{ChannelName, OutputKind};
pub use isotherm_correction::thermal::Feature;
use isotherm_correction::thermal::{ACCEL_TERMS, GYRO_TERMS, Term};

/// A constant over −60…100 °C.
#[must_use]
pub fn constant(value: f64) -> CurveParts {
    polynomial(&[value])
}

/// A polynomial about 20 °C over −60…100 °C.
#[must_use]
pub fn polynomial(coefficients: &[f64]) -> CurveParts {
    CurveParts::Polynomial { reference: 20.0, coefficients: coefficients.to_vec(), range: [-60.0, 100.0] }
}

/// Terms of a sensor that a test puts there, each in the place of what there was of its feature.
pub trait PutTerms {
    /// A coefficient over temperature.
    fn curve(&mut self, feature: Feature, coefficient: CurveParts);
    /// A coefficient by thermal branch.
    fn branched(&mut self, feature: Feature, coefficient: BranchedParts);
    /// All lags: time constant (s) and gain of each.
    fn lags(&mut self, lags: impl IntoIterator<Item = (f64, CurveParts)>);
}

impl PutTerms for Vec<TermParts> {
    fn curve(&mut self, feature: Feature, coefficient: CurveParts) {
        self.retain(|term| term.feature != feature);
        self.push(TermParts::new(feature, coefficient));
    }

    fn branched(&mut self, feature: Feature, coefficient: BranchedParts) {
        self.retain(|term| term.feature != feature);
        self.push(TermParts::branched(feature, coefficient));
    }

    fn lags(&mut self, lags: impl IntoIterator<Item = (f64, CurveParts)>) {
        self.retain(|term| term.feature != Feature::Lag);
        self.extend(lags.into_iter().map(|(time_constant_s, gain)| TermParts::lag(time_constant_s, gain)));
    }
}

/// A gyro with mean output (rad/s) that is right as it stands.
#[must_use]
pub fn plain_gyro() -> GyroParts {
    GyroParts {
        channel: Some(0),
        increment_weight: 1.0,
        input_limit: 1e6,
        terms: Vec::new(),
        increment_weight_over_rate: None,
        trend: None,
        servo: None,
        drift: None,
        delay_ticks: 0.0,
        sigma: None,
    }
}

/// An accelerometer with mean output (m/s²) that is right as it stands.
#[must_use]
pub fn plain_accel() -> AccelParts {
    AccelParts {
        channel: Some(0),
        board_channel: None,
        scale_factor: constant(1.0),
        terms: Vec::new(),
        board_ratio: None,
        position_m: [0.0; 3],
        input_limit: 1e6,
        delay_ticks: 0.0,
        sigma: None,
    }
}

/// An orientation from rows, without temperature dependence.
#[must_use]
pub fn orientation(rows: &[[f64; 3]]) -> OrientationParts {
    OrientationParts {
        reference_deg_c: 20.0,
        rows: rows.to_vec(),
        slopes_per_deg_c: Vec::new(),
        plays: Vec::new(),
        weights: Vec::new(),
        range_deg_c: [-60.0, 100.0],
        parity_limit: None,
        parity_confirm_ticks: 1,
    }
}

/// Sensors along the case axes.
pub const ALONG_CASE_AXES: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

/// One temperature channel that reads °C.
///
/// # Panics
/// Where the name is too long.
#[must_use]
pub fn channel(name: &str) -> ChannelParts {
    ChannelParts {
        name: ChannelName::from(name).expect("a short name"),
        conversion: vec![0.0, 1.0],
        range_deg_c: [-100.0, 150.0],
        spike_limit_deg_c: 20.0,
    }
}

/// Three gyros and three accelerometers along the case axes that are right as they stand.
#[must_use]
pub fn identity() -> CalibrationParts {
    CalibrationParts {
        filter: ThermalFilterParts {
            grid_step_s: 1.0,
            smoothing_s: 1.0,
            derivative_step_s: 1.0,
            stale_after_s: 60.0,
            branch_dead_band: 1e-6,
            assumed_deg_c: 20.0,
        },
        channels: vec![channel("t")],
        auxiliaries: Vec::new(),
        gyro_output: OutputKind::Mean,
        gyros: vec![plain_gyro(); 3],
        gyro_orientation: orientation(&ALONG_CASE_AXES),
        gyro_orientation_channels: vec![0],
        accel_output: OutputKind::Mean,
        accels: vec![plain_accel(); 3],
        accel_orientation: Some(orientation(&ALONG_CASE_AXES)),
        accel_orientation_channels: vec![0],
        reversal: None,
        self_test: SelfTestParts::default(),
    }
}

/// A term with a coefficient so many times that of which it adds about 10⁻⁴ rad/s or 10⁻³ m/s² where temperature swings by 3 °C about
/// 20 °C at 0.4 rad/s, the auxiliary channels differ by 2 ± 1, and the unit by about 0.5 rad/s and 10 m/s².
#[must_use]
pub fn stated(term: Term, gyros: bool, times: f64) -> TermParts {
    let feature = match term.feature {
        Feature::One | Feature::LasingMode | Feature::Meander => 1.0,
        Feature::Reading | Feature::RateMagnitude | Feature::Lag | Feature::ThermalRate => 0.5,
        Feature::ThermalAcceleration => 0.3,
        Feature::Play => 1.5,
        Feature::Regressor => 2.0,
        Feature::ForceX | Feature::ForceY | Feature::ForceZ => 10.0,
        Feature::ForceSquared => 100.0,
    };
    let gain = constant(times * if gyros { 1e-4 } else { 1e-3 } / feature);
    match term.feature {
        Feature::Lag => TermParts::lag(5.0, gain),
        Feature::Play => TermParts::play(1.5, gain),
        Feature::Regressor => {
            let (channel, minus) = (Source::Auxiliary(0), Some(Source::Auxiliary(1)));
            TermParts::regressor(RegressorParts { channel, minus, reference: 0.5 }, gain)
        }
        feature => TermParts::new(feature, gain),
    }
}

/// [`identity`] with two auxiliary channels, u and v.
#[must_use]
pub fn with_auxiliaries() -> CalibrationParts {
    CalibrationParts { auxiliaries: vec![channel("u"), channel("v")], ..identity() }
}

/// [`with_auxiliaries`] and every term that is declared, of each sensor, and axes that turn and stick.
#[must_use]
pub fn every_term() -> CalibrationParts {
    let mut parts = with_auxiliaries();
    for (i, gyro) in parts.gyros.iter_mut().enumerate() {
        gyro.terms = GYRO_TERMS.map(|term| stated(term, true, [1.0, -0.7, 0.4][i])).to_vec();
    }
    for (i, accel) in parts.accels.iter_mut().enumerate() {
        accel.terms = ACCEL_TERMS.map(|term| stated(term, false, [1.0, -0.7, 0.4][i])).to_vec();
    }
    for axes in [Some(&mut parts.gyro_orientation), parts.accel_orientation.as_mut()].into_iter().flatten() {
        axes.slopes_per_deg_c = vec![[0.0, 2e-6, -1e-6], [1e-6, 0.0, 3e-6], [-2e-6, 1e-6, 0.0]];
        axes.plays = vec![AxesPlay { half_width_deg_c: 0.4, share: 0.5 }];
    }
    parts
}

/// Three gyros only, with a magnetic bias and the substitution over a mode switch.
#[must_use]
pub fn mode_reversed(reversal: ReversalParts) -> CalibrationParts {
    let mut parts = identity();
    parts.accels.clear();
    parts.accel_orientation = None;
    parts.accel_orientation_channels.clear();
    parts.reversal = Some(reversal);
    for (i, gyro) in parts.gyros.iter_mut().enumerate() {
        gyro.terms.curve(Feature::LasingMode, constant(MAGNETIC_BIAS_RAD_PER_S * [1.0, -0.5, 2.0][i]));
    }
    parts
}

/// Magnetic bias of the first gyro of [`mode_reversed`] (rad/s): 10 °/h.
pub const MAGNETIC_BIAS_RAD_PER_S: f64 = 10.0 * std::f64::consts::PI / 180.0 / 3600.0;

/// Compiles parts that are known to be sound.
///
/// # Panics
/// Where they are not.
#[must_use]
pub fn compile(parts: &CalibrationParts) -> Arc<Calibration> {
    Arc::new(Calibration::new(parts).expect("the fixture is sound"))
}

/// A drift so lively that the estimator follows every reference.
#[must_use]
pub const fn lively_drift() -> DriftParts {
    DriftParts {
        sigma_rad_per_s: 1e-2,
        correlation_time_s: 600.0,
        trend_sigma_rad_per_s2: 1e-6,
        trend_correlation_time_s: 3600.0,
        initial_sigma_rad_per_s: 0.1,
        angle_random_walk_rad_per_sqrt_s: 1e-6,
    }
}
