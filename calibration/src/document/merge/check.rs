//! What must hold before anything is put together.

use std::collections::BTreeSet;

use isotherm_protocol::document::{AccelOutput, Document, GyroOutput};

use super::Take;
use super::sections::is_about;
use crate::document::Written;
use crate::error::Error;

/// Reasons why documents are not of one unit with the same sensors.
///
/// # Errors
/// [`Error::Refused`].
pub(super) fn same_unit(base: &Written, parts: &[Written]) -> Result<(), Error> {
    let stated: [(&str, fn(&Document) -> Option<String>); 5] = [
        ("unit", |document| Some(document.unit.clone())),
        ("gyro.sensor", |document| Some(names(document.gyro.sensor.iter().map(|sensor| &sensor.name)))),
        ("gyro.output", |document| {
            let counts = document.gyro.output == GyroOutput::Counts;
            Some(if counts { "counts" } else { "mean rate" }.to_owned())
        }),
        ("accel.sensor", |document| {
            document.accel.as_ref().map(|accel| names(accel.sensor.iter().map(|sensor| &sensor.name)))
        }),
        ("accel.output", |document| {
            let words = match document.accel.as_ref()?.output {
                AccelOutput::Counts => "counts",
                AccelOutput::Volts => "volts (V)",
                AccelOutput::MetresPerSecondSquared => "specific force (m/s²)",
            };
            Some(words.to_owned())
        }),
    ];
    let mut reasons = Vec::new();
    for (part, (key, of)) in parts.iter().flat_map(|part| stated.map(|stated| (part, stated))) {
        if let (Some(here), Some(there)) = (of(&base.document), of(&part.document))
            && here != there
        {
            reasons.push(format!(
                "{key} is {here} in {} and {there} in {}: only documents of one unit with the same sensors can be merged",
                base.name, part.name
            ));
        }
    }
    if reasons.is_empty() { Ok(()) } else { Err(Error::Refused(reasons)) }
}

fn names<'a>(names: impl Iterator<Item = &'a String>) -> String {
    names.map(String::as_str).collect::<Vec<_>>().join(", ")
}

/// Refuses choices that choose nothing, and documents of the same name.
pub(super) fn check(base: &Written, parts: &[Written], take: &[Take]) -> Result<(), Error> {
    let names: Vec<&str> = parts.iter().chain([base]).map(|document| document.name.as_str()).collect();
    let distinct: BTreeSet<&&str> = names.iter().collect();
    if distinct.len() < names.len() {
        return Err(Error::Usage(format!(
            "two documents have the same name: {}. Rename one",
            names.join(", ")
        )));
    }
    for choice in take {
        if !names.contains(&choice.from.as_str()) {
            return Err(Error::Usage(format!(
                "--take {}={} is not a document of this merge: {}",
                choice.key,
                choice.from,
                names.join(", ")
            )));
        }
        if is_about(&choice.key) {
            return Err(Error::Usage(format!(
                "--take {}: origin, note and date cannot be chosen",
                choice.key
            )));
        }
    }
    Ok(())
}
