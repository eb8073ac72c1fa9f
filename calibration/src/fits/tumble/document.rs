//! What was found of a tumbled unit, as a document.

use isotherm_correction::thermal::{Feature, GYRO_TERMS};
use isotherm_correction::units::{AngularRate, STANDARD_GRAVITY_M_PER_S2};
use isotherm_protocol::document::{Accel, AccelOutput, Document, GyroSensor};

use super::accel::AccelFit;
use super::acceleration::{AtRest, mean_over};
use super::fit::odd::odd;
use super::fit::{Tumble, faults};
use super::gyro::GyroFit;
use crate::axes::AXES;
use crate::document::{Written, board_ratio_at, constant, reweigh, tidy};
use crate::error::Error;
use crate::fits::positions::document::{held_twice, level};
use crate::fits::positions::track::Track;
use crate::fits::thermal::bare::along_axes;
use crate::numbers::{about_mean, dot};
use crate::report::is_worse;
use crate::runs::Run;

/// Drift with acceleration along each case axis.
const FORCES: [Feature; 3] = [Feature::ForceX, Feature::ForceY, Feature::ForceZ];

/// The ticks of a run by a document; its gyros read what the terms leave of their readings that the fit does not replace, and that stay
/// in the document: what these hold is not found once more.
///
/// # Errors
/// As [`Track::of`]; [`Error::Refused`] where sensors are dead.
pub fn track(run: &Run, document: &Written) -> Result<Track, Error> {
    let mut track = Track::of(run, &document.loaded)?;
    let mut others = along_axes(&document.document, 0);
    let replaced =
        |feature: Feature| feature.is_force() || matches!(feature, Feature::One | Feature::Reading);
    others.gyro.sensor.iter_mut().for_each(|gyro| gyro.terms.retain(|feature| !replaced(feature)));
    let has_more = |gyro: &GyroSensor| {
        let beside = gyro.trend.is_some() || gyro.increment_weight_over_rate.is_some();
        beside || GYRO_TERMS.iter().any(|term| gyro.terms.has(term.feature))
    };
    if others.gyro.sensor.iter().any(has_more) {
        // By the readings themselves: a dead gyro has terms all the same.
        faults(&track).map_err(Error::Refused)?;
        let left = Track::of(run, &Written::of(&others)?.loaded)?.rate_deg_per_s;
        for ((readings, left), gyro) in track.gyros.iter_mut().zip(left).zip(&others.gyro.sensor) {
            let weight = gyro.increment_weight_rad_per_rad.unwrap_or(1.0);
            let good = readings.iter_mut().zip(left).filter(|(reading, _)| reading.is_finite());
            good.for_each(|(reading, left)| *reading = left.to_radians() / weight);
        }
    }
    Ok(track)
}

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
    let temperature = |channel: Option<&String>| tumble.deg_c(base, channel);
    let mut warnings = odd(base, tumble, &temperature)?;
    if let Some(accel) = &mut document.accel {
        let scale_unit = accel.output.scale_unit();
        for (index, sensor) in accel.sensor.iter_mut().enumerate() {
            let deg_c = temperature(sensor.channel.as_ref());
            let AccelFit { scale, bias, .. } = &tumble.accel;
            let ratio = board_ratio_at(sensor, temperature(sensor.board_channel.as_ref()));
            level(sensor, scale[index] * ratio, bias[index], deg_c, scale_unit);
        }
        accel.orientation.rows = tumble.accel.rows.iter().map(|row| row.map(tidy)).collect();
        if accel.orientation.thermal.take().is_some() {
            warnings.push(slopes_removed("accelerometers"));
        }
    }
    if let Ok(gyro) = &tumble.gyro {
        warnings.extend(gyros(&mut document, gyro, tumble, &temperature));
    }
    Ok((document, warnings))
}

fn slopes_removed(kind: &str) -> String {
    format!("the old slopes of the {kind}' axes are removed, because the case axes are new")
}

/// Puts the gyros into the document; gives what is to be said of it.
fn gyros(
    document: &mut Document,
    found: &GyroFit,
    tumble: &Tumble,
    temperature: &dyn Fn(Option<&String>) -> f64,
) -> Vec<String> {
    let mut warnings = Vec::new();
    for (index, sensor) in document.gyro.sensor.iter_mut().enumerate() {
        let deg_c = temperature(sensor.channel.as_ref());
        let error = sensor.terms.curve(Feature::Reading).and_then(|curve| curve.shape().at(deg_c));
        let weight = found.weight[index];
        // What stays of its terms holds with the old weight: it goes with the new one.
        reweigh(sensor, tidy(weight / (1.0 + error.unwrap_or(0.0) * 1e-6)));
        let deg_per_h = |of_log: f64| AngularRate::from_rad_per_s(weight * of_log).as_deg_per_h();
        let at_rest = &tumble.at_rest[index];
        let rest = if let Ok(drift) = &at_rest.drift {
            for (feature, per_force) in FORCES.into_iter().zip(drift.response.by_force) {
                sensor.set(feature, constant(deg_per_h(per_force * STANDARD_GRAVITY_M_PER_S2)));
            }
            drift.response.bias
        } else {
            let mut left = beside_drift(sensor, weight, deg_c, (tumble, at_rest));
            if is_worse(&about_mean(&at_rest.readings), &about_mean(&left)) {
                warnings.push(format!(
                    "gyro {}: its old acceleration_sensitive_drift is removed, because the poses contradict it",
                    AXES[index]
                ));
                sensor.terms.retain(|feature| !feature.is_force());
                left.clone_from(&at_rest.readings);
            }
            mean_over(&tumble.poses, |pose| left[pose])
        };
        let rest = deg_per_h(rest);
        let there = sensor.terms.curve(Feature::One);
        let moved = there.and_then(|curve| Some(curve.plus(tidy(rest - curve.shape().at(deg_c)?))));
        sensor.set(Feature::One, moved.unwrap_or_else(|| constant(rest)));
    }
    document.gyro.orientation.rows = found.rows.iter().map(|row| row.map(tidy)).collect();
    if document.gyro.orientation.thermal.take().is_some() {
        warnings.push(slopes_removed("gyros"));
    }
    warnings
}

/// Readings at rest (rad/s of the log) less the drift with acceleration that a document states of a gyro.
fn beside_drift(
    sensor: &GyroSensor,
    weight: f64,
    deg_c: f64,
    (tumble, at_rest): (&Tumble, &AtRest),
) -> Vec<f64> {
    let per_g =
        FORCES.map(|axis| sensor.terms.curve(axis).and_then(|curve| curve.shape().at(deg_c)).unwrap_or(0.0));
    let left = |(reading, force): (&f64, [f64; 3])| {
        let drift = AngularRate::from_deg_per_h(dot(per_g, force) / STANDARD_GRAVITY_M_PER_S2);
        reading - drift.as_rad_per_s() / weight
    };
    at_rest.readings.iter().zip(tumble.force()).map(left).collect()
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
