//! Which terms a sensor has, and their place in the document.

use std::collections::BTreeSet;

use isotherm_correction::thermal::Feature;
use isotherm_protocol::document::{AccelSensor, Curve, GyroSensor, Shape, StatedTerm};

use super::columns::{Basis, Branch, Term, tau_s};
use super::scale::{Holds, put};
use crate::document::tidy;
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
        let scale = self.scale.into_iter().flat_map(|highest| (first..=highest).map(Term::Scale));
        let statics = (first..=self.degree).map(Term::Static);
        statics.chain(self.dynamics.terms.iter().copied()).chain(scale).collect()
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
pub fn described(term: Term, output: &str) -> (String, String) {
    let power = |j: usize| per_deg_c("", j);
    let branch = |branch: Branch| match branch {
        Branch::Both => "",
        Branch::RunUp => ", run-up",
        Branch::Braking => ", braking",
    };
    match term {
        Term::Static(j) => (format!("static bias, power {j}"), format!("{output}{}", power(j))),
        Term::Rate(on, j) => {
            (format!("thermal rate{}, power {j}", branch(on)), format!("({output})/(°C/s){}", power(j)))
        }
        Term::Acceleration(on, j) => (
            format!("thermal acceleration{}, power {j}", branch(on)),
            format!("({output})/(°C/s²){}", power(j)),
        ),
        Term::Scale(j) => (format!("scale factor error, power {j}"), format!("ppm{}", power(j))),
        Term::Lag(tau, j) => {
            (format!("lag of {} s, power {j}", tau_s(tau)), format!("({output})/(°C/s){}", power(j)))
        }
    }
}

/// Coefficients of one kind of term, by power from 0; `None` without any.
fn coefficients(found: &[(Term, f64)], of: impl Fn(Term) -> Option<usize>) -> Option<Vec<f64>> {
    let powers = || found.iter().filter_map(|(term, value)| Some((of(*term)?, *value)));
    let mut coefficients = vec![0.0; powers().map(|(power, _)| power).max()? + 1];
    powers().for_each(|(power, value)| coefficients[power] = value);
    Some(coefficients)
}

/// A curve from one kind of term; `None` without any.
fn curve(basis: &Basis, found: &[(Term, f64)], of: impl Fn(Term) -> Option<usize>) -> Option<Curve> {
    coefficients(found, of).map(|found| basis.curve(found.into_iter().map(tidy).collect()))
}

fn of_static(term: Term) -> Option<usize> {
    match term {
        Term::Static(power) => Some(power),
        _ => None,
    }
}

/// The lags, with ascending time constants.
fn lags(basis: &Basis, found: &[(Term, f64)]) -> impl Iterator<Item = StatedTerm> {
    let tau = |(term, _): &(Term, f64)| match term {
        Term::Lag(tau, _) => Some(*tau),
        _ => None,
    };
    let taus: BTreeSet<u64> = found.iter().filter_map(tau).collect();
    taus.into_iter().filter_map(|tau| {
        let gain = curve(basis, found, |term| match term {
            Term::Lag(this, power) if this == tau => Some(power),
            _ => None,
        })?;
        Some(StatedTerm::with_parameter(Feature::Lag, tau_s(tau), gain))
    })
}

/// A scale factor, or its error, times the error that was found; `None` where none was.
fn scaled(old: &Curve, basis: &Basis, found: &[(Term, f64)], holds: Holds) -> Option<Curve> {
    let error = coefficients(found, |term| match term {
        Term::Scale(power) => Some(power),
        _ => None,
    })?;
    Some(put(old, (basis.reference_deg_c, basis.range_deg_c), &error, holds))
}

/// Puts found coefficients (°/h and so on) into a gyro that has none of these terms; its scale factor keeps what it has, times the
/// error that was found.
pub fn put_gyro(sensor: &mut GyroSensor, basis: &Basis, found: &[(Term, f64)]) {
    sensor.set(Feature::One, curve(basis, found, of_static));
    let rate = branches(basis, found, |term| match term {
        Term::Rate(branch, power) => Some((branch, power)),
        _ => None,
    });
    let acceleration = branches(basis, found, |term| match term {
        Term::Acceleration(branch, power) => Some((branch, power)),
        _ => None,
    });
    for (feature, branches) in [(Feature::ThermalRate, rate), (Feature::ThermalAcceleration, acceleration)] {
        if let Some(curves) = branches {
            sensor.put(StatedTerm::branched(feature, curves));
        }
    }
    lags(basis, found).for_each(|lag| sensor.put(lag));
    let none = Curve::new(Shape::Constant { value: 0.0 });
    let old = sensor.terms.curve(Feature::Reading).unwrap_or(&none);
    if let Some(new) = scaled(old, basis, found, Holds::Error) {
        sensor.set(Feature::Reading, new);
    }
}

/// Run-up and braking.
fn branches(
    basis: &Basis,
    found: &[(Term, f64)],
    of: impl Fn(Term) -> Option<(Branch, usize)>,
) -> Option<[Curve; 2]> {
    let sides = [Branch::RunUp, Branch::Braking].map(|side| {
        curve(basis, found, |term| {
            of(term).filter(|(on, _)| *on == Branch::Both || *on == side).map(|(_, power)| power)
        })
    });
    let zero = || basis.curve(vec![0.0]);
    sides.iter().any(Option::is_some).then(|| sides.map(|side| side.unwrap_or_else(zero)))
}

/// Puts found coefficients (output units and so on) into an accelerometer, which has a static bias and lags only; its scale factor
/// keeps what it has, times the error that was found.
pub fn put_accel(sensor: &mut AccelSensor, basis: &Basis, found: &[(Term, f64)]) {
    sensor.set(Feature::One, curve(basis, found, of_static));
    lags(basis, found).for_each(|lag| sensor.put(lag));
    if let Some(new) = scaled(&sensor.scale_factor, basis, found, Holds::Factor) {
        sensor.scale_factor = new;
    }
}
