//! Which terms a sensor has, and their place in the document.

use isotherm_correction::thermal::Feature;
use isotherm_protocol::document::{AccelSensor, Curve, GyroSensor, Shape, StatedTerm};

use super::columns::{Basis, Branch, Term, seconds};
use super::scale::{Holds, put};
use crate::document::written::tidy;
use crate::report::figures::per_deg_c;

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
    #[must_use]
    pub fn terms(&self, level: bool) -> Vec<Term> {
        let first = usize::from(!level);
        let scale = self.scale.into_iter().flat_map(|highest| (first..=highest).map(Term::Scale));
        let statics = (first..=self.degree).map(Term::Static);
        statics.chain(self.dynamics.terms.iter().copied()).chain(scale).collect()
    }

    /// In words.
    #[must_use]
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
#[must_use]
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
            (format!("lag of {} s, power {j}", seconds(tau)), format!("({output})/(°C/s){}", power(j)))
        }
    }
}

/// A curve from the coefficients of its powers; `None` without any.
fn curve(basis: &Basis, found: &[(usize, f64)]) -> Option<Curve> {
    let highest = found.iter().map(|(power, _)| *power).max()?;
    let mut coefficients = vec![0.0; highest + 1];
    for (power, value) in found {
        coefficients[*power] = tidy(*value);
    }
    let (reference, range) = (basis.reference_deg_c, basis.range_deg_c);
    Some(Curve::new(Shape::Polynomial { reference, coefficients, range }))
}

/// Coefficients of one kind of term, by power.
fn powers(found: &[(Term, f64)], of: impl Fn(Term) -> Option<usize>) -> Vec<(usize, f64)> {
    found.iter().filter_map(|(term, value)| Some((of(*term)?, *value))).collect()
}

/// Time constants of the lags, ascending.
fn taus(found: &[(Term, f64)]) -> Vec<u64> {
    let tau = |(term, _): &(Term, f64)| match term {
        Term::Lag(tau, _) => Some(*tau),
        _ => None,
    };
    let mut taus: Vec<u64> = found.iter().filter_map(tau).collect();
    taus.sort_unstable();
    taus.dedup();
    taus
}

fn of_lag(found: &[(Term, f64)], tau: u64) -> Vec<(usize, f64)> {
    powers(found, |term| match term {
        Term::Lag(this, power) if this == tau => Some(power),
        _ => None,
    })
}

fn lags(basis: &Basis, found: &[(Term, f64)]) -> impl Iterator<Item = StatedTerm> {
    taus(found).into_iter().filter_map(|tau| {
        let gain = curve(basis, &of_lag(found, tau))?;
        Some(StatedTerm::with_parameter(Feature::Lag, seconds(tau), gain))
    })
}

fn of_static(found: &[(Term, f64)]) -> Vec<(usize, f64)> {
    powers(found, |term| match term {
        Term::Static(power) => Some(power),
        _ => None,
    })
}

/// Coefficients of the scale factor error (ppm), by power from 0; `None` where the scale factor stays.
fn scale_error(found: &[(Term, f64)]) -> Option<Vec<f64>> {
    let powers = powers(found, |term| match term {
        Term::Scale(power) => Some(power),
        _ => None,
    });
    let highest = powers.iter().map(|(power, _)| *power).max()?;
    let mut coefficients = vec![0.0; highest + 1];
    for (power, value) in powers {
        coefficients[power] = value;
    }
    Some(coefficients)
}

/// Puts found coefficients (°/h and so on) into a gyro that has none of these terms; its scale factor keeps what it has, times the
/// error that was found.
pub fn put_gyro(sensor: &mut GyroSensor, basis: &Basis, found: &[(Term, f64)]) {
    sensor.set(Feature::One, curve(basis, &of_static(found)));
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
    if let Some(error) = scale_error(found) {
        let none = Curve::new(Shape::Constant { value: 0.0 });
        let old = sensor.terms.curve(Feature::Reading).unwrap_or(&none);
        let new = put(old, (basis.reference_deg_c, basis.range_deg_c), &error, Holds::Error);
        sensor.set(Feature::Reading, new);
    }
}

/// Run-up and braking.
fn branches(
    basis: &Basis,
    found: &[(Term, f64)],
    of: impl Fn(Term) -> Option<(Branch, usize)>,
) -> Option<[Curve; 2]> {
    let side = |side: Branch| {
        let found =
            powers(found, |term| of(term).filter(|(on, _)| *on == Branch::Both || *on == side).map(|x| x.1));
        curve(basis, &found)
    };
    match (side(Branch::RunUp), side(Branch::Braking)) {
        (None, None) => None,
        (up, down) => {
            let zero = || curve(basis, &[(0, 0.0)]);
            Some([up.or_else(zero)?, down.or_else(zero)?])
        }
    }
}

/// Puts found coefficients (output units and so on) into an accelerometer, which has a static bias and lags only; its scale factor
/// keeps what it has, times the error that was found.
pub fn put_accel(sensor: &mut AccelSensor, basis: &Basis, found: &[(Term, f64)]) {
    sensor.set(Feature::One, curve(basis, &of_static(found)));
    lags(basis, found).for_each(|lag| sensor.put(lag));
    if let Some(error) = scale_error(found) {
        sensor.scale_factor =
            put(&sensor.scale_factor, (basis.reference_deg_c, basis.range_deg_c), &error, Holds::Factor);
    }
}
