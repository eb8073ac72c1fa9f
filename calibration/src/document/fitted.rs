//! What comes of a fit, and what its document says of it.

use std::path::PathBuf;

use isotherm_protocol::document::{Created, Document};
use nalgebra::DMatrix;
use serde_json::{Map, Value, json};

use super::merge::sections::{of_sigma, sections};
use super::merge::weights::stated;
use super::provenance::{BASE, MOST_LOGS, base_of};
use super::show::terms::tree;
use super::{Written, command_line, origin, tidy};
use crate::error::Error;
use crate::report::{Report, Sigmas, residuals};

/// Key in `origin.details`: what a document rests on that a fit started from, and that one on another.
const BEFORE: &str = "before";

/// What comes of a fit.
#[derive(Debug)]
pub struct Fitted {
    /// The document without what is to be said of its origin.
    pub written: Written,
    /// What is said of the fit.
    pub report: Report,
    /// What the document says of it beside its coefficients.
    pub about: About,
}

/// What a document says of a fit beside its coefficients.
#[derive(Debug, Default)]
pub struct About {
    /// Method.
    pub method: &'static str,
    /// Name of its table in `origin.details`.
    pub key: &'static str,
    /// What that table has besides verdict, warnings, notes and coefficients with their standard errors: an object.
    pub details: Value,
    /// Standard errors, as what compares documents reads them.
    pub sigmas: Sigmas,
    /// Range of temperature (°C).
    pub range_deg_c: Option<[f64; 2]>,
    /// Range of its rate (°C/s).
    pub rate_range_deg_c_per_s: Option<[f64; 2]>,
}

impl About {
    /// A document with its origin: the document that the fit started from, if any, and its logs.
    ///
    /// # Errors
    /// [`Error::Log`] for a log that cannot be read again, [`Error::Document`].
    pub fn complete(
        &self,
        mut document: Document,
        (base, logs): (Option<&Written>, &[PathBuf]),
        report: &Report,
        created: Created,
    ) -> Result<Written, Error> {
        let mut origin = origin(logs, &command_line())?;
        origin.method = Some(self.method.to_owned());
        origin.range_deg_c = self.range_deg_c;
        origin.rate_range_deg_c_per_s = self.rate_range_deg_c_per_s;
        origin.residual = residuals(&report.verdicts);
        let before = document.origin.take();
        let mut details = before.as_ref().and_then(|before| before.details.clone()).unwrap_or_default();
        if let Some(before) = before.filter(|before| before.tool.is_some() || before.method.is_some()) {
            // What the rest of the document rests on.
            let [tool, method] = [before.tool, before.method].map(Option::unwrap_or_default);
            let still = details.remove(BEFORE);
            let earlier = json!({ "tool": tool, "method": method, "log": before.log, (BEFORE): still });
            details.extend(kept(earlier).map(|earlier| (BEFORE.to_owned(), earlier)));
        }
        let mut own = json!({
            "verdict": report.headline(),
            "warnings": report.warnings,
            "notes": report.notes,
            "coefficients": report.coefficients_by_name(),
        });
        let other_logs = origin.log.split_off(origin.log.len().min(MOST_LOGS));
        if !other_logs.is_empty() {
            own["log"] = json!(other_logs);
        }
        if let (Some(own), Some(more)) = (own.as_object_mut(), self.details.as_object()) {
            own.extend(more.clone());
        }
        details.extend(kept(own).map(|own| (self.key.to_owned(), own)));
        details.insert(BASE.to_owned(), base_of(base));
        if let Some(base) = base {
            // What was made anew has no standard errors but its own.
            let (own, new) = (sections(tree(&base.document)?), sections(tree(&document)?));
            let with_new_weights = stated(&base.document, &document)?;
            Sigmas::retain(&mut details, |of| {
                let key = of_sigma(of, |key| new.contains_key(key));
                let old = if of.2 == "increment_weight_ppm" { &own } else { &with_new_weights };
                old.get(&key) == new.get(&key)
            });
        }
        self.sigmas.write(&mut details);
        origin.details = Some(details);
        document.origin = Some(origin);
        document.created = Some(created);
        Written::of(&document)
    }
}

/// As a document keeps it, which has no null: what is not known is left out, and in a list it is no number.
fn kept(value: Value) -> Option<toml::Value> {
    match value {
        Value::Null => None,
        Value::Array(all) => {
            Some(all.into_iter().map(|one| kept(one).unwrap_or(f64::NAN.into())).collect::<Vec<_>>().into())
        }
        Value::Object(all) => {
            let known = all.into_iter().filter_map(|(key, one)| Some((key, kept(one)?)));
            Some(toml::Value::Table(known.collect()))
        }
        other => toml::Value::try_from(other).ok(),
    }
}

/// A covariance by rows, as documents keep it.
pub(crate) fn rows(matrix: &DMatrix<f64>) -> Value {
    matrix.row_iter().map(|row| row.iter().map(|value| tidy(*value)).collect::<Vec<f64>>()).collect()
}

/// Something of each sensor, by the sensor's name.
pub(crate) fn by_name<'a>(all: impl IntoIterator<Item = (&'a str, Value)>) -> Value {
    Value::Object(all.into_iter().map(|(name, of)| (name.to_owned(), of)).collect::<Map<_, _>>())
}

#[cfg(test)]
mod tests {
    use isotherm_correction::thermal::Feature;

    use super::*;
    use crate::document::{constant, reweigh, weight};

    #[test]
    fn standard_errors_go_with_what_they_were_of() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../config/calibration/MEMS-0001.toml");
        let mut document = Written::read(path.as_ref()).unwrap().document;
        let mut sigmas = Sigmas::default();
        for name in ["x", "y"] {
            sigmas.put(("gyro", name, "static_bias"), vec![0.5]);
            sigmas.put(("gyro", name, "increment_weight_ppm"), vec![9.0]);
        }
        let mut details = toml::Table::new();
        sigmas.write(&mut details);
        document.origin.get_or_insert_default().details = Some(details);
        let base = Written::of(&document).unwrap();
        // One gyro has another bias, the other another weight, and its bias goes with that.
        document.gyro.sensor[0].set(Feature::One, constant(3.0));
        let heavier = 1.01 * weight(&document.gyro.sensor[1]).unwrap();
        reweigh(&mut document.gyro.sensor[1], heavier);
        let about = About { method: "m", key: "fit", details: json!({}), ..About::default() };
        let (report, created) = (Report::new("", ""), document.created.unwrap());
        let made = about.complete(document, (Some(&base), &[]), &report, created).unwrap();
        let sigmas = Sigmas::of(&made.document);
        let stays = |name: &str, of: &str| sigmas.get("gyro", name, of).is_some();
        assert!(!stays("x", "static_bias") && stays("x", "increment_weight_ppm"));
        assert!(stays("y", "static_bias") && !stays("y", "increment_weight_ppm"));
    }

    #[test]
    fn a_document_names_all_logs_that_it_rests_on_however_long_the_chain() {
        let folder = tempfile::tempdir().unwrap();
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../config/calibration/MEMS-0001.toml");
        let mut document = Written::read(path.as_ref()).unwrap().document;
        document.origin = None;
        let log = |name: String| {
            let path = folder.path().join(&name);
            std::fs::write(&path, &name).unwrap();
            path
        };
        let created = document.created.unwrap();
        let many: Vec<PathBuf> = (0..70).map(|number| log(format!("{number}.csv"))).collect();
        for logs in [vec![log("first.csv".to_owned())], vec![log("second.csv".to_owned())], many] {
            let about = About { method: "m", key: "fit", details: json!({}), ..About::default() };
            let report = Report::new("", "");
            document = about.complete(document, (None, &logs), &report, created).unwrap().document;
        }
        let origin = document.origin.unwrap();
        assert_eq!(origin.log.len(), MOST_LOGS);
        let details = origin.details.unwrap();
        assert_eq!(details["fit"]["log"].as_array().unwrap().len(), 70 - MOST_LOGS);
        assert_eq!(details[BEFORE]["log"][0]["name"].as_str(), Some("second.csv"));
        assert_eq!(details[BEFORE][BEFORE]["log"][0]["name"].as_str(), Some("first.csv"));
    }
}
