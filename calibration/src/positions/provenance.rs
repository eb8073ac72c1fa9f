//! Where the numbers of the document come from, and what "before" means.

use std::path::PathBuf;

use isotherm_protocol::document::{Document, Shape};
use serde_json::json;

use super::analysis::{Analysis, Settings};
use super::budget::ARCSEC_PER_RAD;
use super::model::SMALL;
use crate::error::Error;
use crate::provenance::{command_line, origin};
use crate::report::{FitReport, residuals};
use crate::written::tidy;

/// The document that "before" stands for: the one that was given, or else one scale factor for all accelerometers, no bias, axes
/// along the case.
#[must_use]
pub fn before(base: &Document, analysis: &Analysis, gravity: f64, given: bool) -> Document {
    let mut document = base.clone();
    let scales = analysis.fit.guess.iter().map(|guess| guess.scale / gravity);
    #[expect(clippy::cast_precision_loss, reason = "at most eight accelerometers")]
    let mean = scales.sum::<f64>() / analysis.fit.guess.len().max(1) as f64;
    if let Some(accel) = document.accel.as_mut().filter(|_| !given) {
        for (sensor, guess) in accel.sensor.iter_mut().zip(&analysis.fit.guess) {
            let unit = sensor.scale_factor.unit();
            // An accelerometer that is mounted the other way round is no error of its scale factor.
            let sign =
                if guess.axis.iter().copied().fold(0.0, |a: f64, c| if c.abs() > a.abs() { c } else { a })
                    < 0.0
                {
                    -1.0
                } else {
                    1.0
                };
            let shape = Shape::Constant { value: tidy(sign * mean) };
            sensor.scale_factor = isotherm_protocol::document::Curve::new(shape).in_unit(unit);
        }
    }
    document
}

/// States in the document where its numbers come from.
///
/// # Errors
/// [`Error::Log`] where a log cannot be read for its digest.
pub fn with_origin(
    document: &mut Document,
    analysis: &Analysis,
    settings: &Settings,
    report: &FitReport,
    logs: &[PathBuf],
    range: [f64; 2],
) -> Result<(), Error> {
    let mut origin = origin(logs, &command_line())?;
    let bent = analysis.quadratic.as_ref().is_some_and(|found| found.3 < 1e-3);
    origin.method = Some("positions of a stand, weighted least squares with the stand's errors".to_owned());
    origin.range_deg_c = Some(if analysis.levels_deg_c.len() > 1 { analysis.range_deg_c } else { range });
    origin.residual = residuals(&report.verdicts);
    let coefficients: serde_json::Map<String, serde_json::Value> = report
        .coefficients
        .iter()
        .map(|c| {
            (
                c.name.clone(),
                json!({ "value": c.value, "sigma": c.sigma.unwrap_or(f64::NAN), "unit": c.unit }),
            )
        })
        .filter(|(_, value)| value["sigma"].is_number() && value["value"].is_number())
        .collect();
    let fit = &analysis.fit;
    let covariance = fit.axes_covariance(&settings.plan, 0) * (ARCSEC_PER_RAD * ARCSEC_PER_RAD);
    let covariance: Vec<Vec<f64>> = covariance
        .row_iter()
        .map(|row| row.iter().map(|c| tidy(c * analysis.widened * analysis.widened)).collect())
        .collect();
    let old = document.origin.take().and_then(|old| old.details);
    let mut details = old.unwrap_or_default();
    let about = json!({
        "gravity_m_per_s2": settings.gravity,
        "positions": analysis.poses.len(),
        "temperatures_deg_c": analysis.levels_deg_c.iter().filter(|t| t.is_finite()).collect::<Vec<_>>(),
        "positioning_arcsec": settings.positioning_rad * ARCSEC_PER_RAD,
        "levelling_arcsec": settings.levelling_rad * ARCSEC_PER_RAD,
        "noise_output2_s": analysis.weights.intensity,
        "chi_square": fit.solution.chi_square,
        "degrees_of_freedom": fit.solution.degrees,
        "standard_errors_widened_by": analysis.widened,
        "quadratic_axes": bent,
        "verdict": report.headline(),
        "warnings": report.warnings,
        "coefficients": coefficients,
        // Two angles per accelerometer across its axis, at the reference.
        "axes_covariance_arcsec2": covariance,
        "relative_scale_sigma": scale_sigmas(analysis),
    });
    let about = toml::Value::try_from(about).map_err(|error| Error::Document(vec![error.to_string()]))?;
    details.insert("positions".to_owned(), about);
    origin.details = Some(details);
    document.origin = Some(origin);
    Ok(())
}

/// Standard errors of the scale factors (relative).
fn scale_sigmas(analysis: &Analysis) -> Vec<f64> {
    let solution = &analysis.fit.solution;
    let sensors = analysis.fit.guess.len();
    let of_sensor = solution.parameters.len().saturating_sub(3) / sensors.max(1);
    (0..sensors).map(|sensor| solution.sigma(sensor * of_sensor) * SMALL * analysis.widened).collect()
}
