//! An accelerometer's terms (models §3): `f = (U − S(T) − Σ g(T)·(T − L_τ[T])/τ)·r(T_board)/K(T)`.

use alloc::vec::Vec;

use serde::{Deserialize, Serialize};

use super::lag::{Lag, MAX_LAGS, advance, settled};
use super::ramp::{Follower, Ramp};
use crate::calibration::AccelParts;
use crate::channel::{ThermalFilter, ThermalState};
use crate::curve::{Curve, CurveError, CurveParts};
use crate::units::{Span, Timestamp};

/// An accelerometer, compiled.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct AccelModel {
    pub(crate) channel: Option<usize>,
    pub(crate) board_channel: Option<usize>,
    pub(crate) scale_factor: Curve,
    pub(crate) bias: Curve,
    pub(crate) lags: Vec<Lag>,
    pub(crate) board_ratio: Curve,
    pub(crate) input_limit: f64,
}

impl AccelModel {
    /// Compiles an accelerometer; `report` hears of every curve that is wrong.
    pub(crate) fn new(
        parts: &AccelParts,
        filter: &ThermalFilter,
        report: &mut dyn FnMut(&'static str, CurveError),
    ) -> Option<Self> {
        let mut curve = |field, parts: Option<&CurveParts>, absent| match parts.map(Curve::new) {
            None => Some(Curve::constant(absent)),
            Some(Ok(curve)) => Some(curve),
            Some(Err(error)) => {
                report(field, error);
                None
            }
        };
        let scale_factor = curve("scale_factor", Some(&parts.scale_factor), 1.0);
        let bias = curve("bias", parts.bias.as_ref(), 0.0);
        let board_ratio = curve("board_ratio", parts.board_ratio.as_ref(), 1.0);
        let mut lags = Vec::with_capacity(parts.lags.len());
        for lag in &parts.lags {
            lags.push(Lag::new(lag.time_constant_s, curve("lags", Some(&lag.gain), 0.0)?, filter));
        }
        Some(Self {
            channel: parts.channel,
            board_channel: parts.board_channel,
            scale_factor: scale_factor?,
            bias: bias?,
            lags,
            board_ratio: board_ratio?,
            input_limit: parts.input_limit,
        })
    }

    /// S (output units) and K on a ramp that has lasted for long, so that every lag has settled on it.
    pub(crate) fn steady(&self, thermal: &ThermalState, filter: &ThermalFilter) -> (f64, f64) {
        let lagged = settled(&self.lags, thermal, filter);
        let ([bias, _], _) = sensor_terms(self, thermal.temperature, &lagged);
        (bias, self.scale_factor.at(thermal.temperature).value)
    }

    /// Every curve over the sensor's own temperature.
    pub(crate) fn curves_over_temperature(&self) -> impl Iterator<Item = &Curve> {
        [&self.scale_factor, &self.bias].into_iter().chain(self.lags.iter().map(|lag| &lag.gain))
    }
}

/// Values of an accelerometer's thermal terms.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct AccelTerms {
    /// S (output units).
    pub bias: f64,
    /// 1/K (m/s² per output unit).
    pub per_scale_factor: f64,
    /// r (dimensionless).
    pub ratio: f64,
}

impl AccelTerms {
    /// Specific force (m/s²) that an output (V, counts/s or m/s²) stands for.
    #[must_use]
    pub fn specific_force(&self, output: f64) -> f64 {
        (output - self.bias) * self.ratio * self.per_scale_factor
    }
}

/// Memory of one accelerometer's thermal terms.
///
/// Sensor and board follow channels of their own, so each has its own ramp.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct AccelThermal {
    /// S (output units) and 1/K (m/s² per output unit).
    sensor: Follower<2>,
    /// r (dimensionless).
    board: Follower<1>,
    /// `L_τ[T]` of each lag (°C).
    lagged: [f64; MAX_LAGS],
}

impl AccelThermal {
    /// Starts with the terms as they are at the assumed temperature.
    #[must_use]
    pub fn new(model: &AccelModel, filter: &ThermalFilter) -> Self {
        let lagged = [filter.assumed_deg_c; MAX_LAGS];
        let (sensor, sensor_clamped) = sensor_terms(model, filter.assumed_deg_c, &lagged);
        let ratio = model.board_ratio.at(filter.assumed_deg_c);
        Self {
            sensor: Follower::assumed(sensor, sensor_clamped),
            board: Follower::assumed([ratio.value], ratio.clamped),
            lagged,
        }
    }

    /// Goes on with the lags of an earlier calibration, where their time constants are the same.
    pub fn carry_lags(&mut self, model: &AccelModel, before: (&AccelModel, &Self)) {
        let (old_model, old) = before;
        if old_model.lags.iter().map(|lag| lag.decay).eq(model.lags.iter().map(|lag| lag.decay)) {
            self.lagged = old.lagged;
        }
    }

    /// Starts the lags anew from a temperature that is taken to have stood for ever.
    pub fn restart(&mut self, temperature: f64) {
        self.lagged = [temperature; MAX_LAGS];
    }

    /// Moves the lags on by one grid point.
    pub fn grid_point(&mut self, model: &AccelModel, thermal: &ThermalState) {
        advance(&model.lags, &mut self.lagged, thermal.temperature);
    }

    /// Evaluates bias and scale factor at the sensor's temperature (°C).
    pub fn update_sensor(&mut self, model: &AccelModel, temperature: f64, start: Timestamp, over: Span) {
        let (terms, clamped) = sensor_terms(model, temperature, &self.lagged);
        self.sensor.follow(terms, clamped, start, over);
    }

    /// Evaluates the board ratio at the board's temperature (°C).
    pub fn update_board(&mut self, model: &AccelModel, temperature: f64, start: Timestamp, over: Span) {
        let ratio = model.board_ratio.at(temperature);
        self.board.follow([ratio.value], ratio.clamped, start, over);
    }

    /// Arrives at once where the terms are heading, after a step of the producer's clock.
    pub fn settle(&mut self) {
        self.sensor.settle();
        self.board.settle();
    }

    /// The terms in use at `time`.
    #[must_use]
    pub fn at(&self, time: Timestamp) -> AccelTerms {
        let [bias, per_scale_factor] = self.sensor.at(time);
        let [ratio] = self.board.at(time);
        AccelTerms { bias, per_scale_factor, ratio }
    }

    /// The ways that bias and 1/K are on, and the board ratio.
    pub(crate) const fn ramps(&self) -> (&Ramp<2>, &Ramp<1>) {
        (self.sensor.ramp(), self.board.ramp())
    }

    /// Whether an argument was outside its fitted range at the last evaluation.
    #[must_use]
    pub fn clamped(&self) -> bool {
        self.sensor.clamped() || self.board.clamped()
    }
}

/// S and 1/K at a temperature (°C), and whether it is outside their fitted range.
fn sensor_terms(model: &AccelModel, temperature: f64, lagged: &[f64; MAX_LAGS]) -> ([f64; 2], bool) {
    let (bias, scale_factor) = (model.bias.at(temperature), model.scale_factor.at(temperature));
    let mut sum = bias.value;
    let mut clamped = bias.clamped || scale_factor.clamped;
    for (lag, lagged) in model.lags.iter().zip(lagged) {
        let gain = lag.gain.at(temperature);
        sum += gain.value * (temperature - lagged) * lag.per_second;
        clamped |= gain.clamped;
    }
    ([sum, 1.0 / scale_factor.value], clamped)
}
