//! What differs between the corrections of two documents at one thermal state.

use isotherm_correction::calibration::Steady;
use isotherm_correction::units::{Angle, AngularRate, SpecificForce};
use isotherm_correction::vector::{cross, dot};

use super::measure::ARCSEC;
use super::types::{Document, GyroOutput};
use crate::control::CorrectionChange;

/// A document with what its calibration does to the unit: one side of a comparison.
#[derive(Debug, Clone, Copy)]
pub struct Side<'a> {
    /// What stands in the document.
    pub document: &'a Document,
    /// What was made of it, at the temperatures and in the lasing mode of the unit.
    pub steady: &'a Steady,
}

/// What the correction does under either document: only what differs.
///
/// Per sensor: bias (°/h, mg), weight (″/count or rad/rad) or scale factor with its board, and by how much the input axis
/// turns (″, `before` being zero). Then, in case axes, the rate and the specific force that the biases take away. Sensors
/// are matched by name; one that only one document has is left out: [`super::difference`] tells it. See
/// [`isotherm_correction::calibration::Steady`] for what the state leaves out.
#[must_use]
pub fn correction_change(before: Side<'_>, after: Side<'_>) -> Vec<CorrectionChange> {
    let [old, new] = [before, after].map(|side| stated(side.document, side.steady));
    let mut changes = Vec::new();
    for (quantity, unit, now) in new {
        let Some((.., then)) = old.iter().find(|(of, in_unit, _)| *of == quantity && *in_unit == unit) else {
            continue;
        };
        let (before, after) = match (then, now) {
            (Value::Axis(old), Value::Axis(new)) => (0.0, Angle::from_rad(turn_rad(*old, new)).as_arcsec()),
            (Value::Number(old), Value::Number(new)) => (*old, new),
            _ => continue,
        };
        if before.to_bits() != after.to_bits() {
            changes.push(CorrectionChange { quantity, unit, before, after });
        }
    }
    changes
}

/// What a correction does, and in which unit.
type Quantity = (String, String, Value);

enum Value {
    Number(f64),
    Axis([f64; 3]),
}

/// What a document's correction does in a steady state, sensor by sensor and then in case axes.
fn stated(document: &Document, steady: &Steady) -> Vec<Quantity> {
    let number = |quantity, unit: &str, value| (quantity, unit.to_owned(), Value::Number(value));
    let turn = |sensor: &str, axis: &[f64; 3]| {
        (format!("{sensor} input axis turns"), "″".to_owned(), Value::Axis(*axis))
    };
    let (unit, size) = match document.gyro.output {
        GyroOutput::Counts => ("″/count", ARCSEC),
        GyroOutput::Mean => ("rad/rad", 1.0),
    };
    let mut all = Vec::new();
    let values = steady.gyro_bias.iter().zip(&steady.gyro_weight).zip(&steady.gyro_axes);
    for (sensor, ((bias, weight), axis)) in document.gyro.sensor.iter().zip(values) {
        let of = format!("gyro {}", sensor.name);
        all.push(number(format!("{of} bias"), "°/h", deg_per_h(*bias)));
        all.push(number(format!("{of} increment weight"), unit, weight / size));
        all.push(turn(&of, axis));
    }
    let values = steady.accel_bias.iter().zip(&steady.accel_scale).zip(&steady.accel_axes);
    let sensors =
        document.accel.iter().flat_map(|accel| accel.sensor.iter().map(|sensor| (accel.output, sensor)));
    for ((output, sensor), ((bias, scale), axis)) in sensors.zip(values) {
        let of = format!("accelerometer {}", sensor.name);
        all.push(number(format!("{of} bias"), "mg", milli_g(*bias)));
        all.push(number(format!("{of} scale factor"), &output.scale_unit().symbol(), *scale));
        all.push(turn(&of, axis));
    }
    let axes = || ["x", "y", "z"].into_iter();
    let rates = axes().zip(steady.gyro_rate_in_case);
    all.extend(
        rates.map(|(axis, rate)| number(format!("angular rate bias about {axis}"), "°/h", deg_per_h(rate))),
    );
    let forces = axes().zip(steady.accel_force_in_case);
    all.extend(
        forces.map(|(axis, force)| number(format!("specific force bias along {axis}"), "mg", milli_g(force))),
    );
    all
}

/// °/h from rad/s.
fn deg_per_h(rate: f64) -> f64 {
    AngularRate::from_rad_per_s(rate).as_deg_per_h()
}

/// Thousandths of standard gravity from m/s².
fn milli_g(force: f64) -> f64 {
    SpecificForce::from_m_per_s2(force).as_g() * 1e3
}

/// Angle between two axes (rad).
#[must_use]
pub fn turn_rad(old: [f64; 3], new: [f64; 3]) -> f64 {
    let across = cross(old, new);
    libm::atan2(dot(across, across).sqrt(), dot(old, new))
}
