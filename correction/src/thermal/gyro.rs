//! A gyro's terms (models §2): θ = K(T)·P − Ω·Δt with Ω a sum of named terms.

use arrayvec::ArrayVec;
use serde::{Deserialize, Serialize};

use alloc::boxed::Box;
use alloc::vec::Vec;

use super::lag::{Lag, advance, settled};
use super::ramp::{Follower, Ramp};
use crate::calibration::{BranchArgument, GyroParts};
use crate::channel::{ThermalFilter, ThermalState};
use crate::curve::{Curve, CurveError};
use crate::servo::{Servo, ServoError};
use crate::units::{Span, Timestamp};

pub use super::lag::MAX_LAGS;

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
        let ([increment_weight, bias, magnetic, meander], _) =
            evaluate(self, thermal, &lagged, filter.branch_dead_band);
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

    /// Coefficients by power, the highest last, and the interval (s).
    pub(crate) fn parts(&self) -> (&[f64], [f64; 2]) {
        (&self.coefficients, self.interval_s)
    }

    /// Rate (rad/s) from the end of the interval on.
    #[must_use]
    pub fn last(&self) -> f64 {
        self.at(self.interval_s[1])
    }
}

/// Values of a gyro's thermal terms, in the order of the ramp.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
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

/// Memory of one gyro's thermal terms.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct GyroThermal {
    /// Increment weight, bias, magnetic and slow-meander term, in the order of [`GyroTerms`].
    terms: Follower<4>,
    /// `L_τ[T]` of each lag (°C).
    lagged: [f64; MAX_LAGS],
}

impl GyroThermal {
    /// Starts with the terms as they are at the assumed temperature.
    #[must_use]
    pub fn new(model: &GyroModel, filter: &ThermalFilter) -> Self {
        let assumed = ThermalState { temperature: filter.assumed_deg_c, ..ThermalState::default() };
        let lagged = [filter.assumed_deg_c; MAX_LAGS];
        let (terms, clamped) = evaluate(model, &assumed, &lagged, filter.branch_dead_band);
        Self { terms: Follower::assumed(terms, clamped), lagged }
    }

    /// Goes on with the lags of an earlier calibration, where their time constants are the same.
    pub fn carry_lags(&mut self, model: &GyroModel, before: (&GyroModel, &Self)) {
        let (old_model, old) = before;
        let same = old_model.lags.iter().map(|lag| lag.decay).eq(model.lags.iter().map(|lag| lag.decay));
        if same {
            self.lagged = old.lagged;
        }
    }

    /// Starts the lags anew from a temperature that is taken to have stood for ever.
    pub fn restart(&mut self, temperature: f64) {
        self.lagged = [temperature; MAX_LAGS];
    }

    /// Arrives at once where the terms are heading, after a step of the producer's clock.
    pub fn settle(&mut self) {
        self.terms.settle();
    }

    /// Moves the lags on by one grid point.
    pub fn grid_point(&mut self, model: &GyroModel, thermal: &ThermalState) {
        advance(&model.lags, &mut self.lagged, thermal.temperature);
    }

    /// Evaluates every term and turns towards the result, `over` a sample interval from `start` on.
    pub fn update(
        &mut self,
        model: &GyroModel,
        thermal: &ThermalState,
        dead_band: f64,
        start: Timestamp,
        over: Span,
    ) {
        let (terms, clamped) = evaluate(model, thermal, &self.lagged, dead_band);
        self.terms.follow(terms, clamped, start, over);
    }

    /// The terms in use at `time`.
    #[must_use]
    pub fn at(&self, time: Timestamp) -> GyroTerms {
        let [increment_weight, bias, magnetic, meander] = self.terms.at(time);
        GyroTerms { increment_weight, bias, magnetic, meander }
    }

    /// The way that the terms are on, in the order of [`GyroTerms`].
    pub(crate) const fn ramp(&self) -> &Ramp<4> {
        self.terms.ramp()
    }

    /// Whether an argument was outside its fitted range at the last evaluation.
    #[must_use]
    pub fn clamped(&self) -> bool {
        self.terms.clamped()
    }
}

/// Every term at a thermal state, and whether an argument was clamped.
fn evaluate(
    model: &GyroModel,
    thermal: &ThermalState,
    lagged: &[f64; MAX_LAGS],
    dead_band: f64,
) -> ([f64; 4], bool) {
    let mut clamped = false;
    let mut eval = |curve: &Curve| {
        let evaluated = curve.at(thermal.temperature);
        clamped |= evaluated.clamped;
        evaluated.value
    };
    let weight = model.increment_weight * (1.0 + eval(&model.increment_weight_error));
    let mut bias = eval(&model.static_bias);
    let magnetic = model.magnetic_bias.as_deref().map_or(0.0, &mut eval);
    let meander = model.slow_meander.as_deref().map_or(0.0, &mut eval);
    for (lag, lagged) in model.lags.iter().zip(lagged) {
        bias += eval(&lag.gain) * (thermal.temperature - lagged) * lag.per_second;
    }
    for (term, derivative) in
        [(&model.thermal_rate, thermal.rate), (&model.thermal_acceleration, thermal.acceleration)]
    {
        if let Some(branched) = term {
            let (coefficient, outside) = branched.at(thermal, derivative, dead_band);
            bias += coefficient * derivative;
            clamped |= outside;
        }
    }
    ([weight, bias, magnetic, meander], clamped)
}
