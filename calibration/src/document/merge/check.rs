//! What must hold before anything is put together.

use std::collections::BTreeSet;

use isotherm_protocol::document::{AccelOutput, Document, GyroOutput};

use super::sections::is_about;
use super::{Take, covers};
use crate::document::Written;
use crate::error::Error;

/// Reasons why documents are not of one unit with the same sensors.
///
/// # Errors
/// [`Error::Refused`].
pub(super) fn same_unit(base: &Written, parts: &[Written]) -> Result<(), Error> {
    let mut reasons = Vec::new();
    for part in parts {
        for ((key, here), (_, there)) in stated(&base.document).into_iter().zip(stated(&part.document)) {
            if let (Some(here), Some(there)) = (here, there)
                && here != there
            {
                reasons.push(format!(
                    "{key} is {here} in {} and {there} in {}: only documents of one unit with the same sensors can be \
                     merged",
                    base.name, part.name
                ));
            }
        }
    }
    if reasons.is_empty() { Ok(()) } else { Err(Error::Refused(reasons)) }
}

/// What documents of one unit have in common.
fn stated(document: &Document) -> [(&'static str, Option<String>); 5] {
    let accel = document.accel.as_ref();
    let gyro_output = match document.gyro.output {
        GyroOutput::Counts => "counts",
        GyroOutput::Mean => "mean rate",
    };
    let accel_output = accel.map(|accel| match accel.output {
        AccelOutput::Counts => "counts",
        AccelOutput::Volts => "volts (V)",
        AccelOutput::MetresPerSecondSquared => "specific force (m/s²)",
    });
    [
        ("unit", Some(document.unit.clone())),
        ("gyro.sensor", Some(names(document.gyro.sensor.iter().map(|sensor| &sensor.name)))),
        ("gyro.output", Some(gyro_output.to_owned())),
        ("accel.sensor", accel.map(|accel| names(accel.sensor.iter().map(|sensor| &sensor.name)))),
        ("accel.output", accel_output.map(str::to_owned)),
    ]
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

/// Refuses choices of keys that no document has.
pub(super) fn chosen(take: &[Take], keys: &BTreeSet<&str>) -> Result<(), Error> {
    let Some(take) = take.iter().find(|take| !keys.iter().any(|key| covers(&take.key, key))) else {
        return Ok(());
    };
    let parents = std::iter::successors(Some(take.key.as_str()), |key| Some(key.rsplit_once('.')?.0));
    let first = |key: &str| key.split('.').next().unwrap_or(key).to_owned();
    let below = |parent: &str| -> BTreeSet<String> {
        let rest =
            keys.iter().filter(|key| covers(parent, key)).filter_map(|key| key.get(parent.len() + 1..));
        rest.map(|rest| format!("{parent}.{}", first(rest))).collect()
    };
    let near = parents.map(below).find(|near| !near.is_empty());
    let near = near.unwrap_or_else(|| keys.iter().map(|key| first(key)).collect());
    Err(Error::Usage(format!(
        "--take {}={}: no document has this key; there are {}",
        take.key,
        take.from,
        near.into_iter().collect::<Vec<_>>().join(", ")
    )))
}
