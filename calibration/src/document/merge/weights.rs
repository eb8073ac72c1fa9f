//! Biases of gyros with increment weights that are not those that they were fitted with.

use std::collections::BTreeMap;

use isotherm_protocol::document::Document;
use toml::Value;

use super::Part;
use super::sections::{Sections, group, sections};
use crate::document::show::terms::tree;
use crate::document::{reweigh, tidy, weight};
use crate::error::Error;

/// The sections of a document with the increment weights of another one of the same gyros.
pub(crate) fn stated(document: &Document, other: &Document) -> Result<Sections, Error> {
    Ok(sections(tree(&with(document, other))?))
}

fn with(document: &Document, other: &Document) -> Document {
    let mut document = document.clone();
    for (gyro, other) in document.gyro.sensor.iter_mut().zip(&other.gyro.sensor) {
        if let Some(new) = weight(other) {
            reweigh(gyro, new);
        }
    }
    document
}

/// What of a part's biases is taken, with the weights of the merged document where they are others than the part's, and sentences that
/// tell so.
pub(super) fn rescaled<'a>(
    parts: &[&Part<'_>],
    from: &BTreeMap<&'a str, &Part<'_>>,
    merged: &Document,
) -> Result<(BTreeMap<&'a str, Value>, Vec<String>), Error> {
    let (mut changed, mut notes) = (BTreeMap::new(), Vec::new());
    for part in parts {
        let (name, old) = (part.name(), &part.written.document);
        let new = with(old, merged);
        let sections = stated(old, merged)?;
        let taken = from.iter().filter(|(_, from)| from.name() == name);
        let other = taken.filter_map(|(key, _)| Some((*key, sections.get(*key)?)));
        let other: BTreeMap<_, _> =
            other.filter(|(key, value)| part.sections.get(*key) != Some(*value)).collect();
        for (old, new) in old.gyro.sensor.iter().zip(&new.gyro.sensor) {
            let bias = format!("gyro.sensor.{} bias", old.name);
            let ratio = weight(new).zip(weight(old)).map(|(new, old)| new / old);
            if let (Some(ratio), true) = (ratio, other.keys().any(|key| group(key) == bias)) {
                notes.push(format!(
                    "gyro {}: the bias of {name} is multiplied by {}, as the increment weight is.",
                    old.name,
                    tidy(ratio)
                ));
            }
        }
        changed.extend(other.into_iter().map(|(key, value)| (key, value.clone())));
    }
    Ok((changed, notes))
}
