//! A gyro's terms (models §2): θ = K(T)·P − Ω·Δt with Ω a sum of named terms.

use core::array;

use serde::{Deserialize, Serialize};

use super::bank::Follows;
use super::declared::GYRO_TERMS;
use super::terms::{SensorState, Terms};
use crate::calibration::{GyroParts, TrendParts};
use crate::channel::ThermalFilter;
use crate::defect::Checker;
use crate::lanes::Lanes;
use crate::sample::MAX_SENSORS;
use crate::servo::Servo;

/// A gyro, compiled.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct GyroModel {
    pub(crate) channel: Option<usize>,
    pub(crate) increment_weight: f64,
    pub(crate) input_limit: f64,
    pub(crate) terms: Terms,
    pub(crate) trend: Option<TrendParts>,
    pub(crate) servo: Option<Servo>,
}

impl GyroModel {
    /// Compiles a gyro and its `servo`. Plain numbers are checked by the caller.
    pub(crate) fn new(
        parts: &GyroParts,
        servo: Option<Servo>,
        filter: &ThermalFilter,
        checker: &mut Checker,
    ) -> Option<Self> {
        Some(Self {
            channel: parts.channel,
            increment_weight: parts.increment_weight,
            input_limit: parts.input_limit,
            terms: Terms::new(&GYRO_TERMS, &parts.terms, false, filter, checker)?,
            trend: parts.trend.clone(),
            servo,
        })
    }
}

/// The trends of all gyros, lane by lane.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Trends {
    /// By power.
    coefficients: [Lanes; 3],
    from_s: Lanes,
    to_s: Lanes,
}

impl Trends {
    /// Those of the gyros; `None` where none has one.
    pub(crate) fn of(models: &[GyroModel]) -> Option<Self> {
        let mut trends = Self {
            coefficients: [[0.0; MAX_SENSORS]; 3],
            from_s: [0.0; MAX_SENSORS],
            to_s: [0.0; MAX_SENSORS],
        };
        for (lane, model) in models.iter().enumerate() {
            let Some(trend) = &model.trend else { continue };
            for (power, coefficient) in trends.coefficients.iter_mut().zip(&trend.coefficients) {
                power[lane] = *coefficient;
            }
            [trends.from_s[lane], trends.to_s[lane]] = trend.interval_s;
        }
        models.iter().any(|model| model.trend.is_some()).then_some(trends)
    }

    /// Rate of each gyro (rad/s) at a time since turn-on (s); zero for one without a trend.
    pub(crate) fn at<const N: usize>(&self, since_turn_on_s: f64) -> [f64; N] {
        array::from_fn(|i| {
            let t = since_turn_on_s.max(self.from_s[i]).min(self.to_s[i]);
            self.coefficients.iter().rev().fold(0.0, |sum, c| sum * t + c[i])
        })
    }
}

impl Follows<4> for GyroModel {
    fn channel(&self) -> Option<usize> {
        self.channel
    }

    fn with_memory(&self) -> Option<&Terms> {
        Some(&self.terms)
    }

    /// K(T) (rad per count, or rad per rad); the sum of the terms that no mode or meander changes, the magnetic term for mode sign +1, the
    /// slow-meander term for phase +1 (rad/s).
    fn terms(&self, state: &SensorState<'_>, filter: &ThermalFilter) -> ([f64; 4], bool) {
        let ([error, bias, magnetic, meander], clamped) = self.terms.lines(state, filter);
        // A bias of −0 becomes 0, so that a tick need not add the zeros of terms that there are not.
        ([self.increment_weight * (1.0 + error), bias + 0.0, magnetic, meander], clamped)
    }
}
