//! An accelerometer's terms (models §3): f = (U − S(T))·r(T_board)/K(T).

use super::ramp::Ramp;
use crate::calibration::AccelParts;
use crate::channel::ThermalFilter;
use crate::curve::{Curve, CurveError, CurveParts};
use crate::units::{Span, Timestamp};

/// An accelerometer, compiled.
#[derive(Debug, Clone, PartialEq)]
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

/// Memory of one accelerometer's thermal terms.
///
/// Sensor and board follow channels of their own, so each has its own ramp.
#[derive(Debug, Clone)]
pub struct AccelThermal {
    /// S (output units) and 1/K (m/s² per output unit).
    sensor: Ramp<2>,
    /// r (dimensionless).
    board: Ramp<1>,
    clamped_sensor: bool,
    clamped_board: bool,
    started_sensor: bool,
    started_board: bool,
}

impl AccelThermal {
    /// Starts with the terms as they are at the assumed temperature.
    #[must_use]
    pub fn new(model: &AccelModel, filter: &ThermalFilter) -> Self {
        let mut thermal = Self {
            sensor: Ramp::hold([0.0; 2]),
            board: Ramp::hold([1.0]),
            clamped_sensor: false,
            clamped_board: false,
            started_sensor: false,
            started_board: false,
        };
        thermal.update_sensor(model, filter.assumed_deg_c, Timestamp::default(), Span::ZERO);
        thermal.update_board(model, filter.assumed_deg_c, Timestamp::default(), Span::ZERO);
        thermal.started_sensor = false;
        thermal.started_board = false;
        thermal
    }

    /// Evaluates bias and scale factor at the sensor's temperature (°C).
    pub fn update_sensor(&mut self, model: &AccelModel, temperature: f64, start: Timestamp, over: Span) {
        let (bias, scale_factor) = (model.bias.at(temperature), model.scale_factor.at(temperature));
        self.clamped_sensor = bias.clamped || scale_factor.clamped;
        let over = if self.started_sensor { over } else { Span::ZERO };
        self.started_sensor = true;
        self.sensor.turn(start, over, [bias.value, 1.0 / scale_factor.value]);
    }

    /// Evaluates the board ratio at the board's temperature (°C).
    pub fn update_board(&mut self, model: &AccelModel, temperature: f64, start: Timestamp, over: Span) {
        let ratio = model.board_ratio.at(temperature);
        self.clamped_board = ratio.clamped;
        let over = if self.started_board { over } else { Span::ZERO };
        self.started_board = true;
        self.board.turn(start, over, [ratio.value]);
    }

    /// Specific force (m/s²) that an output (V, counts/s or m/s²) stands for at `time`.
    #[must_use]
    pub fn specific_force(&self, output: f64, time: Timestamp) -> f64 {
        let [bias, per_scale_factor] = self.sensor.at(time);
        let [ratio] = self.board.at(time);
        (output - bias) * ratio * per_scale_factor
    }

    /// Whether an argument was outside its fitted range at the last evaluation.
    #[must_use]
    pub fn clamped(&self) -> bool {
        self.clamped_sensor || self.clamped_board
    }
}
