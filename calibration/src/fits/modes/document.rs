//! The constants on their way into a document.

use isotherm_correction::thermal::Feature;
use isotherm_protocol::document::{Curve, Document, GyroSensor, ModeReversal, Servo, ServoKind, Shape, Unit};
use serde_json::{Value, json};

use super::fit::{Made, ServoFit};
use super::model::{FITTED, GyroFit, MEANDER_REFERENCE_DEG_C, key};
use crate::document::{about, by_name, rows, tidy, turned};
use crate::numbers::unit;
use crate::report::{Sigmas, gyros as gyros_in_words};

/// Multiples of τ after which the servo's transient counts as settled: e⁻¹⁶ of it is left.
pub const SETTLED: f64 = 8.0;
/// `T_ref` where the document states none (°C).
const REFERENCE_DEG_C: f64 = 20.0;
/// Ranges are widened to the next tenth of a degree.
const PER_DEG_C: f64 = 10.0;

/// The base without the terms that are fitted, with the switch parameters.
pub fn bare(base: &Document, transition_ticks: u8, servos: &[Option<Servo>]) -> Document {
    let mut document = base.clone();
    let reversal = document.mode_reversal.take().unwrap_or_default();
    let (transition_ticks, transition_s) = (Some(transition_ticks), None);
    document.mode_reversal = Some(ModeReversal { transition_ticks, transition_s, ..reversal });
    for (sensor, servo) in document.gyro.sensor.iter_mut().zip(servos) {
        sensor.terms.retain(|feature| !FITTED.contains(&feature));
        if servo.is_some() {
            sensor.servo.clone_from(servo);
        }
    }
    document
}

/// The bare document with the servos as they were fitted: what the residuals "before" are taken with, so that switching
/// costs the same before and after.
pub fn stripped(
    without_terms: &Document,
    servos: &[Result<ServoFit, String>],
    base: &Document,
    reference_deg_c: f64,
) -> Document {
    let mut document = without_terms.clone();
    for ((sensor, found), old) in document.gyro.sensor.iter_mut().zip(servos).zip(&base.gyro.sensor) {
        sensor.servo = match found {
            Ok(found) => Some(servo(found, old, reference_deg_c)),
            Err(_) => old.servo.clone(),
        };
    }
    document
}

fn servo(found: &ServoFit, old: &GyroSensor, reference: f64) -> Servo {
    let coefficients = found.rest.coefficients.iter().map(|[value, _]| tidy(*value)).collect();
    let range = widened(found.rest.range_deg_c);
    Servo {
        form: old.servo.as_ref().map_or(ServoKind::Modelled, |servo| servo.form),
        time_constant_s: tidy(found.transient.time_constant_s),
        rest_frequency: Curve::new(Shape::Polynomial { reference, coefficients, range }).in_unit(Unit::HZ),
        settle_time_constants: old.servo.as_ref().map_or(SETTLED, |servo| servo.settle_time_constants),
    }
}

/// The document with everything that was found. Gyros without a fit keep what the base has.
pub fn fitted(base: &Document, made: &Made) -> Document {
    let mut document = made.before.document.clone();
    let sensors = document.gyro.sensor.iter_mut().zip(&base.gyro.sensor);
    for ((sensor, old), found) in sensors.zip(&made.gyros) {
        for term in FITTED {
            let meanders = term == Feature::Meander;
            let reference = if meanders { MEANDER_REFERENCE_DEG_C } else { made.reference_deg_c };
            let before = old.terms.curve(term);
            let constant = before.and_then(|before| before.shape().at(reference)).unwrap_or(0.0);
            let kept = (made.keeps_constants && term == Feature::One).then_some(constant);
            let found = found.as_ref().map(|found| curve(found, term, reference, kept));
            sensor.set(term, found.unwrap_or_else(|_| before.cloned()));
        }
    }
    document
}

/// A term as a curve, its constant as it was found or as it is given.
fn curve(found: &GyroFit, term: Feature, reference: f64, constant: Option<f64>) -> Option<Curve> {
    let mut coefficients: Vec<f64> = found.of(term).into_iter().map(tidy).collect();
    let range = widened(found.range_deg_c);
    if let (Some(first), Some(constant)) = (coefficients.first_mut(), constant) {
        *first = tidy(constant);
    }
    (!coefficients.is_empty()).then(|| Curve::new(Shape::Polynomial { reference, coefficients, range }))
}

/// A range in tenths of a degree, with some width.
pub(crate) fn widened([low, high]: [f64; 2]) -> [f64; 2] {
    let [low, high] = [libm::floor(low * PER_DEG_C) / PER_DEG_C, libm::ceil(high * PER_DEG_C) / PER_DEG_C];
    // A range must have a width.
    if high > low { [low, high] } else { [low - 1.0 / PER_DEG_C, high + 1.0 / PER_DEG_C] }
}

/// `T_ref` of the base's own biases, else 20 °C.
pub fn reference_of(base: &Document) -> f64 {
    let of = |sensor: &GyroSensor| {
        let curves = [Feature::One, Feature::LasingMode].map(|feature| sensor.terms.curve(feature));
        curves.into_iter().find_map(about)
    };
    base.gyro.sensor.iter().find_map(of).unwrap_or(REFERENCE_DEG_C)
}

/// That magnetic biases are those of the base with the other sign, in words.
pub(super) fn inverted(
    base: &Document,
    gyros: &[Result<GyroFit, String>],
    reference_deg_c: f64,
) -> Option<String> {
    /// Share of the old bias that may be left of the sum of both, and standard errors that it must be large.
    const ALIKE: f64 = 0.2;
    const SEEN: f64 = 10.0;
    let is_inverted = |(old, found): &(&GyroSensor, &Result<GyroFit, String>)| {
        let old = old.terms.curve(Feature::LasingMode).and_then(|curve| curve.shape().at(reference_deg_c));
        let now = found.as_ref().ok().and_then(|fit| fit.coefficient(Feature::LasingMode, 0));
        old.zip(now).is_some_and(|(old, [now, sigma])| {
            (now + old).abs() < ALIKE * old.abs() && old.abs() > SEEN * sigma
        })
    };
    let sensors = base.gyro.sensor.iter().zip(gyros).filter(is_inverted);
    let names: Vec<&str> = sensors.map(|(sensor, _)| sensor.name.as_str()).collect();
    (!names.is_empty()).then(|| {
        format!(
            "{}: the magnetic bias is that of the document with the other sign: is the log's mode column (+1 is \
             plus), or the sign of the gyro's column, the other way round? The document is valid only for modes \
             with the sign of this log",
            gyros_in_words(&names)
        )
    })
}

/// What one count of a gyro stands for (″); zero where the output is no count.
pub fn count_arcsec(document: &Document, sensor: usize) -> f64 {
    let sensor = document.gyro.sensor.get(sensor);
    sensor.and_then(|sensor| sensor.increment_weight_arcsec_per_count).map_or(0.0, f64::abs)
}

/// Input axis of a gyro at a temperature; at its reference where that is no number.
pub fn row(document: &Document, sensor: usize, deg_c: f64) -> [f64; 3] {
    let orientation = &document.gyro.orientation;
    let row = unit(orientation.rows.get(sensor).copied().unwrap_or_default());
    let turned = turned(orientation.thermal.as_ref(), sensor, deg_c);
    [0, 1, 2].map(|element| row[element] + turned[element])
}

/// Standard errors of the terms.
pub fn sigmas(made: &Made) -> Sigmas {
    let mut sigmas = Sigmas::default();
    for (sensor, found) in made.written.document.gyro.sensor.iter().zip(&made.gyros) {
        for term in FITTED {
            let own = found.iter().flat_map(|fit| &fit.coefficients).filter(|one| one.term == term);
            // Of a constant that was not fitted nothing is known.
            let is_kept = |power: usize| made.keeps_constants && term == Feature::One && power == 0;
            let of_term: Vec<f64> =
                own.map(|one| if is_kept(one.power) { 0.0 } else { tidy(one.sigma) }).collect();
            if !of_term.is_empty() {
                sigmas.put(("gyro", &sensor.name, key(term)), of_term);
            }
        }
    }
    sigmas
}

/// What the document says of the fit beside its coefficients.
pub fn details(made: &Made) -> Value {
    let gyros = made.gyros.iter().zip(&made.before.document.gyro.sensor);
    let known = gyros.filter_map(|(fit, sensor)| Some((sensor.name.as_str(), fit.as_ref().ok()?)));
    json!({
        "transition_ticks": made.transition_ticks,
        "reversal_period_s": tidy(made.switches.period_s()),
        "window_s": tidy(made.window_s),
        "covariance": by_name(known.map(|(name, fit)| (name, rows(&fit.covariance)))),
    })
}
