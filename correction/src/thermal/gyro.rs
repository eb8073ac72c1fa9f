//! A gyro's terms (models §2): θ = K(T)·P − Ω·Δt with Ω a sum of named terms.

use alloc::boxed::Box;
use alloc::vec::Vec;
use core::array;

use arrayvec::ArrayVec;
use serde::{Deserialize, Serialize};

use super::bank::Follows;
use super::lag::{Lag, MAX_LAGS, settled};
use crate::calibration::{BranchArgument, GyroParts};
use crate::channel::{ThermalFilter, ThermalState};
use crate::curve::{Curve, CurveError};
use crate::lanes::Lanes;
use crate::sample::MAX_SENSORS;
use crate::servo::{Servo, ServoError};

/// A gyro, compiled.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct GyroModel {
    pub(crate) channel: Option<usize>,
    pub(crate) increment_weight: f64,
    pub(crate) increment_weight_error: Curve,
    pub(crate) input_limit: f64,
    pub(crate) static_bias: Curve,
    // What few gyros have, in room of its own.
    pub(crate) magnetic_bias: Option<Box<Curve>>,
    pub(crate) slow_meander: Option<Box<Curve>>,
    pub(crate) thermal_rate: Option<Box<Branched>>,
    pub(crate) thermal_acceleration: Option<Box<Branched>>,
    pub(crate) lags: Vec<Lag>,
    pub(crate) trend: Option<TrendModel>,
    pub(crate) servo: Option<Servo>,
}

/// What can be wrong with one term of a gyro.
pub(crate) enum TermError {
    Curve(CurveError),
    Servo(ServoError),
}

impl GyroModel {
    /// Compiles a gyro; `report` hears of every term that is wrong. Plain numbers are checked by the caller.
    pub(crate) fn new(
        parts: &GyroParts,
        filter: &ThermalFilter,
        report: &mut dyn FnMut(&'static str, TermError),
    ) -> Option<Self> {
        let mut sound = true;
        let mut curve = |field, parts: Option<&crate::curve::CurveParts>| match parts.map(Curve::new) {
            None => None,
            Some(Ok(curve)) => Some(curve),
            Some(Err(error)) => {
                sound = false;
                report(field, TermError::Curve(error));
                None
            }
        };
        let increment_weight_error = curve("increment_weight_error", parts.increment_weight_error.as_ref());
        let static_bias = curve("static_bias", parts.static_bias.as_ref());
        let magnetic_bias = curve("magnetic_bias", parts.magnetic_bias.as_ref());
        let slow_meander = curve("slow_meander", parts.slow_meander.as_ref());
        let mut branched = |run_up, braking, parts: Option<&crate::calibration::BranchedParts>| {
            let parts = parts?;
            let (run_up, braking) =
                (curve(run_up, Some(&parts.run_up)), curve(braking, Some(&parts.braking)));
            Some(Box::new(Branched { argument: parts.argument, run_up: run_up?, braking: braking? }))
        };
        let thermal_rate =
            branched("thermal_rate.run_up", "thermal_rate.braking", parts.thermal_rate.as_ref());
        let thermal_acceleration = branched(
            "thermal_acceleration.run_up",
            "thermal_acceleration.braking",
            parts.thermal_acceleration.as_ref(),
        );
        let mut lags = Vec::with_capacity(parts.lags.len());
        for lag in &parts.lags {
            lags.extend(
                curve("lags", Some(&lag.gain)).map(|gain| Lag::new(lag.time_constant_s, gain, filter)),
            );
        }
        let servo = match parts.servo.as_ref().map(Servo::new) {
            None => None,
            Some(Ok(servo)) => Some(servo),
            Some(Err(errors)) => {
                sound = false;
                for error in errors {
                    report("servo", TermError::Servo(error));
                }
                None
            }
        };
        sound.then(|| Self {
            channel: parts.channel,
            increment_weight: parts.increment_weight,
            increment_weight_error: increment_weight_error.unwrap_or_else(|| Curve::constant(0.0)),
            input_limit: parts.input_limit,
            static_bias: static_bias.unwrap_or_else(|| Curve::constant(0.0)),
            magnetic_bias: magnetic_bias.map(Box::new),
            slow_meander: slow_meander.map(Box::new),
            thermal_rate,
            thermal_acceleration,
            lags,
            trend: parts.trend.as_ref().map(|trend| TrendModel {
                coefficients: trend.coefficients.iter().copied().take(3).collect(),
                interval_s: trend.interval_s,
            }),
            servo,
        })
    }
}

impl GyroModel {
    /// The terms on a ramp that has lasted for long, so that every lag has settled on it.
    pub(crate) fn steady(&self, thermal: &ThermalState, filter: &ThermalFilter) -> GyroTerms {
        let lagged = settled(&self.lags, thermal, filter);
        let ([increment_weight, bias, magnetic, meander], _) = self.terms(thermal, &lagged, filter);
        GyroTerms { increment_weight, bias, magnetic, meander }
    }

    /// Every curve whose argument is temperature and which flags the gyro outside its fitted range.
    pub(crate) fn curves_over_temperature(&self) -> impl Iterator<Item = &Curve> {
        let branched = [&self.thermal_rate, &self.thermal_acceleration].into_iter().flatten();
        [&self.increment_weight_error, &self.static_bias]
            .into_iter()
            .chain(self.magnetic_bias.as_deref())
            .chain(self.slow_meander.as_deref())
            .chain(self.lags.iter().map(|lag| &lag.gain))
            .chain(
                branched
                    .filter(|branched| branched.argument == BranchArgument::Temperature)
                    .flat_map(|branched| [&branched.run_up, &branched.braking]),
            )
    }
}

/// A coefficient with one curve per thermal branch.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Branched {
    argument: BranchArgument,
    run_up: Curve,
    braking: Curve,
}

impl Branched {
    /// Coefficient at a thermal state, and whether its argument was clamped.
    ///
    /// The sign of Ṫ·T̈ chatters where either is near zero; over the dead band the two curves are blended with a
    /// weight that is continuous in the product, so that no branch change makes a step.
    fn at(&self, thermal: &ThermalState, derivative: f64, dead_band: f64) -> (f64, bool) {
        let argument = match self.argument {
            BranchArgument::Temperature => thermal.temperature,
            BranchArgument::Derivative => derivative,
        };
        let product = thermal.rate * thermal.acceleration;
        let weight = 0.5 + 0.5 * (product / dead_band).clamp(-1.0, 1.0);
        let (up, down) = (self.run_up.at(argument), self.braking.at(argument));
        let value = weight * up.value + (1.0 - weight) * down.value;
        (value, (up.clamped && weight > 0.0) || (down.clamped && weight < 1.0))
    }
}

/// Polynomial of the time since turn-on, held outside its interval.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TrendModel {
    coefficients: ArrayVec<f64, 3>,
    interval_s: [f64; 2],
}

impl TrendModel {
    /// Rate (rad/s) at a time since turn-on (s).
    #[must_use]
    pub fn at(&self, since_turn_on_s: f64) -> f64 {
        let [from, to] = self.interval_s;
        let t = since_turn_on_s.max(from).min(to);
        self.coefficients.iter().rev().fold(0.0, |sum, c| sum * t + c)
    }

    /// Rate (rad/s) from the end of the interval on.
    #[must_use]
    pub fn last(&self) -> f64 {
        self.at(self.interval_s[1])
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

    /// As [`TrendModel::at`] of each gyro; zero for one without a trend.
    pub(crate) fn at<const N: usize>(&self, since_turn_on_s: f64) -> [f64; N] {
        array::from_fn(|i| {
            let t = since_turn_on_s.max(self.from_s[i]).min(self.to_s[i]);
            self.coefficients.iter().rev().fold(0.0, |sum, c| sum * t + c[i])
        })
    }
}

/// Values of a gyro's thermal terms.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GyroTerms {
    /// K(T): angle per count (rad), or rad per rad.
    pub increment_weight: f64,
    /// Sum of the terms that no mode or meander changes (rad/s).
    pub bias: f64,
    /// Magnetic term for mode sign +1 (rad/s).
    pub magnetic: f64,
    /// Slow-meander term for phase +1 (rad/s).
    pub meander: f64,
}

impl Follows<4> for GyroModel {
    fn channel(&self) -> Option<usize> {
        self.channel
    }

    fn lags(&self) -> &[Lag] {
        &self.lags
    }

    /// In the order of [`GyroTerms`].
    fn terms(
        &self,
        thermal: &ThermalState,
        lagged: &[f64; MAX_LAGS],
        filter: &ThermalFilter,
    ) -> ([f64; 4], bool) {
        let mut clamped = false;
        let mut eval = |curve: &Curve| {
            let evaluated = curve.at(thermal.temperature);
            clamped |= evaluated.clamped;
            evaluated.value
        };
        let weight = self.increment_weight * (1.0 + eval(&self.increment_weight_error));
        let mut bias = eval(&self.static_bias);
        let magnetic = self.magnetic_bias.as_deref().map_or(0.0, &mut eval);
        let meander = self.slow_meander.as_deref().map_or(0.0, &mut eval);
        for (lag, lagged) in self.lags.iter().zip(lagged) {
            bias += eval(&lag.gain) * (thermal.temperature - lagged) * lag.per_second;
        }
        for (term, derivative) in
            [(&self.thermal_rate, thermal.rate), (&self.thermal_acceleration, thermal.acceleration)]
        {
            if let Some(branched) = term {
                let (coefficient, outside) = branched.at(thermal, derivative, filter.branch_dead_band);
                bias += coefficient * derivative;
                clamped |= outside;
            }
        }
        ([weight, bias, magnetic, meander], clamped)
    }
}
