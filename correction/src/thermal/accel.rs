//! An accelerometer's terms (models §3): `f = (U − S(T))·r(T_board)/K(T)`.

use serde::{Deserialize, Serialize};

use super::ramp::Follower;
use crate::calibration::AccelParts;
use crate::channel::ThermalFilter;
use crate::curve::{Curve, CurveError, CurveParts};
use crate::units::{Span, Timestamp};

/// An accelerometer, compiled.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct AccelModel {
    pub(crate) channel: Option<usize>,
    pub(crate) board_channel: Option<usize>,
    pub(crate) scale_factor: Curve,
    pub(crate) bias: Curve,
    pub(crate) board_ratio: Curve,
    pub(crate) input_limit: f64,
}

impl AccelModel {
    /// Compiles an accelerometer; `report` hears of every curve that is wrong.
    pub(crate) fn new(parts: &AccelParts, report: &mut dyn FnMut(&'static str, CurveError)) -> Option<Self> {
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
        Some(Self {
            channel: parts.channel,
            board_channel: parts.board_channel,
            scale_factor: scale_factor?,
            bias: bias?,
            board_ratio: board_ratio?,
            input_limit: parts.input_limit,
        })
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
}

impl AccelThermal {
    /// Starts with the terms as they are at the assumed temperature.
    #[must_use]
    pub fn new(model: &AccelModel, filter: &ThermalFilter) -> Self {
        let (sensor, sensor_clamped) = sensor_terms(model, filter.assumed_deg_c);
        let ratio = model.board_ratio.at(filter.assumed_deg_c);
        Self {
            sensor: Follower::assumed(sensor, sensor_clamped),
            board: Follower::assumed([ratio.value], ratio.clamped),
        }
    }

    /// Evaluates bias and scale factor at the sensor's temperature (°C).
    pub fn update_sensor(&mut self, model: &AccelModel, temperature: f64, start: Timestamp, over: Span) {
        let (terms, clamped) = sensor_terms(model, temperature);
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

    /// Whether an argument was outside its fitted range at the last evaluation.
    #[must_use]
    pub fn clamped(&self) -> bool {
        self.sensor.clamped() || self.board.clamped()
    }
}

/// S and 1/K at a temperature (°C), and whether it is outside their fitted range.
fn sensor_terms(model: &AccelModel, temperature: f64) -> ([f64; 2], bool) {
    let (bias, scale_factor) = (model.bias.at(temperature), model.scale_factor.at(temperature));
    ([bias.value, 1.0 / scale_factor.value], bias.clamped || scale_factor.clamped)
}
