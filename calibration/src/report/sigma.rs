//! Standard errors as documents keep them: `[origin.details.sigma.<gyro or accel>.<sensor>]`.
//!
//! Each entry is named after what it belongs to and is a list of numbers: a term's key (`static_bias`, `scale_factor`, `bias`,
//! …) with one number per coefficient or knot in the curve's own unit, `axis_arcsec` with one per direction cosine of the
//! input axis (″), `increment_weight_ppm` with one. What compares two documents reads them there.

use std::collections::BTreeMap;

use isotherm_protocol::document::Document;
use serde::{Deserialize, Serialize};
use toml::{Table, Value};

/// Key in `origin.details`.
const KEY: &str = "sigma";

/// Standard errors by kind ("gyro" or "accel"), sensor and what they are of.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Sigmas(BTreeMap<String, BTreeMap<String, BTreeMap<String, Vec<f64>>>>);

impl Sigmas {
    /// Those that a document states.
    pub fn of(document: &Document) -> Self {
        let details = document.origin.as_ref().and_then(|origin| origin.details.as_ref());
        details.map(Self::of_details).unwrap_or_default()
    }

    fn of_details(details: &Table) -> Self {
        details.get(KEY).and_then(|value| value.clone().try_into().ok()).unwrap_or_default()
    }

    /// Enters standard errors; numbers that are not finite become 0, "not known".
    pub fn put(&mut self, (kind, sensor, term): (&str, &str, &str), values: Vec<f64>) {
        let values = values.into_iter().map(|sigma| if sigma.is_finite() { sigma } else { 0.0 }).collect();
        let of_kind = self.0.entry(kind.to_owned()).or_default();
        of_kind.entry(sensor.to_owned()).or_default().insert(term.to_owned(), values);
    }

    /// The standard errors of one thing.
    pub fn get(&self, kind: &str, sensor: &str, term: &str) -> Option<&[f64]> {
        self.0.get(kind)?.get(sensor)?.get(term).map(Vec::as_slice)
    }

    /// All of them, by kind, sensor and what they are of.
    pub fn iter(&self) -> impl Iterator<Item = ((&str, &str, &str), &[f64])> {
        self.0.iter().flat_map(|(kind, sensors)| {
            sensors.iter().flat_map(move |(sensor, terms)| {
                let of = move |term| (kind.as_str(), sensor.as_str(), term);
                terms.iter().map(move |(term, values)| (of(term.as_str()), values.as_slice()))
            })
        })
    }

    /// Takes those out of the details of a document's origin that hold no longer.
    pub fn retain(details: &mut Table, holds: impl Fn((&str, &str, &str)) -> bool) {
        let (stated, mut kept) = (Self::of_details(details), Self::default());
        stated.iter().filter(|(of, _)| holds(*of)).for_each(|(of, values)| kept.put(of, values.to_vec()));
        details.remove(KEY);
        kept.write(details);
    }

    /// Adds them to the details of a document's origin, over those of the same that are there.
    pub fn write(&self, details: &mut Table) {
        let mut all = Self::of_details(details);
        self.iter().for_each(|(of, values)| all.put(of, values.to_vec()));
        if let (false, Ok(value)) = (self.0.is_empty(), Value::try_from(all)) {
            details.insert(KEY.to_owned(), value);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::document::Written;

    #[test]
    fn what_is_written_is_read_back() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../config/calibration/MEMS-0001.toml");
        let mut document = Written::read(path.as_ref()).unwrap().document;
        assert_eq!(Sigmas::of(&document), Sigmas::default());
        let mut sigmas = Sigmas::default();
        sigmas.put(("accel", "x", "axis_arcsec"), vec![0.5, 12.0, f64::NAN]);
        sigmas.put(("gyro", "z", "static_bias"), vec![0.01]);
        let mut details = Table::new();
        details.insert("sigma".into(), Value::Integer(3));
        sigmas.write(&mut details);
        document.origin.get_or_insert_default().details = Some(details);
        let read = Written::of(&document).unwrap().document;
        let found = Sigmas::of(&read);
        assert_eq!(found.get("accel", "x", "axis_arcsec"), Some([0.5, 12.0, 0.0].as_slice()));
        assert_eq!(
            (found.get("gyro", "z", "static_bias"), found.iter().count()),
            (Some([0.01].as_slice()), 2)
        );
    }
}
