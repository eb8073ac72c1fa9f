//! An overlay on its base: whether it fits, and the document that results.

use super::{OVERLAY_OF, Overlay, ParsedOverlay};
use crate::digest::Digest;
use crate::document::{Curve, Document, GyroSensor, Origin, Parsed, Problem, Shape};
use isotherm_correction::thermal::Feature;
use isotherm_document::{element, join};

/// Key of `origin.details` that lists the overlays a document was made with, the last one last.
const DETAILS_KEY: &str = "overlays";

impl ParsedOverlay {
    /// The base with the overlay's changes.
    ///
    /// The change is added to all of a curve's values; a bias that the base leaves out becomes a constant.
    /// `origin.details.overlays` of the result names overlay and base.
    ///
    /// # Errors
    /// Everything in which the overlay does not fit the base: another digest, another unit, a gyro it does not have, a
    /// magnetic bias for an instrument without modes, temperatures of another number of gyros.
    pub fn apply(&self, base: &Parsed) -> Result<Document, Vec<Problem>> {
        let problems = self.misfits(&base.digest.to_string(), &base.document);
        if !problems.is_empty() {
            return Err(problems);
        }
        let mut document = base.document.clone();
        for change in &self.overlay.gyro {
            let named = document.gyro.sensor.iter_mut().find(|sensor| sensor.name == change.name);
            let Some(sensor) = named else { continue };
            add(sensor, Feature::One, Some(change.static_bias_change_deg_per_h));
            add(sensor, Feature::LasingMode, change.magnetic_bias_change_deg_per_h);
        }
        document.created = self.overlay.created.or(document.created);
        record(document.origin.get_or_insert_default(), &self.overlay, self.digest);
        Ok(document)
    }

    /// Everything in which the overlay does not fit.
    fn misfits(&self, base_digest: &str, base: &Document) -> Vec<Problem> {
        let overlay = &self.overlay;
        let mut problems = Vec::new();
        let mut refuse = |key: &str, message: String| problems.push(self.problem(key, message));
        if overlay.overlay_of != base_digest {
            let of = &overlay.overlay_of;
            refuse(
                OVERLAY_OF,
                format!(
                    "is {of}, but the document in force has {base_digest}: first put the document of the overlay in \
                     force, or make a new overlay"
                ),
            );
        }
        if overlay.unit != base.unit {
            refuse("unit", format!("is {:?}, but the document is for {:?}", overlay.unit, base.unit));
        }
        let names: Vec<&str> = base.gyro.sensor.iter().map(|sensor| sensor.name.as_str()).collect();
        for (i, change) in overlay.gyro.iter().enumerate() {
            let path = element("gyro", i);
            let Some(at) = names.iter().position(|name| *name == change.name) else {
                let name = &change.name;
                let known = names.join(", ");
                refuse(
                    &join(&path, "name"),
                    format!("is {name:?}, not a gyro of the document; its gyros are: {known}"),
                );
                continue;
            };
            let magnetic =
                base.gyro.sensor.get(at).is_some_and(|sensor| sensor.terms.has(Feature::LasingMode));
            if change.magnetic_bias_change_deg_per_h.is_some() && !magnetic && base.mode_reversal.is_none() {
                refuse(
                    &join(&path, "magnetic_bias_change_deg_per_h"),
                    "changes a magnetic bias, but the document has no lasing modes: remove it".to_owned(),
                );
            }
        }
        if let Some(record) = &overlay.pre_launch
            && record.mean_temperature_deg_c.len() != names.len()
        {
            let (count, gyros) = (record.mean_temperature_deg_c.len(), names.len());
            refuse(
                "pre_launch.mean_temperature_deg_c",
                format!("has {count} entries, must have {gyros}: one for each gyro of the document"),
            );
        }
        problems.sort_by_key(|problem| (problem.line, problem.column));
        problems
    }

    /// A problem at a key of the overlay.
    pub(super) fn problem(&self, key: &str, message: String) -> Problem {
        let (line, column) = self.places.get(key).copied().unwrap_or((1, 1));
        Problem { file: self.file.clone(), line, column, key: key.to_owned(), message }
    }
}

impl Overlay {
    /// The overlay that does to the base of `earlier` what `earlier` and then this one do; for a calibration that was made
    /// while an overlay was in force, so that its result, too, rests on the document itself.
    ///
    /// Changes add up. A standard error is that of the last determination: the constant was found anew, whatever it was
    /// before.
    #[must_use]
    pub fn after(&self, earlier: &Self) -> Self {
        let mut sum = Self { overlay_of: earlier.overlay_of.clone(), ..self.clone() };
        for before in &earlier.gyro {
            let Some(now) = sum.gyro.iter_mut().find(|gyro| gyro.name == before.name) else {
                sum.gyro.push(before.clone());
                continue;
            };
            now.static_bias_change_deg_per_h += before.static_bias_change_deg_per_h;
            now.magnetic_bias_change_deg_per_h =
                match (before.magnetic_bias_change_deg_per_h, now.magnetic_bias_change_deg_per_h) {
                    (Some(first), Some(second)) => Some(first + second),
                    (first, second) => second.or(first),
                };
            now.magnetic_bias_sigma_deg_per_h =
                now.magnetic_bias_sigma_deg_per_h.or(before.magnetic_bias_sigma_deg_per_h);
        }
        sum
    }
}

/// Adds a change to a bias; without one the bias stays as it is, stated or not.
fn add(sensor: &mut GyroSensor, bias: Feature, change: Option<f64>) {
    let Some(change) = change else { return };
    let stated = sensor.terms.curve(bias).map(|curve| curve.plus(change));
    let curve = stated.unwrap_or_else(|| Curve::new(Shape::Constant { value: change }));
    sensor.set(bias, curve);
}

/// Enters the overlay in the origin's details.
fn record(origin: &mut Origin, overlay: &Overlay, digest: Digest) {
    let details = origin.details.get_or_insert_default();
    let entry = toml::Table::from_iter([
        ("sha256".to_owned(), toml::Value::String(digest.to_string())),
        ("overlay_of".to_owned(), toml::Value::String(overlay.overlay_of.clone())),
    ]);
    let listed = details.entry(DETAILS_KEY).or_insert_with(|| toml::Value::Array(Vec::new()));
    // Anything may stand in the details: what is there under this key stays, as the first entry.
    if !listed.is_array() {
        *listed = toml::Value::Array(vec![listed.clone()]);
    }
    if let toml::Value::Array(list) = listed {
        list.push(toml::Value::Table(entry));
    }
}
