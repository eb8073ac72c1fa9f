//! Scale and axes on their way into a document.

use isotherm_correction::thermal::Feature;
use isotherm_correction::units::Angle;
use isotherm_protocol::document::Document;
use serde_json::{Value, json};

use super::fit::Made;
use super::model::GyroRates;
use crate::document::{by_name, constant, reweigh, rows, tidy, turned, weight};
use crate::finding::Kind;
use crate::numbers::unit;
use crate::report::Sigmas;

/// The document with new weights and, where the steps span space, new input axes. What is fitted at `deg_c` of the axes'
/// temperature is brought to their reference.
pub fn fitted(
    base: &Document,
    gyros: &[Result<GyroRates, Kind>],
    deg_c: Option<f64>,
    with_bias: bool,
) -> Document {
    let mut document = base.clone();
    let thermal = document.gyro.orientation.thermal.clone();
    for (sensor, found) in gyros.iter().enumerate() {
        let Ok(found) = found else { continue };
        let gain = found.gain[0];
        if let Some(own) = document.gyro.sensor.get_mut(sensor) {
            if let Some(old) = weight(own) {
                reweigh(own, tidy(old / gain));
            }
            if let Some([change, _]) = found.weight_asymmetry_ppm() {
                let old = own.terms.curve(Feature::RateMagnitude).map(|asymmetry| asymmetry.plus(change));
                own.set(Feature::RateMagnitude, old.unwrap_or_else(|| constant(change)));
            }
            if with_bias {
                let change = found.bias[0];
                let bias = own.terms.curve(Feature::One).map(|bias| bias.plus(change));
                own.set(Feature::One, bias.unwrap_or_else(|| constant(change)));
            }
        }
        if let (Some(axis), Some(row)) = (found.axis, document.gyro.orientation.rows.get_mut(sensor)) {
            let turned = turned(thermal.as_ref(), sensor, deg_c.unwrap_or(f64::NAN));
            let at_reference = [0, 1, 2].map(|element| axis[element] - turned[element]);
            *row = unit(at_reference).map(tidy);
        }
    }
    document
}

/// Standard errors of weights and axes.
pub fn sigmas(made: &Made) -> Sigmas {
    let mut sigmas = Sigmas::default();
    for (sensor, found) in made.written.document.gyro.sensor.iter().zip(&made.gyros) {
        let Ok(found) = found else { continue };
        let ppm = tidy(1e6 * found.gain[1] / found.gain[0].abs());
        sigmas.put(("gyro", &sensor.name, "increment_weight_ppm"), vec![ppm]);
        if let Some([_, sigma]) = found.weight_asymmetry_ppm() {
            sigmas.put(("gyro", &sensor.name, "increment_weight_asymmetry"), vec![tidy(sigma)]);
        }
        if found.axis.is_some() {
            let arcsec = found.axis_sigma.map(|sigma| tidy(Angle::from_rad(sigma).as_arcsec()));
            sigmas.put(("gyro", &sensor.name, "axis_arcsec"), arcsec.to_vec());
        }
    }
    sigmas
}

/// What the document says of the fit beside its coefficients.
pub fn details(made: &Made) -> Value {
    let gyros = || {
        let gyros = made.gyros.iter().zip(&made.written.document.gyro.sensor);
        gyros.filter_map(|(found, sensor)| Some((sensor.name.as_str(), found.as_ref().ok()?)))
    };
    let left = |found: &GyroRates| found.left.iter().map(|left| tidy(*left)).collect();
    let mut details = json!({
        "rate_deg_per_s": made.steps.iter().map(|one| one.step.rate_deg_per_s).collect::<Vec<_>>(),
        "nonlinearity_deg_per_h": by_name(gyros().map(|(name, found)| (name, left(found)))),
        "covariance": by_name(gyros().map(|(name, found)| (name, rows(&found.covariance)))),
    });
    if let Some(deg_c) = made.temperature_deg_c() {
        details["temperature_deg_c"] = tidy(deg_c).into();
    }
    details
}
