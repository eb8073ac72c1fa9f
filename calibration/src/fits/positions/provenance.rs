//! Where the numbers of the document come from, and what "before" means.

use isotherm_protocol::document::Document;
use serde_json::{Value, json};

use super::fit::{Analysis, Settings};
use super::hysteresis::Return;
use super::model::SMALL;
use crate::axes::main_axis;
use crate::document::{constant, rows, tidy};
use crate::numbers::{ARCSEC_PER_RAD, real};
use crate::report::Sigmas;

/// The document that "before" stands for: the one that was given, or else one scale factor for all accelerometers, no bias, axes
/// along the case.
pub fn before(base: &Document, analysis: &Analysis, gravity: f64, given: bool) -> Document {
    let mut document = base.clone();
    let scales = analysis.fit.guess.iter().map(|guess| guess.scale / gravity);
    let mean = scales.sum::<f64>() / real(analysis.fit.guess.len().max(1));
    if let Some(accel) = document.accel.as_mut().filter(|_| !given) {
        for (sensor, guess) in accel.sensor.iter_mut().zip(&analysis.fit.guess) {
            let unit = sensor.scale_factor.unit();
            // An accelerometer that is mounted the other way round is no error of its scale factor.
            let sign = guess.axis[main_axis(&guess.axis)].signum();
            sensor.scale_factor = constant(sign * mean).in_unit(unit);
        }
    }
    document
}

/// What the document says of the fit beside its coefficients.
pub fn details(analysis: &Analysis, settings: &Settings) -> Value {
    let fit = &analysis.fit;
    let widened = ARCSEC_PER_RAD * analysis.widened;
    let mut about = json!({
        "gravity_m_per_s2": settings.gravity,
        "positions": analysis.poses.len(),
        "temperatures_deg_c": analysis.levels_deg_c.iter().filter(|t| t.is_finite()).collect::<Vec<_>>(),
        "positioning_arcsec": settings.positioning_rad * ARCSEC_PER_RAD,
        "levelling_arcsec": settings.levelling_rad * ARCSEC_PER_RAD,
        "noise_output2_s": analysis.weights.intensity,
        "chi_square": fit.solution.chi_square,
        "degrees_of_freedom": fit.solution.degrees,
        "standard_errors_widened_by": analysis.widened,
        // Two angles per accelerometer across its axis, at the reference.
        "axes_covariance_arcsec2": rows(&(fit.axes_covariance(0) * (widened * widened))),
    });
    if !analysis.returns.is_empty() {
        about["hysteresis"] = analysis.returns.iter().map(hysteresis).collect();
    }
    about
}

/// Turns of the axes (″) over a thermal cycle, with their standard errors.
fn hysteresis(back: &Return) -> Value {
    let [turn, sigma] = [0, 1].map(|i| back.turns.iter().map(|turn| tidy(turn[i])).collect::<Vec<f64>>());
    json!({ "temperature_deg_c": tidy(back.deg_c), "turn_arcsec": turn, "sigma_arcsec": sigma, "accident": tidy(back.accident) })
}

/// Standard errors of scale factors, biases and axes, for what compares documents.
pub fn sigmas(document: &Document, analysis: &Analysis, settings: &Settings) -> Sigmas {
    let mut sigmas = Sigmas::default();
    let Some(accel) = &document.accel else { return sigmas };
    let fit = &analysis.fit;
    let of_sensor = fit.degrees.of_sensor();
    let own = fit.degrees.sensor + 1;
    for (index, (sensor, guess)) in accel.sensor.iter().zip(&fit.guess).enumerate() {
        let of = |from: usize, scale: f64| -> Vec<f64> {
            let mut factor = SMALL * guess.scale * scale * analysis.widened;
            let sigma = |place| {
                let sigma = tidy(fit.solution.sigma(index * of_sensor + place) * factor);
                factor /= analysis.half_deg_c;
                sigma
            };
            (from..from + own).map(sigma).collect()
        };
        sigmas.put(("accel", &sensor.name, "scale_factor"), of(0, 1.0 / settings.gravity));
        sigmas.put(("accel", &sensor.name, "bias"), of(own, 1.0));
        let axis = fit.axis_sigma(index, 0);
        let arcsec = axis.map(|sigma| tidy(sigma * ARCSEC_PER_RAD * analysis.widened));
        sigmas.put(("accel", &sensor.name, "axis_arcsec"), arcsec.to_vec());
    }
    sigmas
}
