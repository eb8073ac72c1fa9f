//! Which terms a sensor has, and their place in the document.

use std::collections::BTreeSet;

use isotherm_correction::thermal::Feature;
use isotherm_protocol::document::{AccelSensor, Curve, GyroSensor, Shape, StatedTerm};

use super::columns::{Basis, Branch, Effect, Term, tau_s};
use super::scale::{Holds, put};
use crate::document::tidy;
use crate::lsq::weighted::Solution;
use crate::report::per_deg_c;

/// The dynamic part of a model.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Dynamics {
    /// What it is called in tables.
    pub name: String,
    /// Its terms.
    pub terms: Vec<Term>,
}

/// The terms of one sensor.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Spec {
    /// Highest power of temperature in the static bias.
    pub degree: usize,
    /// What follows the change of temperature.
    pub dynamics: Dynamics,
    /// Highest power of temperature in the scale factor error; `None` where the scale factor stays.
    pub scale: Option<usize>,
    /// Weight of zero against the gains of what follows the change, as a share of each column's variance.
    pub shrink: f64,
}

impl Spec {
    /// All terms. The constant is one of them only where the level is known.
    pub fn terms(&self, level: bool) -> Vec<Term> {
        let first = usize::from(!level);
        let scale = self.scale.into_iter().flat_map(|highest| Effect::Scale.powers(first..=highest));
        let statics = Effect::Static.powers(first..=self.degree);
        statics.chain(self.dynamics.terms.iter().copied()).chain(scale).collect()
    }

    /// Its terms with the coefficients of a solution and their standard errors.
    pub fn found(&self, solution: &Solution, level: bool) -> Vec<(Term, f64, f64)> {
        let terms = self.terms(level).into_iter().zip(solution.coefficients.iter().zip(&solution.sigmas));
        terms.map(|(term, (value, sigma))| (term, *value, *sigma)).collect()
    }

    /// In words.
    pub fn words(&self) -> String {
        let of_degree = |degree: usize| match degree {
            0 => "constant".to_owned(),
            1 => "linear".to_owned(),
            2 => "quadratic".to_owned(),
            3 => "cubic".to_owned(),
            power => format!("degree {power}"),
        };
        let mut words = of_degree(self.degree);
        if !self.dynamics.terms.is_empty() {
            words = format!("{words} + {}", self.dynamics.name);
        }
        if let Some(degree) = self.scale {
            words = format!("{words}, scale factor error {}", of_degree(degree));
        }
        words
    }
}

/// Name and unit of a term's coefficient.
pub fn described(basis: &Basis, term: Term, output: &str) -> (String, String) {
    let branch = |branch: Branch| ["", ", run-up", ", braking"][branch as usize];
    let (name, unit) = match term.effect {
        Effect::Static => ("static bias".to_owned(), output.to_owned()),
        Effect::Rate(on) => (format!("thermal rate{}", branch(on)), format!("({output})/(°C/s)")),
        Effect::Acceleration(on) => {
            (format!("thermal acceleration{}", branch(on)), format!("({output})/(°C/s²)"))
        }
        Effect::Scale => ("scale factor error".to_owned(), "ppm".to_owned()),
        Effect::Lag(tau) => (format!("lag of {} s", tau_s(tau)), format!("({output})/(°C/s)")),
    };
    match basis.knots(term).get(term.power) {
        Some(knot) => (format!("{name}, at {knot:.3e}"), unit),
        None => (format!("{name}, power {}", term.power), per_deg_c(&unit, term.power)),
    }
}

/// Coefficients of some effects, by power from 0; `None` without any.
fn coefficients(found: &[(Term, f64)], of: &[Effect]) -> Option<Vec<f64>> {
    let mine = || found.iter().filter(|(term, _)| of.contains(&term.effect));
    let mut coefficients = vec![0.0; mine().map(|(term, _)| term.power).max()? + 1];
    mine().for_each(|(term, value)| coefficients[term.power] = *value);
    Some(coefficients)
}

/// A curve from some effects, all of them of one form; `None` without any.
fn curve(basis: &Basis, found: &[(Term, f64)], of: &[Effect]) -> Option<Curve> {
    let (first, _) = found.iter().find(|(term, _)| of.contains(&term.effect))?;
    Some(basis.curve(*first, coefficients(found, of)?.into_iter().map(tidy).collect()))
}

/// The lags, with ascending time constants.
fn lags(basis: &Basis, found: &[(Term, f64)]) -> impl Iterator<Item = StatedTerm> {
    let effects: BTreeSet<Effect> = found.iter().map(|(term, _)| term.effect).collect();
    effects.into_iter().filter_map(|effect| {
        let Effect::Lag(tau) = effect else { return None };
        Some(StatedTerm::with_parameter(Feature::Lag, tau_s(tau), curve(basis, found, &[effect])?))
    })
}

/// A scale factor, or its error, times the error that was found; `None` where none was.
fn scaled(old: &Curve, basis: &Basis, found: &[(Term, f64)], holds: Holds) -> Option<Curve> {
    let error = coefficients(found, &[Effect::Scale])?;
    Some(put(old, (basis.reference_deg_c, basis.range_deg_c), &error, holds))
}

/// The bias that was found. Where the runs could not tell its level, it has that of the bias before in the middle of the fitted range.
fn bias(basis: &Basis, found: &[(Term, f64)], old: Option<&Curve>) -> Option<Curve> {
    let new = curve(basis, found, &[Effect::Static]);
    let old = old.filter(|_| found.iter().all(|(term, _)| *term != Effect::Static.power(0)));
    let at = |[low, high]: [f64; 2]| basis.reference_deg_c.clamp(low, high);
    let level = old.and_then(|old| old.shape().at(old.range().map_or(basis.reference_deg_c, at)));
    let Some(value) = level else { return new };
    Some(new.map_or_else(|| Curve::new(Shape::Constant { value }), |new| new.plus(value)))
}

/// Puts found coefficients (°/h and so on) into a gyro that has none of these terms, in place of an `old` one; its scale factor keeps what
/// it has, times the error that was found.
pub fn put_gyro(sensor: &mut GyroSensor, basis: &Basis, found: &[(Term, f64)], old: Option<&GyroSensor>) {
    sensor.set(Feature::One, bias(basis, found, old.and_then(|old| old.terms.curve(Feature::One))));
    let mut put_branches = |feature, of: fn(Branch) -> Effect| {
        if let Some(curves) = branches(basis, found, of) {
            sensor.put(StatedTerm::branched(feature, curves));
        }
    };
    put_branches(Feature::ThermalRate, Effect::Rate);
    put_branches(Feature::ThermalAcceleration, Effect::Acceleration);
    lags(basis, found).for_each(|lag| sensor.put(lag));
    let none = Curve::new(Shape::Constant { value: 0.0 });
    let old = sensor.terms.curve(Feature::Reading).unwrap_or(&none);
    if let Some(new) = scaled(old, basis, found, Holds::Error) {
        sensor.set(Feature::Reading, new);
    }
}

/// Run-up and braking.
fn branches(basis: &Basis, found: &[(Term, f64)], of: fn(Branch) -> Effect) -> Option<[Curve; 2]> {
    let side = |side| curve(basis, found, &[of(Branch::Both), of(side)]);
    Some([side(Branch::RunUp)?, side(Branch::Braking)?])
}

/// Puts found coefficients (output units and so on) into an accelerometer, which has a static bias and lags only; its scale factor
/// keeps what it has, times the error that was found.
pub fn put_accel(sensor: &mut AccelSensor, basis: &Basis, found: &[(Term, f64)], old: Option<&AccelSensor>) {
    sensor.set(Feature::One, bias(basis, found, old.and_then(|old| old.terms.curve(Feature::One))));
    lags(basis, found).for_each(|lag| sensor.put(lag));
    if let Some(new) = scaled(&sensor.scale_factor, basis, found, Holds::Factor) {
        sensor.scale_factor = new;
    }
}
