//! An accelerometer's terms (models §3): `f = (U − S(T) − …)·r(T_board)/K(T)`.

use serde::{Deserialize, Serialize};

use super::bank::Follows;
use super::declared::ACCEL_TERMS;
use super::terms::{SensorState, Terms};
use crate::calibration::AccelParts;
use crate::channel::ThermalFilter;
use crate::curve::Curve;
use crate::defect::Checker;

/// An accelerometer, compiled.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct AccelModel {
    pub(crate) channel: Option<usize>,
    pub(crate) board_channel: Option<usize>,
    pub(crate) scale_factor: Curve,
    /// Of the bias.
    pub(crate) terms: Terms,
    pub(crate) board_ratio: Curve,
    pub(crate) input_limit: f64,
}

impl AccelModel {
    /// Compiles an accelerometer.
    pub(crate) fn new(parts: &AccelParts, filter: &ThermalFilter, checker: &mut Checker) -> Option<Self> {
        let scale_factor = checker.curve("scale_factor", &parts.scale_factor);
        let board_ratio = match &parts.board_ratio {
            Some(ratio) => checker.curve("board_ratio_error", ratio),
            None => Some(Curve::constant(1.0)),
        };
        let terms = Terms::new(&ACCEL_TERMS, &parts.terms, false, filter, checker);
        Some(Self {
            channel: parts.channel,
            board_channel: parts.board_channel,
            scale_factor: scale_factor?,
            terms: terms?,
            board_ratio: board_ratio?,
            input_limit: parts.input_limit,
        })
    }

    /// Every curve over the sensor's own temperature.
    pub(crate) fn curves_over_temperature(&self) -> impl Iterator<Item = &Curve> {
        core::iter::once(&self.scale_factor).chain(self.terms.curves_over_temperature())
    }
}

/// S (output units) and 1/K (m/s² per output unit) over the sensor's own temperature.
impl Follows<2> for AccelModel {
    fn channel(&self) -> Option<usize> {
        self.channel
    }

    fn with_memory(&self) -> Option<&Terms> {
        Some(&self.terms)
    }

    fn terms(&self, state: &SensorState<'_>, filter: &ThermalFilter) -> ([f64; 2], bool) {
        let ([_, bias], clamped) = self.terms.lines(state, filter);
        let scale_factor = self.scale_factor.at(state.thermal.temperature);
        ([bias, 1.0 / scale_factor.value], clamped || scale_factor.clamped)
    }
}

/// r (dimensionless) over the electronics board's temperature.
impl Follows<1> for AccelModel {
    #[expect(clippy::misnamed_getters, reason = "the channel that the board follows")]
    fn channel(&self) -> Option<usize> {
        self.board_channel
    }

    fn terms(&self, state: &SensorState<'_>, _: &ThermalFilter) -> ([f64; 1], bool) {
        let ratio = self.board_ratio.at(state.thermal.temperature);
        ([ratio.value], ratio.clamped)
    }
}
