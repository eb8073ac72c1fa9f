//! What one unit of each thermal term subtracts, taken from the state machine itself.
//!
//! A term is put into an otherwise bare document with the coefficient 1, and a log is corrected with it. The
//! difference from the bare correction is the term's column in the fit. Filter, grid, derivative step, delay of the
//! readings and the ramps between them are therefore those of the service.

use std::sync::Arc;

use isotherm_correction::thermal::Feature;
use isotherm_protocol::document::{Curve, Document, GyroSensor, Shape, StatedTerm};
use isotherm_simulator::{Scenario, Step};
use isotherm_tests::simulated::{Windows, run};

use crate::write::Failure;

/// Point about which powers of temperature are taken (°C).
pub(crate) const REFERENCE_DEG_C: f64 = 20.0;

/// A term with one coefficient.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Term {
    /// (T − reference)ʲ: °/h per °Cʲ.
    Static(usize),
    /// Lag of a time constant (s), its gain's (T − reference)ʲ: (°/h)/(°C/s) per °Cʲ.
    Lag(f64, usize),
}

impl Term {
    /// Adds the term to a gyro with a coefficient; terms of one curve share it.
    pub(crate) fn add(self, sensor: &mut GyroSensor, coefficient: f64, range: [f64; 2]) {
        match self {
            Self::Static(power) => {
                let more = with(sensor.terms.curve(Feature::One), power, coefficient, range);
                sensor.set(Feature::One, more);
            }
            Self::Lag(time_constant_s, power) => {
                let mut lags: Vec<StatedTerm> = sensor.terms.of(Feature::Lag).cloned().collect();
                let is_this = |lag: &StatedTerm| lag.parameter.total_cmp(&time_constant_s).is_eq();
                let place = lags.iter().position(is_this).unwrap_or(lags.len());
                let gain = with(lags.get(place).and_then(StatedTerm::curve), power, coefficient, range);
                let lag = StatedTerm::with_parameter(Feature::Lag, time_constant_s, gain);
                lags.splice(place..(place + 1).min(lags.len()), [lag]);
                sensor.terms.remove(Feature::Lag);
                for lag in lags {
                    sensor.put(lag);
                }
            }
        }
    }
}

/// A polynomial with one more coefficient.
fn with(before: Option<&Curve>, power: usize, coefficient: f64, range: [f64; 2]) -> Curve {
    let mut coefficients = match before.map(Curve::shape) {
        Some(Shape::Polynomial { coefficients, .. }) => coefficients.clone(),
        _ => Vec::new(),
    };
    if coefficients.len() <= power {
        coefficients.resize(power + 1, 0.0);
    }
    if let Some(place) = coefficients.get_mut(power) {
        *place = coefficient;
    }
    Curve::new(Shape::Polynomial { reference: REFERENCE_DEG_C, coefficients, range })
}

/// Mean rates of the gyros (°/h) under a document over windows, less what `known` says of each step (rad).
pub(crate) fn rates(
    document: &Document,
    scenario: &Scenario,
    averaging_s: f64,
    known: impl Fn(&Step) -> [f64; 3],
) -> Result<Windows, Failure> {
    let text = document.to_toml().map_err(|error| Failure::Serialise(error.to_string()))?;
    let parsed = Document::parse(&text, None).map_err(Failure::Refused)?;
    let mut windows = Windows::new(averaging_s);
    run(&Arc::new(parsed.calibration), scenario, |step, tick| {
        let known = known(step);
        let angle = [0, 1, 2].map(|axis| tick.delta_angle[axis] - known[axis]);
        windows.add(angle, tick.duration.as_s());
    })?;
    Ok(windows)
}

/// Columns of all terms: for each term the windows of the three gyros (°/h per unit of its coefficient).
pub(crate) fn columns(
    bare: &Document,
    scenario: &Scenario,
    averaging_s: f64,
    terms: &[Term],
    range: [f64; 2],
) -> Result<Vec<Windows>, Failure> {
    let without = rates(bare, scenario, averaging_s, |_| [0.0; 3])?;
    let column = |term: &Term| {
        let mut document = bare.clone();
        for sensor in &mut document.gyro.sensor {
            term.add(sensor, 1.0, range);
        }
        let mut with = rates(&document, scenario, averaging_s, |_| [0.0; 3])?;
        for (with, without) in with.means.iter_mut().zip(&without.means) {
            *with = [0, 1, 2].map(|axis| without[axis] - with[axis]);
        }
        Ok(with)
    };
    terms.iter().map(column).collect()
}
