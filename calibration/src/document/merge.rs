//! Parts of a calibration, made by different commands, put into one document.
//!
//! A part is compared with the base that it was made from. What it states otherwise than the base, it has made; what it
//! states as the base does, or not at all, it has not. Terms that one fit makes together (all terms of a gyro's bias; scale
//! factor and bias of an accelerometer; the axes of a kind) are replaced together: a lag that takes the place of K1 takes
//! K1 away, and that is told. Where two parts have made the same otherwise, neither is taken: the keys are told, and the
//! user decides.

mod check;
mod origin;
mod sections;
#[cfg(test)]
mod tests;

use std::collections::{BTreeMap, BTreeSet};

use isotherm_protocol::document::{Document, Temperature};
use serde_json::{Map, json};
use toml::Value;

use crate::document::Written;
use crate::document::plain::{ASSUMED_DEG_C, plain};
use crate::document::provenance::{BASE, digest_of};
use crate::document::show::terms::tree;
use crate::error::Error;
use crate::report::Report;
use check::{check, chosen, same_unit};
use sections::{Sections, group, sections, with};

/// Which part decides over keys that begin so.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Take {
    /// A key, or what keys begin with.
    pub key: String,
    /// Name of the part, or of the base.
    pub from: String,
}

/// What came of a merge.
#[derive(Debug)]
pub struct Merged {
    /// The new document.
    pub written: Written,
    /// Where each section is from, in the order of the keys: key and name.
    pub taken: Vec<(String, String)>,
    /// Sections of the base that a part has done without, and which part.
    pub gone: Vec<(String, String)>,
    /// What is to be looked at.
    pub warnings: Vec<String>,
}

/// Puts parts together.
///
/// # Errors
/// [`Error::Refused`] with every conflict, or where the documents are not of one unit with the same sensors;
/// [`Error::Usage`] for a `take` that names nothing; [`Error::Document`] where the result does not hold.
pub fn merge(base: &Written, parts: &[Written], take: &[Take]) -> Result<Merged, Error> {
    same_unit(base, parts)?;
    check(base, parts, take)?;
    let old = sections(&tree(&base.document)?);
    let new: Vec<Sections> =
        parts.iter().map(|part| Ok(sections(&tree(&part.document)?))).collect::<Result<_, Error>>()?;
    chosen(take, (&old, &new))?;
    let mut picked = Picked { sections: old.clone(), ..Picked::default() };
    for key in old.keys() {
        picked.from.insert(key.clone(), base.name.clone());
    }
    let mut groups: BTreeSet<String> = old.keys().map(|key| group(key)).collect();
    groups.extend(new.iter().flatten().map(|(key, _)| group(key)));
    let mut conflicts = Vec::new();
    for group in groups {
        picked.decide(&group, (base, &old), (parts, &new), take, &mut conflicts);
    }
    picked.filters(base, parts, &mut conflicts);
    if !conflicts.is_empty() {
        return Err(Error::Refused(conflicts));
    }
    let Picked { sections, from, gone, warnings } = picked;
    let words = |found: Vec<isotherm_protocol::document::Problem>| {
        Error::Document(found.iter().map(ToString::to_string).collect())
    };
    let tree = with(tree(&base.document)?, &old, &sections);
    let mut document = Document::parse(&tree.to_string(), None).map_err(words)?.document;
    document.origin = Some(origin::origin(base, parts, &from)?);
    let taken = from.into_iter().filter(|(key, _)| sections.contains_key(key)).collect();
    Ok(Merged { written: Written::of(&document)?, taken, gone, warnings })
}

/// What has been decided so far.
#[derive(Debug, Default)]
struct Picked {
    sections: Sections,
    from: BTreeMap<String, String>,
    gone: Vec<(String, String)>,
    warnings: Vec<String>,
}

impl Picked {
    /// Decides over what is replaced together.
    fn decide(
        &mut self,
        of: &str,
        (base, old): (&Written, &Sections),
        (parts, new): (&[Written], &[Sections]),
        take: &[Take],
        conflicts: &mut Vec<String>,
    ) {
        let mine = |sections: &Sections| -> Sections {
            let inside = sections.iter().filter(|(key, _)| group(key) == of);
            inside.map(|(key, value)| (key.clone(), value.clone())).collect()
        };
        let before = mine(old);
        // By part: what it has made differently, and what it does without.
        let mut made: Vec<(&str, BTreeMap<String, Option<Value>>)> = Vec::new();
        for (part, sections) in parts.iter().zip(new) {
            let mut after = mine(sections);
            let gone: Vec<String> = before.keys().filter(|key| !after.contains_key(*key)).cloned().collect();
            after.retain(|key, value| {
                before.get(key) != Some(value) && has_made(part, sections, key, value, &before)
            });
            let open = |key: &&String| !take.iter().any(|take| covers(&take.key, key));
            let never: Vec<&str> = gone.iter().filter(open).map(String::as_str).collect();
            if !after.is_empty() && !never.is_empty() && !is_of(part, base, parts) {
                conflicts.push(format!(
                    "{}: in {}, but {} was made from another document, which may not have had this: repeat its fit from {} \
                     (--calibration), or choose with --take {}={}",
                    never.join(", "), base.name, part.name, base.name, never[0], base.name
                ));
                continue;
            }
            if !after.is_empty() {
                let changed = after.into_iter().map(|(key, value)| (key, Some(value)));
                made.push((
                    part.name.as_str(),
                    changed.chain(gone.into_iter().map(|key| (key, None))).collect(),
                ));
            } else if !gone.is_empty() {
                self.warnings.push(format!(
                    "{} lacks {}: kept as in {}",
                    part.name,
                    gone.join(", "),
                    base.name
                ));
            }
        }
        let keys: BTreeSet<&String> = made.iter().flat_map(|(_, changed)| changed.keys()).collect();
        for key in keys {
            let said: Vec<(&str, &Option<Value>)> =
                made.iter().filter_map(|(name, changed)| Some((*name, changed.get(key)?))).collect();
            let chosen = take.iter().rev().find(|take| covers(&take.key, key));
            let decided = match chosen {
                Some(take) if take.from == base.name => continue,
                Some(take) => said.iter().find(|(name, _)| *name == take.from),
                None => said.first().filter(|(_, value)| said.iter().all(|(_, other)| other == value)),
            };
            let Some((name, value)) = decided else {
                conflicts.push(conflict(key, &said, chosen));
                continue;
            };
            self.set(key, name, value.as_ref());
        }
        let fits: BTreeSet<&String> = self
            .from
            .iter()
            .filter(|(key, from)| group(key) == of && **from != base.name)
            .map(|(_, from)| from)
            .collect();
        if (of.ends_with(" bias") || of.ends_with(" output")) && fits.len() > 1 {
            let names: Vec<&str> = fits.into_iter().map(String::as_str).collect();
            self.warnings.push(format!(
                "the terms of {of} are from several separate fits ({}): judge the result with validate",
                names.join(", ")
            ));
        }
    }

    fn set(&mut self, key: &str, from: &str, value: Option<&Value>) {
        if let Some(value) = value {
            self.sections.insert(key.to_owned(), value.clone());
            self.from.insert(key.to_owned(), from.to_owned());
            return;
        }
        if self.sections.remove(key).is_some() {
            self.gone.push((key.to_owned(), from.to_owned()));
        }
        self.from.remove(key);
    }

    /// Terms of Ṫ, T̈ and lags hold with the filter that they were fitted with, and with no other.
    fn filters(&self, base: &Written, parts: &[Written], conflicts: &mut Vec<String>) {
        let filter_of = |document: &Written| document.document.temperature.filter.clone();
        let Some(from) = self.from.get("temperature.filter") else { return };
        let find = |name: &str| parts.iter().chain([base]).find(|document| document.name == name);
        let filter = find(from).and_then(filter_of);
        for (key, source) in &self.from {
            if is_dynamic(key) && find(source).and_then(filter_of) != filter {
                conflicts.push(format!(
                    "temperature.filter is taken from {from}, but {key} of {source} was fitted with another filter \
                     and is wrong with this one: repeat one of the fits with the other's filter"
                ));
            }
        }
    }
}

/// Whether a part has made what it states: one that was made from its log alone states the rest as every first document does, and
/// thermometers and their filter by what its log happens to be, which no static term rests on.
fn has_made(part: &Written, own: &Sections, key: &str, value: &Value, before: &Sections) -> bool {
    if made_from(part) != Some("") {
        return true;
    }
    if key.starts_with("temperature.") && before.contains_key(key) {
        return own.keys().any(|key| is_dynamic(key)) && key != "temperature.assumed_deg_c";
    }
    let Document { unit, gyro, accel, .. } = &part.document;
    let temperature = Temperature { assumed_deg_c: ASSUMED_DEG_C, filter: None, channel: Vec::new() };
    let first = plain(unit, gyro.output, temperature, accel.as_ref().map(|accel| accel.output));
    tree(&first).is_ok_and(|first| sections(&first).get(key) != Some(value))
}

/// Whether a term holds with the temperature filter that it was fitted with only.
fn is_dynamic(key: &str) -> bool {
    ["thermal_rate", "thermal_acceleration", "lag"].iter().any(|term| key.ends_with(&format!(".{term}")))
}

/// The digest of the document that a part was made from, as far as it says.
fn made_from(part: &Written) -> Option<&str> {
    part.document.origin.as_ref()?.details.as_ref()?.get(BASE)?.as_str()
}

/// Whether a part was made from the base or from another part, as far as it says.
fn is_of(part: &Written, base: &Written, parts: &[Written]) -> bool {
    made_from(part).is_none_or(|digest| parts.iter().chain([base]).any(|one| digest_of(one) == digest))
}

/// Whether a choice is about a key.
fn covers(choice: &str, key: &str) -> bool {
    key.strip_prefix(choice).is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
}

/// What is in the way. Of two curves over temperature, made each as a whole, none adds to the other.
fn conflict(key: &str, said: &[(&str, &Option<Value>)], chosen: Option<&Take>) -> String {
    let named = |(name, value): &(&str, &Option<Value>)| {
        if value.is_some() { (*name).to_owned() } else { format!("{name} (does without it)") }
    };
    let parts = said.iter().map(named).collect::<Vec<_>>().join(" and ");
    if let Some(take) = chosen {
        return format!("{key}: --take names {}, but only {parts} changed it", take.from);
    }
    let first = said.first().map_or("", |(name, _)| name);
    let again = if [" bias", " output"].iter().any(|curves| group(key).ends_with(curves)) {
        "repeat the fit over temperature from the other document (--calibration) and leave that one out here, or "
    } else {
        ""
    };
    format!("{key}: made differently by {parts}; {again}choose with --take {key}={first}")
}

impl Merged {
    /// What was done, as text.
    pub fn sheet(&self, name: &str) -> Report {
        let documents: BTreeSet<&String> = self.taken.iter().map(|(_, from)| from).collect();
        let gone =
            if self.gone.is_empty() { String::new() } else { format!(", {} left out", self.gone.len()) };
        let words =
            format!("{} sections of {} documents, no conflict{gone}", self.taken.len(), documents.len());
        let mut sheet = Report::saying(format!("Merge of {name}"), name, words);
        sheet.warnings.clone_from(&self.warnings);
        let row = |(key, from): &(String, String)| vec![key.clone(), from.clone()];
        sheet.table("Taken", ["section", "from"], self.taken.iter().map(row));
        let heading = "Left out, because the part does without";
        sheet.table(heading, ["section", "by"], self.gone.iter().map(row));
        let pairs = |(key, from): &(String, String)| (key.clone(), json!(from));
        let map =
            |all: &[(String, String)]| -> Map<String, serde_json::Value> { all.iter().map(pairs).collect() };
        sheet.figures = json!({ "taken": map(&self.taken), "left_out": map(&self.gone) });
        sheet
    }
}
