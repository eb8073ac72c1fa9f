//! Which terms a sensor has, and their place in the document.

use isotherm_protocol::document::{
    AccelLag, AccelSensor, Argument, Branches, Curve, GyroSensor, Lag, Quantity, Shape, Unit,
};

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
fn curve<Q: Quantity>(basis: &Basis, found: &[(usize, f64)]) -> Option<Curve<Q>> {
    let highest = found.iter().map(|(power, _)| *power).max()?;
    let mut coefficients = vec![0.0; highest + 1];
    for (power, value) in found {
        coefficients[*power] = tidy(*value);
    }
    let curve = Curve::new(Shape::Polynomial {
        reference: basis.reference_deg_c,
        coefficients,
        range: basis.range_deg_c,
    });
    Some(curve.over(Argument::DegC))
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
    sensor.static_bias = curve(
        basis,
        &powers(found, |term| match term {
            Term::Static(power) => Some(power),
            _ => None,
        }),
    );
    sensor.thermal_rate = branches(basis, found, |term| match term {
        Term::Rate(branch, power) => Some((branch, power)),
        _ => None,
    });
    sensor.thermal_acceleration = branches(basis, found, |term| match term {
        Term::Acceleration(branch, power) => Some((branch, power)),
        _ => None,
    });
    let lag =
        |tau: u64| Some(Lag { time_constant_s: seconds(tau), gain: curve(basis, &of_lag(found, tau))? });
    sensor.lag = taus(found).into_iter().filter_map(lag).collect();
    if let Some(error) = scale_error(found) {
        let old = sensor.increment_weight_error.take();
        let old = old.unwrap_or_else(|| Curve::new(Shape::Constant { value: 0.0 }));
        sensor.increment_weight_error =
            Some(put(&old, (basis.reference_deg_c, basis.range_deg_c), &error, Holds::Error));
    }
}

fn branches<Q: Quantity>(
    basis: &Basis,
    found: &[(Term, f64)],
    of: impl Fn(Term) -> Option<(Branch, usize)>,
) -> Option<Branches<Curve<Q>>> {
    let side = |side: Branch| {
        let found =
            powers(found, |term| of(term).filter(|(on, _)| *on == Branch::Both || *on == side).map(|x| x.1));
        curve(basis, &found)
    };
    match (side(Branch::RunUp), side(Branch::Braking)) {
        (None, None) => None,
        (up, down) => {
            let zero = || curve(basis, &[(0, 0.0)]);
            Some(Branches { run_up: up.or_else(zero)?, braking: down.or_else(zero)? })
        }
    }
}

/// Puts found coefficients (output units and so on) into an accelerometer, which has a static bias and lags only; its scale factor
/// keeps what it has, times the error that was found.
pub fn put_accel(sensor: &mut AccelSensor, basis: &Basis, found: &[(Term, f64)]) {
    let unit = output_unit(sensor.scale_factor.unit());
    let of_static = powers(found, |term| match term {
        Term::Static(power) => Some(power),
        _ => None,
    });
    sensor.bias = curve(basis, &of_static).map(|curve| curve.in_unit(unit));
    let lag = |tau: u64| {
        let gain = curve(basis, &of_lag(found, tau))?.in_unit(lag_unit(unit));
        Some(AccelLag { time_constant_s: seconds(tau), gain })
    };
    sensor.lag = taus(found).into_iter().filter_map(lag).collect();
    if let Some(error) = scale_error(found) {
        sensor.scale_factor =
            put(&sensor.scale_factor, (basis.reference_deg_c, basis.range_deg_c), &error, Holds::Factor);
    }
}

/// The output that a scale factor leads to.
#[must_use]
pub fn output_unit(scale_factor: Unit) -> Unit {
    match scale_factor {
        Unit::VPerMPerS2 => Unit::V,
        Unit::MPerS2PerMPerS2 => Unit::MPerS2,
        _ => Unit::CountsPerS,
    }
}

fn lag_unit(output: Unit) -> Unit {
    match output {
        Unit::V => Unit::VPerDegCPerS,
        Unit::MPerS2 => Unit::MPerS2PerDegCPerS,
        _ => Unit::CountsPerSPerDegCPerS,
    }
}
