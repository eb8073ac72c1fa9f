//! What must hold before anything is put together.

use std::collections::BTreeSet;

use isotherm_protocol::document::{AccelOutput, GyroOutput};

use super::Take;
use super::sections::is_about;
use crate::document::Written;
use crate::error::Error;

/// Refuses documents that are not of one unit, or of other sensors.
pub(super) fn same_unit(base: &Written, parts: &[Written]) -> Result<(), Error> {
    let shape = |named: &Written| {
        let document = &named.document;
        let gyros: Vec<String> = document.gyro.sensor.iter().map(|sensor| sensor.name.clone()).collect();
        let accels = document.accel.as_ref().map(|accel| {
            let names = accel.sensor.iter().map(|sensor| sensor.name.clone()).collect::<Vec<_>>();
            (names, accel_words(accel.output))
        });
        (document.unit.clone(), gyros, gyro_words(document.gyro.output), accels)
    };
    let (unit, gyros, output, accels) = shape(base);
    let mut reasons = Vec::new();
    for part in parts {
        let (other, part_gyros, part_output, part_accels) = shape(part);
        for (key, here, there) in [
            ("unit", unit.clone(), other),
            ("gyro.sensor", gyros.join(", "), part_gyros.join(", ")),
            ("gyro.output", output.clone(), part_output),
        ] {
            if here != there {
                reasons.push(differing(key, &here, &base.name, &there, &part.name));
            }
        }
        if let (Some((names, output)), Some((part_names, part_output))) = (&accels, &part_accels) {
            if names != part_names {
                reasons.push(differing(
                    "accel.sensor",
                    &names.join(", "),
                    &base.name,
                    &part_names.join(", "),
                    &part.name,
                ));
            }
            if output != part_output {
                reasons.push(differing("accel.output", output, &base.name, part_output, &part.name));
            }
        }
    }
    if reasons.is_empty() { Ok(()) } else { Err(Error::Refused(reasons)) }
}

/// What a gyro's readings stand for.
fn gyro_words(output: GyroOutput) -> String {
    match output {
        GyroOutput::Counts => "counts",
        GyroOutput::Mean => "mean rate",
    }
    .to_owned()
}

/// What an accelerometer's readings stand for.
fn accel_words(output: AccelOutput) -> String {
    match output {
        AccelOutput::Counts => "counts",
        AccelOutput::Volts => "volts (V)",
        AccelOutput::MetresPerSecondSquared => "specific force (m/s²)",
    }
    .to_owned()
}

fn differing(key: &str, here: &str, base: &str, there: &str, part: &str) -> String {
    format!(
        "{key} is {here} in {base} and {there} in {part}: only documents of one unit with the same sensors can be \
         merged"
    )
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
