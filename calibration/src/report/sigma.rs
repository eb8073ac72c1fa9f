//! Standard errors as documents keep them: `[origin.details.sigma.<gyro or accel>.<sensor>]`.
//!
//! Each entry is named after what it belongs to and is a list of numbers: a term's key (`static_bias`, `scale_factor`, `bias`,
//! …) with one number per coefficient or knot in the curve's own unit, `axis_arcsec` with one per direction cosine of the
//! input axis (″), `increment_weight_ppm` with one. What compares two documents reads them there.

use std::collections::BTreeMap;

use crate::numbers::real;
use isotherm_protocol::document::Document;
use toml::{Table, Value};

/// Key in `origin.details`.
const KEY: &str = "sigma";

/// Standard errors by kind ("gyro" or "accel"), sensor and what they are of.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Sigmas(BTreeMap<(String, String, String), Vec<f64>>);

impl Sigmas {
    /// Those that a document states.
    pub fn of(document: &Document) -> Self {
        let details = document.origin.as_ref().and_then(|origin| origin.details.as_ref());
        let kinds = details.and_then(|details| details.get(KEY)?.as_table());
        let mut sigmas = Self::default();
        for (kind, sensors) in kinds.into_iter().flatten() {
            for (sensor, terms) in sensors.as_table().into_iter().flatten() {
                for (term, values) in terms.as_table().into_iter().flatten() {
                    let number = |value: &Value| value.as_float().or_else(|| value.as_integer().map(real));
                    let values = values.as_array().map(|values| values.iter().filter_map(number).collect());
                    if let Some(values) = values {
                        sigmas.put(kind, sensor, term, values);
                    }
                }
            }
        }
        sigmas
    }

    /// Enters standard errors; numbers that are not finite become 0, "not known".
    pub fn put(&mut self, kind: &str, sensor: &str, term: &str, values: Vec<f64>) {
        let values = values.into_iter().map(|sigma| if sigma.is_finite() { sigma } else { 0.0 }).collect();
        self.0.insert((kind.to_owned(), sensor.to_owned(), term.to_owned()), values);
    }

    /// Standard errors of one term; `None` where they are not known.
    pub fn get(&self, kind: &str, sensor: &str, term: &str) -> Option<&[f64]> {
        self.0.get(&(kind.to_owned(), sensor.to_owned(), term.to_owned())).map(Vec::as_slice)
    }

    /// All of them.
    pub fn iter(&self) -> impl Iterator<Item = ((&str, &str, &str), &[f64])> {
        let parts = |(kind, sensor, term)| -> (&str, &str, &str) { (kind, sensor, term) };
        self.0
            .iter()
            .map(move |((kind, sensor, term), values)| (parts((kind, sensor, term)), values.as_slice()))
    }

    /// Writes them into the details of a document's origin, beside what is there; without any, nothing changes.
    pub fn write(&self, details: &mut Table) {
        if self.0.is_empty() {
            return;
        }
        let all = details.entry(KEY).or_insert_with(|| Value::Table(Table::new()));
        for ((kind, sensor, term), values) in &self.0 {
            let mut table = &mut *all;
            for key in [kind, sensor] {
                if !table.is_table() {
                    *table = Value::Table(Table::new());
                }
                let Some(inner) = table.as_table_mut() else { return };
                table = inner.entry(key.clone()).or_insert_with(|| Value::Table(Table::new()));
            }
            if !table.is_table() {
                *table = Value::Table(Table::new());
            }
            if let Some(inner) = table.as_table_mut() {
                inner.insert(term.clone(), Value::Array(values.iter().copied().map(Value::Float).collect()));
            }
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
        sigmas.put("accel", "x", "axis_arcsec", vec![0.5, 12.0, f64::NAN]);
        sigmas.put("gyro", "z", "static_bias", vec![0.01]);
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
