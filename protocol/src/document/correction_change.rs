//! What differs between the corrections of two documents at one thermal state.

use isotherm_correction::calibration::{Calibration, Steady};
use isotherm_correction::channel::ThermalState;
use isotherm_correction::sample::{ChannelName, LasingMode};
use isotherm_correction::units::{Angle, AngularRate, SpecificForce};

use super::measure::ARCSEC;
use super::types::{Document, GyroOutput};
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
/// are matched by name; one that only one document has is left out: [`super::difference`] tells it. See [`Steady`] for
/// what the state leaves out.
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
    changes.gyros(before.document, after.document, &old, &new);
    changes.accels(before.document, after.document, &old, &new);
    let deg_per_h = |rate: f64| AngularRate::from_rad_per_s(rate).as_deg_per_h();
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

    fn gyros(&mut self, before: &Document, after: &Document, old: &Steady, new: &Steady) {
        let names = |document: &Document| -> Vec<String> {
            document.gyro.sensor.iter().map(|sensor| sensor.name.clone()).collect()
        };
        let same_output = before.gyro.output == after.gyro.output;
        for (name, i, j) in matched(&names(before), &names(after)) {
            let deg_per_h = |rate: f64| AngularRate::from_rad_per_s(rate).as_deg_per_h();
            if let Some((old, new)) = pair(&old.gyro_bias, &new.gyro_bias, i, j) {
                self.add(format!("gyro {name} bias"), "°/h", deg_per_h(old), deg_per_h(new));
            }
            if let Some((old, new)) = pair(&old.gyro_weight, &new.gyro_weight, i, j).filter(|_| same_output) {
                let (unit, size) = match after.gyro.output {
                    GyroOutput::Counts => ("″/count", ARCSEC),
                    GyroOutput::Mean => ("rad/rad", 1.0),
                };
                self.add(format!("gyro {name} increment weight"), unit, old / size, new / size);
            }
            if let Some((old, new)) = pair(&old.gyro_axes, &new.gyro_axes, i, j) {
                self.add(format!("gyro {name} input axis turns"), "″", 0.0, turned_arcsec(old, new));
            }
        }
    }

    fn accels(&mut self, before: &Document, after: &Document, old: &Steady, new: &Steady) {
        let (Some(first), Some(second)) = (&before.accel, &after.accel) else { return };
        let names = |sensors: &[super::AccelSensor]| -> Vec<String> {
            sensors.iter().map(|sensor| sensor.name.clone()).collect()
        };
        let unit = second.output.scale_unit().symbol();
        for (name, i, j) in matched(&names(&first.sensor), &names(&second.sensor)) {
            if let Some((old, new)) = pair(&old.accel_bias, &new.accel_bias, i, j) {
                self.add(format!("accelerometer {name} bias"), "mg", milli_g(old), milli_g(new));
            }
            let same_output = first.output == second.output;
            if let Some((old, new)) = pair(&old.accel_scale, &new.accel_scale, i, j).filter(|_| same_output) {
                self.add(format!("accelerometer {name} scale factor"), &unit, old, new);
            }
            if let Some((old, new)) = pair(&old.accel_axes, &new.accel_axes, i, j) {
                self.add(format!("accelerometer {name} input axis turns"), "″", 0.0, turned_arcsec(old, new));
            }
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
