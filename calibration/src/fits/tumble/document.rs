//! What was found of a tumbled unit, as a document.

use isotherm_correction::thermal::Feature;
use isotherm_correction::units::{AngularRate, STANDARD_GRAVITY_M_PER_S2};
use isotherm_protocol::document::{Accel, AccelOutput, Document};

use super::accel::AccelFit;
use super::acceleration::GyroDrift;
use super::fit::Tumble;
use super::fit::odd::odd;
use super::gyro::GyroFit;
use crate::document::{constant, tidy};
use crate::fits::positions::document::{held_twice, level};

/// Puts what was found into a document; gives what is to be said of it.
///
/// A tumble log has one temperature: curves over temperature keep their shape and go through what was found there.
///
/// # Errors
/// Where the accelerometers show a mirror image of the case: no document may hold that.
pub fn complete(document: &Document, tumble: &Tumble) -> Result<(Document, Vec<String>), Vec<String>> {
    let reasons = held_twice(document);
    if !reasons.is_empty() {
        return Err(reasons);
    }
    let base = document;
    let mut document = base.clone();
    let assumed = document.temperature.assumed_deg_c;
    let temperature = |channel: Option<&String>| {
        channel.and_then(|channel| tumble.mean_temperature(channel)).unwrap_or(assumed)
    };
    let mut warnings = odd(base, tumble, &temperature)?;
    if let Some(accel) = &mut document.accel {
        let scale_unit = accel.output.scale_unit();
        for (index, sensor) in accel.sensor.iter_mut().enumerate() {
            let deg_c = temperature(sensor.channel.as_ref());
            let AccelFit { scale, bias, .. } = &tumble.accel;
            level(sensor, scale[index], bias[index], deg_c, scale_unit);
        }
        accel.orientation.rows = tumble.accel.rows.iter().map(|row| row.map(tidy)).collect();
        if accel.orientation.thermal.take().is_some() {
            warnings.push(
                "the old slopes of the accelerometers' axes are removed, because the case axes are new"
                    .to_owned(),
            );
        }
    }
    if let Ok(gyro) = &tumble.gyro {
        gyros(&mut document, gyro, &tumble.acceleration, &temperature);
    }
    Ok((document, warnings))
}

/// Puts the gyros into the document.
fn gyros(
    document: &mut Document,
    found: &GyroFit,
    acceleration: &[Result<GyroDrift, String>; 3],
    temperature: &dyn Fn(Option<&String>) -> f64,
) {
    for (index, sensor) in document.gyro.sensor.iter_mut().enumerate() {
        let deg_c = temperature(sensor.channel.as_ref());
        let error = sensor.terms.curve(Feature::Reading).and_then(|curve| curve.shape().at(deg_c));
        let weight = found.weight[index];
        sensor.increment_weight_rad_per_rad = Some(tidy(weight / (1.0 + error.unwrap_or(0.0) * 1e-6)));
        let deg_per_h = |of_log: f64| AngularRate::from_rad_per_s(weight * of_log).as_deg_per_h();
        let drift = acceleration[index].as_ref().ok();
        let rest = deg_per_h(drift.map_or(found.rest[index], |drift| drift.response.bias));
        if let Some(drift) = drift {
            let axes = [Feature::ForceX, Feature::ForceY, Feature::ForceZ];
            for (feature, per_force) in axes.into_iter().zip(drift.response.by_force) {
                sensor.set(feature, constant(deg_per_h(per_force * STANDARD_GRAVITY_M_PER_S2)));
            }
        }
        let there = sensor.terms.curve(Feature::One);
        let moved = there.and_then(|curve| Some(curve.plus(tidy(rest - curve.shape().at(deg_c)?))));
        sensor.set(Feature::One, moved.unwrap_or_else(|| constant(rest)));
    }
    document.gyro.orientation.rows = found.rows.iter().map(|row| row.map(tidy)).collect();
    document.gyro.orientation.thermal = None;
}

/// The document that "before" stands for, and what that is in words: the one that was given; readings in m/s² as they are; or else one
/// scale factor and one zero for all accelerometers, for readings in V or counts alone are no specific force.
pub fn before(base: &Document, tumble: &Tumble, given: bool) -> (Document, &'static str) {
    let mut document = base.clone();
    let mean = |values: [f64; 3]| constant(values.iter().sum::<f64>() / 3.0);
    let raw = |accel: &&mut Accel| accel.output == AccelOutput::MetresPerSecondSquared;
    let words = if given {
        "Before is the given document."
    } else if document.accel.as_mut().is_some_and(|accel| raw(&accel)) {
        "Before is raw: the accelerometers' readings unchanged, and the gyros' less their mean over all poses."
    } else {
        "Before is one scale factor and one zero for all accelerometers, the means of the fitted ones, and the \
         gyros' readings less their mean over all poses."
    };
    if let Some(accel) = document.accel.as_mut().filter(|accel| !given && !raw(accel)) {
        let scale_unit = accel.output.scale_unit();
        for sensor in &mut accel.sensor {
            sensor.scale_factor = mean(tumble.accel.scale).in_unit(scale_unit);
            sensor.set(Feature::One, mean(tumble.accel.bias));
        }
    }
    if let (Ok(gyro), false) = (&tumble.gyro, given) {
        // Without the mean at rest the gyros would be judged by their bias, which nobody leaves in.
        for (sensor, rest) in document.gyro.sensor.iter_mut().zip(gyro.rest) {
            sensor.set(Feature::One, constant(AngularRate::from_rad_per_s(rest).as_deg_per_h()));
        }
    }
    (document, words)
}
