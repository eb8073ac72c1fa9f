//! Parts of a calibration, made by different commands, put into one document.
//!
//! A part is compared with the base that it was made from. What it states otherwise than the base, it has made; what it
//! states as the base does, or not at all, it has not. Terms that one fit makes together (all terms of a gyro's bias; scale
//! factor and bias of an accelerometer; the axes of a kind) are replaced together: a lag that takes the place of K1 takes
//! K1 away, and that is told. Where two parts have made the same otherwise, neither is taken: the keys are told, and the
//! user decides.
//!
//! A gyro's bias holds with the increment weight that it was fitted with: where another part gives the weight, it is multiplied by the
//! ratio of both, and so is that of the base before a part is compared with it.

mod check;
mod origin;
pub(crate) mod sections;
#[cfg(test)]
mod tests;
pub(crate) mod weights;

use std::collections::{BTreeMap, BTreeSet};

use isotherm_protocol::document::{AccelSensor, Document, Filter, Problem, Temperature};
use serde_json::{Map, json};
use toml::Value;

use crate::document::plain::{ASSUMED_DEG_C, plain};
use crate::document::provenance::{BASE, digest_of};
use crate::document::show::terms::tree;
use crate::document::{Written, accelerometers};
use crate::error::Error;
use crate::report::Report;
use check::{check, chosen, same_unit};
use sections::{Sections, group, put, sections};

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
    /// What was done besides, in sentences.
    pub notes: Vec<String>,
}

/// Puts parts together.
///
/// # Errors
/// [`Error::Refused`] with every conflict, or where the documents are not of one unit with the same sensors;
/// [`Error::Usage`] for a `take` that names nothing; [`Error::Document`] where the result does not hold.
pub fn merge(base: &Written, parts: &[Written], take: &[Take]) -> Result<Merged, Error> {
    same_unit(base, parts)?;
    check(base, parts, take)?;
    let (whole, written) = (Part::of(base, base)?, parts);
    let parts = parts.iter().map(|part| Part::of(part, base)).collect::<Result<Vec<_>, _>>()?;
    let keys: BTreeSet<&str> =
        parts.iter().chain([&whole]).flat_map(|part| part.sections.keys()).map(String::as_str).collect();
    chosen(take, &keys)?;
    let mut groups: BTreeMap<String, Vec<&str>> = BTreeMap::new();
    for key in keys {
        groups.entry(group(key)).or_default().push(key);
    }
    let mut merging = Merging {
        base: &whole,
        parts: &parts,
        take,
        from: whole.sections.keys().map(|key| (key.as_str(), &whole)).collect(),
        gone: Vec::new(),
        warnings: Vec::new(),
        conflicts: Vec::new(),
        foreign: BTreeMap::new(),
    };
    for (group, keys) in &groups {
        merging.decide(group, keys);
    }
    merging.filters();
    merging.foreign();
    let Merging { from, gone, warnings, conflicts, .. } = merging;
    if !conflicts.is_empty() {
        return Err(Error::Refused(conflicts));
    }
    let mut tree = tree(&base.document)?;
    // Readings and rows go by the order of the sensors, which keys have not.
    for AccelSensor { name, .. } in parts.iter().flat_map(|part| accelerometers(&part.written.document)) {
        let key = format!("accel.sensor.{name}.");
        if from.keys().any(|from| from.starts_with(&key)) {
            put(&mut tree, &format!("{key}name"), Some(name.as_str().into()));
        }
    }
    for key in whole.sections.keys().map(String::as_str).chain(from.keys().copied()) {
        put(&mut tree, key, from.get(key).and_then(|part| part.sections.get(key).cloned()));
    }
    let words = |found: Vec<Problem>| Error::Document(found.iter().map(ToString::to_string).collect());
    let parse = |tree: &toml::Table| Document::parse(&tree.to_string(), None).map_err(words);
    let all: Vec<&Part<'_>> = parts.iter().chain([&whole]).collect();
    let (biases, notes) = weights::rescaled(&all, &from, &parse(&tree)?.document)?;
    for (key, value) in biases {
        put(&mut tree, key, Some(value));
    }
    let mut document = parse(&tree)?.document;
    let taken = from.into_iter().map(|(key, part)| (key.to_owned(), part.name().to_owned())).collect();
    document.origin = Some(origin::origin(base, written, &taken)?);
    Ok(Merged { written: Written::of(&document)?, taken: taken.into_iter().collect(), gone, warnings, notes })
}

/// A document with its sections.
struct Part<'a> {
    written: &'a Written,
    sections: Sections,
    /// Biases of the base with the increment weights of this document.
    of_base: Sections,
}

/// What has been decided so far.
struct Merging<'a> {
    base: &'a Part<'a>,
    parts: &'a [Part<'a>],
    take: &'a [Take],
    /// Where each section is from.
    from: BTreeMap<&'a str, &'a Part<'a>>,
    gone: Vec<(String, String)>,
    warnings: Vec<String>,
    conflicts: Vec<String>,
    /// What is taken of parts that were made from documents that are not there.
    foreign: BTreeMap<&'a str, Vec<&'a str>>,
}

impl<'a> Merging<'a> {
    /// Decides over keys that are replaced together.
    fn decide(&mut self, group: &str, keys: &[&'a str]) {
        let base = self.base;
        // By part: what it has made, and what it does without.
        let mut changed: Vec<(&'a Part<'a>, Vec<&str>)> = Vec::new();
        for part in self.parts {
            let lacks = |key: &&str| base.sections.contains_key(*key) && !part.sections.contains_key(*key);
            let gone: Vec<&str> = keys.iter().copied().filter(lacks).collect();
            let made: Vec<&'a str> = keys.iter().copied().filter(|key| part.has_made(base, key)).collect();
            let open = |key: &&str| !self.take.iter().any(|take| covers(&take.key, key));
            if part.made_from() != Some("") && !self.is_known(part) {
                self.foreign.entry(part.name()).or_default().extend(made.iter().copied().filter(open));
            }
            let never: Vec<&str> = gone.iter().copied().filter(open).collect();
            if made.is_empty() {
                let lacks = format!("{} lacks {}: kept as in {}", part.name(), gone.join(", "), base.name());
                self.warnings.extend((!gone.is_empty()).then_some(lacks));
            } else if !never.is_empty() && !self.is_known(part) {
                self.conflicts.push(format!(
                    "{}: in {}, but {} was made from another document, which may not have had this: repeat its fit from {} \
                     (--calibration), or choose with --take {}={}",
                    never.join(", "), base.name(), part.name(), base.name(), never[0], base.name()
                ));
            } else {
                changed.push((part, [made, gone].concat()));
            }
        }
        for &key in keys {
            let own = changed.iter().filter(|(_, own)| own.contains(&key));
            let said: Vec<Said<'a>> = own.map(|(part, _)| (*part, part.sections.get(key))).collect();
            let Some(first) = said.first() else { continue };
            let chosen = self.take.iter().rev().find(|take| covers(&take.key, key));
            let decided = match chosen {
                // One that has not changed it says of it what the base says.
                Some(take) => match said.iter().find(|(part, _)| part.name() == take.from) {
                    None => continue,
                    own => own,
                },
                None => Some(first).filter(|first| said.iter().all(|other| agree(key, first, other))),
            };
            match decided {
                None => self.conflicts.push(conflict(key, &said)),
                Some(&(part, Some(_))) => drop(self.from.insert(key, part)),
                Some(&(part, None)) => {
                    self.from.remove(key);
                    self.gone.push((key.to_owned(), part.name().to_owned()));
                }
            }
        }
        let from = keys.iter().filter_map(|key| self.from.get(key)).map(|part| part.name());
        let fits: BTreeSet<&str> = from.filter(|name| *name != base.name()).collect();
        if are_curves(group) && fits.len() > 1 {
            let names: Vec<&str> = fits.into_iter().collect();
            self.warnings.push(format!(
                "the terms of {group} are from several separate fits ({}): judge the result with validate",
                names.join(", ")
            ));
        }
    }

    /// Whether a part was made from the base or from another part, as far as it says.
    fn is_known(&self, part: &Part<'_>) -> bool {
        let mut all = self.parts.iter().chain([self.base]);
        part.made_from().is_none_or(|digest| all.any(|one| digest_of(one.written) == digest))
    }

    /// A part states what its own base did, too: where that is not there, it cannot be told from what the part has made. It takes back what
    /// the base has made beside it where both were made from one document, and is told of where it may have been made from a later one.
    fn foreign(&mut self) {
        for part in self.parts {
            let Some([first, others @ ..]) = self.foreign.get(part.name()).map(Vec::as_slice) else {
                continue;
            };
            let (name, base) = (part.name(), self.base.name());
            let more = if others.is_empty() { String::new() } else { format!(" and {} more", others.len()) };
            if part.made_from() == self.base.made_from() {
                self.conflicts.push(format!(
                    "{name} was made from the document that {base} was made from, and may have {first}{more} from there: give that \
                     document first, then {base} and {name}, or choose with --take {first}={name}"
                ));
            } else {
                self.warnings.push(format!(
                    "{name} was made from a document that is not given, and may have {first}{more} from there: give that document, too"
                ));
            }
        }
    }

    /// Terms of Ṫ, T̈ and lags hold with the filter that they were fitted with, and with no other.
    fn filters(&mut self) {
        let Some(chosen) = self.from.get("temperature.filter") else { return };
        for (key, source) in &self.from {
            if is_dynamic(key) && source.filter() != chosen.filter() {
                self.conflicts.push(format!(
                    "temperature.filter is taken from {}, but {key} of {} was fitted with another filter \
                     and is wrong with this one: repeat one of the fits with the other's filter",
                    chosen.name(),
                    source.name()
                ));
            }
        }
    }
}

impl<'a> Part<'a> {
    fn of(written: &'a Written, base: &Written) -> Result<Self, Error> {
        let mut of_base = weights::stated(&base.document, &written.document)?;
        of_base.retain(|key, _| is_bias(&group(key)));
        Ok(Self { written, sections: sections(tree(&written.document)?), of_base })
    }

    fn name(&self) -> &'a str {
        &self.written.name
    }

    fn filter(&self) -> Option<&Filter> {
        self.written.document.temperature.filter.as_ref()
    }

    /// Whether it has made what it states otherwise than the base: one that was made from its log alone states the rest as every first
    /// document does, and thermometers and their filter by what its log happens to be, which no static term rests on.
    fn has_made(&self, base: &Self, key: &str) -> bool {
        let (before, value) = (base.sections.get(key), self.sections.get(key));
        if value.is_none() || value == before || value == self.of_base.get(key) {
            return false;
        }
        if self.made_from() != Some("") {
            return true;
        }
        if key.starts_with("temperature.") && before.is_some() {
            return self.sections.keys().any(|key| is_dynamic(key)) && key != "temperature.assumed_deg_c";
        }
        let Document { unit, gyro, accel, .. } = &self.written.document;
        let temperature = Temperature { assumed_deg_c: ASSUMED_DEG_C, filter: None, channel: Vec::new() };
        let first = plain(unit, gyro.output, temperature, accel.as_ref().map(|accel| accel.output));
        tree(&first).is_ok_and(|first| sections(first).get(key) != value)
    }

    /// The digest of the document that it was made from, as far as it says.
    fn made_from(&self) -> Option<&str> {
        self.written.document.origin.as_ref()?.details.as_ref()?.get(BASE)?.as_str()
    }
}

/// A part, and what it says of a key; `None` where it does without.
type Said<'a> = (&'a Part<'a>, Option<&'a Value>);

/// Whether a term holds with the temperature filter that it was fitted with only.
fn is_dynamic(key: &str) -> bool {
    ["thermal_rate", "thermal_acceleration", "lag"].iter().any(|term| key.ends_with(&format!(".{term}")))
}

/// Whether a choice is about a key.
fn covers(choice: &str, key: &str) -> bool {
    key.strip_prefix(choice).is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
}

/// Whether what is replaced together are curves over temperature.
fn are_curves(group: &str) -> bool {
    is_bias(group) || group.ends_with(" output")
}

/// Whether two parts say the same of a key; of a bias, with the increment weights of one of them.
fn agree(key: &str, (one, value): &Said<'_>, (other, its): &Said<'_>) -> bool {
    let states = |of: &Part<'_>, weights: &Part<'_>, value: Option<&Value>| {
        let stated = weights::stated(&of.written.document, &weights.written.document);
        stated.is_ok_and(|sections| sections.get(key) == value)
    };
    value == its || (is_bias(&group(key)) && (states(one, other, *its) || states(other, one, *value)))
}

/// Whether what is replaced together is the bias of a gyro.
fn is_bias(group: &str) -> bool {
    group.ends_with(" bias")
}

/// What is in the way. Of two curves over temperature, made each as a whole, none adds to the other.
fn conflict(key: &str, said: &[Said<'_>]) -> String {
    let named = |(part, value): &Said<'_>| {
        let without = if value.is_none() { " (does without it)" } else { "" };
        format!("{}{without}", part.name())
    };
    let parts = said.iter().map(named).collect::<Vec<_>>().join(" and ");
    let first = said.first().map_or("", |(part, _)| part.name());
    let again = if are_curves(&group(key)) {
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
        sheet.notes.clone_from(&self.notes);
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
