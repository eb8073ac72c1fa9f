//! Keys that go with one output only.

use isotherm_correction::thermal::{ACCEL_TERMS, Makes};
use isotherm_document::{Reader, join};

use super::super::curve::{Curve, Keys};
use super::super::measure::{Argument, Unit};
use super::super::terms::unit;
use super::super::types::{AccelOutput, AccelSensor, GyroOutput, GyroSensor};

/// Increment weight and input limit of each output, with its name.
const GYRO_OUTPUTS: [(GyroOutput, &str, [&str; 2]); 2] = [
    (GyroOutput::Counts, "counts", ["increment_weight_arcsec_per_count", "input_limit_counts_per_tick"]),
    (GyroOutput::Mean, "mean", ["increment_weight_rad_per_rad", "input_limit_deg_per_s"]),
];
/// Input limit of each output, with its name.
const ACCEL_OUTPUTS: [(AccelOutput, &str, &str); 3] = [
    (AccelOutput::Counts, "counts", "input_limit_counts_per_tick"),
    (AccelOutput::Volts, "V", "input_limit_v"),
    (AccelOutput::MetresPerSecondSquared, "m/s2", "input_limit_m_per_s2"),
];

/// A gyro has the keys of its output, and its increment weight.
pub(super) fn gyro(r: &mut Reader<'_>, path: &str, output: GyroOutput, sensor: &GyroSensor) {
    // Without a valid output any of them will do.
    if r.is_damaged("gyro.output") {
        return;
    }
    let [counts, mean] = GYRO_OUTPUTS;
    let ((_, name, keys), (_, other_name, others)) =
        if output == counts.0 { (counts, mean) } else { (mean, counts) };
    for (key, instead) in others.into_iter().zip(keys) {
        let path = join(path, key);
        if r.has(&path) {
            let message =
                format!("goes with output = {other_name:?}, but the output is {name:?}: give `{instead}`");
            r.refuse(&path, message);
        }
    }
    let weight = match output {
        GyroOutput::Counts => sensor.increment_weight_arcsec_per_count,
        GyroOutput::Mean => sensor.increment_weight_rad_per_rad,
    };
    let [key, _] = keys;
    if weight.is_none() {
        r.refuse(&join(path, key), format!("is missing: output = {name:?} needs it, add `{key}`"));
    }
}

/// An accelerometer has the input limit of its output, and curves in its units.
pub(super) fn accel(r: &mut Reader<'_>, path: &str, output: AccelOutput, sensor: &AccelSensor) {
    if r.is_damaged("accel.output") {
        // Nobody knows the units of these.
        let biases = ACCEL_TERMS.into_iter().filter(|term| term.makes == Makes::Bias).map(|term| term.key);
        for key in biases.chain(["scale_factor"]) {
            r.damage(&join(path, key));
        }
        return;
    }
    for (other, name, key) in ACCEL_OUTPUTS {
        let path = join(path, key);
        if other != output && r.has(&path) {
            r.refuse(&path, format!("goes with output = {name:?} only"));
        }
    }
    in_unit(r, &join(path, "scale_factor"), &sensor.scale_factor, output.scale_unit());
    for term in sensor.terms.keyed(path) {
        for (path, curve) in term.curves() {
            in_unit(r, &path, curve, unit(term.term, output.base_unit()));
        }
    }
}

/// A curve in the unit that the output calls for.
fn in_unit(r: &mut Reader<'_>, path: &str, curve: &Curve, unit: Unit) {
    if curve.unit() == unit {
        return;
    }
    let keys = Keys::new(curve.unit(), curve.argument().unwrap_or(Argument::DegC));
    let key = keys.of_values().map(|key| join(path, key)).into_iter().find(|key| r.has(key));
    let message = format!("is in {}, but the output needs {}", curve.unit().symbol(), unit.symbol());
    r.report(key.as_deref().unwrap_or(path), message);
    r.damage(path);
}
