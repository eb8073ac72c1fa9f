//! A document as sections that are taken whole, and back.

use std::collections::BTreeMap;

use isotherm_correction::thermal::{ACCEL_TERMS, GYRO_TERMS, Makes, Term};
use toml::{Table, Value};

/// Sections by their key; sensors and channels by their name: `gyro.sensor.x.static_bias`.
pub(crate) type Sections = BTreeMap<String, Value>;

/// Keys that say nothing about the correction.
const ABOUT: [&str; 4] = ["schema", "created", "note", "origin"];

/// Whether a key is about the document itself.
pub(super) fn is_about(key: &str) -> bool {
    ABOUT
        .iter()
        .any(|about| key.strip_prefix(about).is_some_and(|rest| rest.is_empty() || rest.starts_with('.')))
}

/// What is replaced together with a section.
pub(super) fn group(key: &str) -> String {
    // A drift with acceleration is one section with a term along each axis.
    let is_bias = |terms: &[Term], key: &str| {
        terms.iter().any(|term| term.makes == Makes::Bias && term.key.split('.').next() == Some(key))
    };
    let together = match path(key)[..] {
        ["gyro", "sensor", _, term] if term == "trend" || is_bias(&GYRO_TERMS, term) => "bias",
        ["gyro", "sensor", _, term] if term.starts_with("increment_weight") => "weight",
        ["accel", "sensor", _, "scale_factor" | "board_ratio_error"] => "output",
        ["accel", "sensor", _, term] if is_bias(&ACCEL_TERMS, term) => "output",
        [_, "orientation", "rows" | "weights" | "thermal"] => "axes",
        _ => return key.to_owned(),
    };
    format!("{} {together}", key.rsplit_once('.').map_or("", |(of, _)| of))
}

/// The section that a standard error is of, as [`Sigmas`](crate::report::Sigmas) name it: by kind, sensor and what it is of.
pub(crate) fn of_sigma((kind, sensor, of): (&str, &str, &str), has: impl Fn(&str) -> bool) -> String {
    let of_sensor = format!("{kind}.sensor.{sensor}");
    match of {
        "axis_arcsec" => format!("{kind}.orientation.rows"),
        "increment_weight_ppm" => {
            let stated = ["rad_per_rad", "arcsec_per_count"];
            let stated = stated.map(|unit| format!("{of_sensor}.increment_weight_{unit}"));
            stated.into_iter().find(|key| has(key)).unwrap_or_default()
        }
        term => format!("{of_sensor}.{}", term.split('.').next().unwrap_or_default()),
    }
}

/// The parts of a key; the name of a sensor or a channel is one, and may have dots.
fn path(key: &str) -> Vec<&str> {
    if let Some(name) = key.strip_prefix("temperature.channel.") {
        return vec!["temperature", "channel", name];
    }
    let sensor = |kind: &'static str| {
        let (name, term) = key.strip_prefix(kind)?.strip_prefix(".sensor.")?.rsplit_once('.')?;
        Some(vec![kind, "sensor", name, term])
    };
    sensor("gyro").or_else(|| sensor("accel")).unwrap_or_else(|| key.split('.').collect())
}

/// The sections of a document.
pub(crate) fn sections(tree: Table) -> Sections {
    let mut sections = Sections::new();
    take(&[], &Value::Table(tree), &mut sections);
    sections.retain(|key, _| !is_about(key));
    sections
}

/// Takes what stands at a path, or all that is in it.
fn take(path: &[&str], value: &Value, sections: &mut Sections) {
    let holds_sections = matches!(
        path,
        [] | ["temperature" | "gyro" | "accel"]
            | ["temperature", "channel"]
            | ["gyro" | "accel", "orientation" | "sensor"]
            | ["gyro" | "accel", "sensor", _]
    );
    match value {
        Value::Table(table) if holds_sections => {
            for (key, value) in table.iter().filter(|(key, _)| *key != "name") {
                take(&[path, &[key]].concat(), value, sections);
            }
        }
        Value::Array(list) if holds_sections => {
            for entry in list {
                take(&[path, &[name(entry)]].concat(), entry, sections);
            }
        }
        _ => drop(sections.insert(path.join("."), value.clone())),
    }
}

/// The name of an entry of a list.
fn name(entry: &Value) -> &str {
    entry.get("name").and_then(Value::as_str).unwrap_or_default()
}

/// Sets a section of a document's tree, or takes it out; new sensors and channels stand behind the others.
pub(super) fn put(tree: &mut Table, key: &str, value: Option<Value>) {
    put_at(tree, &path(key), value);
}

fn put_at(table: &mut Table, path: &[&str], value: Option<Value>) {
    match (path, value) {
        ([], _) => {}
        ([key], Some(value)) => drop(table.insert((*key).to_owned(), value)),
        ([key], None) => drop(table.remove(*key)),
        ([list @ ("sensor" | "channel"), own, rest @ ..], value) => {
            let list = table.entry(*list).or_insert_with(|| Value::Array(Vec::new()));
            let Value::Array(entries) = list else { return };
            let at = entries.iter().position(|entry| name(entry) == *own).unwrap_or_else(|| {
                entries.push(Value::Table(Table::from_iter([("name".to_owned(), (*own).into())])));
                entries.len() - 1
            });
            match (rest, value) {
                ([], Some(value)) => entries[at] = value,
                ([], None) => drop(entries.remove(at)),
                (rest, value) => {
                    if let Value::Table(entry) = &mut entries[at] {
                        put_at(entry, rest, value);
                    }
                }
            }
        }
        ([key, rest @ ..], value) => {
            let inner = table.entry(*key).or_insert_with(|| Value::Table(Table::new()));
            if let Value::Table(inner) = inner {
                put_at(inner, rest, value);
            }
        }
    }
}
