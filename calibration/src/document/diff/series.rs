//! Several documents of a unit in the order of time, as before shock and vibration, between the two, and after (the third table of 004).

use std::collections::BTreeSet;

use serde_json::json;

use super::sheet::{plus_minus, tenths};
use super::{BEYOND, Changes, changes};
use crate::document::Written;
use crate::error::Error;
use crate::numbers::once_each;
use crate::report::{Report, or_dash, short};

/// The changes from each document to the next, and from the first to the last.
#[derive(Debug, Clone)]
pub struct Series {
    /// From each to the next.
    pub steps: Vec<Changes>,
    /// From the first to the last.
    pub whole: Changes,
}

impl Series {
    /// Compares documents in the order of time; `axis_sigma` as of [`changes`].
    ///
    /// # Errors
    /// As [`changes`]; [`Error::Usage`] for fewer than two.
    pub fn of(documents: &[Written], axis_sigma: Option<f64>) -> Result<Self, Error> {
        let between = |before: &Written, after: &Written| changes([before, after], axis_sigma);
        let (Some(first), Some(last)) = (documents.first(), documents.last()) else {
            return Err(Error::Usage("no documents are given".to_owned()));
        };
        let steps = documents.iter().zip(documents.iter().skip(1)).map(|(a, b)| between(a, b));
        Ok(Self { steps: steps.collect::<Result<_, _>>()?, whole: between(first, last)? })
    }

    /// All columns of its tables.
    fn columns(&self) -> impl Iterator<Item = &Changes> {
        self.steps.iter().chain([&self.whole])
    }

    /// Everything.
    pub fn sheet(&self) -> Report {
        let names: Vec<&str> = self.steps.iter().map(|step| step.names[0].as_str()).collect();
        let last = &self.whole.names[1];
        let mut sheet = self.whole.saying(format!("{} → {last}", names.join(" → ")));
        let units: BTreeSet<&String> = self.columns().flat_map(|step| &step.units).collect();
        if units.len() > 1 {
            let units: Vec<&str> = units.into_iter().map(String::as_str).collect();
            sheet.warnings.push(format!("the documents are for units {}", units.join(", ")));
        }
        sheet.notes.push(format!(
            "Each column is the later document less the earlier one, at {} °C, {}; the last is the total.",
            short(self.whole.reference_deg_c),
            self.whole.settled
        ));
        let columns: Vec<String> =
            self.columns().map(|step| format!("{} → {}", step.names[0], step.names[1])).collect();
        let head = |first: &str| [vec![first.to_owned()], columns.clone()].concat();
        let axes = self.whole.axes.iter().map(|axis| {
            let turned = |step: &Changes| {
                let own = step.axes.iter().find(|other| other.of == axis.of)?;
                let beyond = own.significance.is_some_and(|sigmas| sigmas > BEYOND);
                let words = plus_minus(own.turned_arcsec, own.turned_sigma_arcsec, tenths);
                Some(if beyond { words + " *" } else { words })
            };
            row(&axis.of, self.columns().map(turned))
        });
        sheet.table("Input axes", head("input axis turned by, ″"), axes);
        if self.columns().any(|step| !step.turned().is_empty()) {
            sheet.notes.push(format!("* beyond {BEYOND} σ of both calibrations."));
        }
        let values = self.columns().flat_map(|step| &step.values);
        let kinds = once_each(values.map(|value| (&value.of, value.unit)));
        let values = kinds.into_iter().map(|(of, unit)| {
            let changed = |step: &Changes| {
                let own = step.values.iter().find(|value| value.of == *of)?;
                Some(plus_minus(own.at_reference, own.sigma, short))
            };
            row(&format!("{of}, {unit}"), self.columns().map(changed))
        });
        sheet.table("Changes of biases and scale factors", head(""), values);
        sheet.figures = json!({ "steps": self.steps, "whole": self.whole });
        sheet
    }
}

/// A row of a table; what did not change is a dash.
fn row(of: &str, cells: impl Iterator<Item = Option<String>>) -> Vec<String> {
    std::iter::once(of.to_owned()).chain(cells.map(or_dash)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shock_and_vibration_stand_beside_each_other() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../config/calibration/MEMS-0001.toml");
        let before = Written::read(path.as_ref()).unwrap();
        let mut document = before.document.clone();
        let accel = document.accel.as_mut().unwrap();
        // The third axis turns by 60″ towards x.
        let [x, y, z] = accel.orientation.rows[2];
        let angle = (60.0 / 3600.0_f64).to_radians();
        accel.orientation.rows[2] = [x * angle.cos() + z * angle.sin(), y, z * angle.cos() - x * angle.sin()];
        let between = Written::of(&document).unwrap();
        let documents = [("a", before.clone()), ("b", between), ("c", before)]
            .map(|(name, of)| Written { name: name.to_owned(), ..of });
        let series = Series::of(&documents, Some(4.0)).unwrap();
        let turned = |step: &Changes| {
            step.axes.iter().find(|axis| axis.of == "accelerometer z").unwrap().turned_arcsec
        };
        assert!(
            (turned(&series.steps[0]) - 60.0).abs() < 0.1 && (turned(&series.steps[1]) - 60.0).abs() < 0.1
        );
        assert!(turned(&series.whole) < 1e-9);
        insta::assert_snapshot!(series.sheet().whole_text());
        assert_eq!(series.sheet().to_json()["steps"].as_array().unwrap().len(), 2);
        assert!(Series::of(&[], None).is_err());
    }
}
