//! What differs between the corrections of two documents at one thermal state.

use isotherm_correction::calibration::Calibration;
use isotherm_correction::channel::ThermalState;
use isotherm_correction::sample::{ChannelName, LasingMode};
use isotherm_correction::units::{Angle, AngularRate, SpecificForce};

use super::measure::ARCSEC;
use super::types::{Accel, Document, GyroOutput};
use crate::control::CorrectionChange;

/// Names of the case axes.
const AXES: [&str; 3] = ["x", "y", "z"];

/// A document with its calibration: one side of a comparison.
#[derive(Debug, Clone, Copy)]
pub struct Side<'a> {
    /// What stands in the document.
    pub document: &'a Document,
    /// What was made of it.
    pub calibration: &'a Calibration,
}

/// What the correction does under either document at the temperatures that `thermal` gives by the channel's name, and in
/// a lasing mode: only what differs.
///
/// Per sensor: bias (°/h, mg), weight (″/count or rad/rad) or scale factor with its board, and by how much the input axis
/// turns (″, `before` being zero). Then, in case axes, the rate and the specific force that the biases take away. Sensors
/// are matched by name; one that only one document has is left out: [`super::difference`] tells it. See
/// [`isotherm_correction::calibration::Steady`] for what the state leaves out.
#[must_use]
pub fn correction_change(
    before: Side<'_>,
    after: Side<'_>,
    thermal: impl Fn(&ChannelName) -> Option<ThermalState>,
    mode: Option<LasingMode>,
) -> Vec<CorrectionChange> {
    let old = before.calibration.steady(&thermal, mode);
    let new = after.calibration.steady(&thermal, mode);
    let mut changes = Changes(Vec::new());
    let (first, second) = (before.document, after.document);
    let same = first.gyro.output == second.gyro.output;
    let (weight, size) = match second.gyro.output {
        GyroOutput::Counts => ("″/count", ARCSEC),
        GyroOutput::Mean => ("rad/rad", 1.0),
    };
    let names = |document: &Document| -> Vec<String> {
        document.gyro.sensor.iter().map(|sensor| sensor.name.clone()).collect()
    };
    for (name, i, j) in matched(&names(first), &names(second)) {
        let sensor = format!("gyro {name}");
        changes.pair(&sensor, "bias", ("°/h", deg_per_h), pair(&old.gyro_bias, &new.gyro_bias, i, j));
        let weights = pair(&old.gyro_weight, &new.gyro_weight, i, j).filter(|_| same);
        changes.pair(&sensor, "increment weight", (weight, |weight| weight / size), weights);
        changes.turn(&sensor, pair(&old.gyro_axes, &new.gyro_axes, i, j));
    }
    if let (Some(first), Some(second)) = (&first.accel, &second.accel) {
        let same = first.output == second.output;
        let unit = second.output.scale_unit().symbol();
        let names = |accel: &Accel| -> Vec<String> {
            accel.sensor.iter().map(|sensor| sensor.name.clone()).collect()
        };
        for (name, i, j) in matched(&names(first), &names(second)) {
            let sensor = format!("accelerometer {name}");
            changes.pair(&sensor, "bias", ("mg", milli_g), pair(&old.accel_bias, &new.accel_bias, i, j));
            let scales = pair(&old.accel_scale, &new.accel_scale, i, j).filter(|_| same);
            changes.pair(&sensor, "scale factor", (&unit, |scale| scale), scales);
            changes.turn(&sensor, pair(&old.accel_axes, &new.accel_axes, i, j));
        }
    }
    for ((axis, old), new) in AXES.iter().zip(old.gyro_rate_in_case).zip(new.gyro_rate_in_case) {
        changes.add(format!("angular rate about {axis}"), "°/h", deg_per_h(old), deg_per_h(new));
    }
    for ((axis, old), new) in AXES.iter().zip(old.accel_force_in_case).zip(new.accel_force_in_case) {
        changes.add(format!("specific force along {axis}"), "mg", milli_g(old), milli_g(new));
    }
    changes.0
}

/// The changes found so far.
struct Changes(Vec<CorrectionChange>);

impl Changes {
    fn add(&mut self, quantity: String, unit: &str, before: f64, after: f64) {
        if before.to_bits() != after.to_bits() {
            self.0.push(CorrectionChange { quantity, unit: unit.to_owned(), before, after });
        }
    }

    fn pair(
        &mut self,
        sensor: &str,
        quantity: &str,
        (unit, stated): (&str, impl Fn(f64) -> f64),
        values: Option<(f64, f64)>,
    ) {
        if let Some((old, new)) = values {
            self.add(format!("{sensor} {quantity}"), unit, stated(old), stated(new));
        }
    }

    fn turn(&mut self, sensor: &str, axes: Option<([f64; 3], [f64; 3])>) {
        if let Some((old, new)) = axes {
            self.add(format!("{sensor} input axis turns"), "″", 0.0, turned_arcsec(old, new));
        }
    }
}

/// Names that both have, with the index in either, in the order of the second.
fn matched(before: &[String], after: &[String]) -> Vec<(String, usize, usize)> {
    let later = after.iter().enumerate();
    let both = later.filter_map(|(j, name)| Some((name.clone(), before.iter().position(|n| n == name)?, j)));
    both.collect()
}

fn pair<T: Copy>(before: &[T], after: &[T], i: usize, j: usize) -> Option<(T, T)> {
    Some((*before.get(i)?, *after.get(j)?))
}

/// °/h from rad/s.
fn deg_per_h(rate: f64) -> f64 {
    AngularRate::from_rad_per_s(rate).as_deg_per_h()
}

/// Thousandths of standard gravity from m/s².
fn milli_g(force: f64) -> f64 {
    SpecificForce::from_m_per_s2(force).as_g() * 1e3
}

/// Angle between two axes (″).
fn turned_arcsec(old: [f64; 3], new: [f64; 3]) -> f64 {
    let [old_x, old_y, old_z] = old;
    let [new_x, new_y, new_z] = new;
    let cross = [old_y * new_z - old_z * new_y, old_z * new_x - old_x * new_z, old_x * new_y - old_y * new_x];
    let sine = cross.iter().map(|x| x * x).sum::<f64>().sqrt();
    Angle::from_rad(sine.atan2(old_x * new_x + old_y * new_y + old_z * new_z)).as_arcsec()
}
