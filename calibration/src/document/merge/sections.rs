//! A document as sections that are taken whole, and back.

use std::collections::BTreeMap;

use isotherm_correction::thermal::{ACCEL_TERMS, GYRO_TERMS, Makes, Term};
use toml::{Table, Value};

/// Sections by their key; sensors and channels by their name: `gyro.sensor.x.static_bias`.
pub(super) type Sections = BTreeMap<String, Value>;

/// Keys that say nothing about the correction.
const ABOUT: [&str; 4] = ["schema", "created", "note", "origin"];
/// Lists whose entries have names.
const LISTS: [&str; 3] = ["temperature.channel", "gyro.sensor", "accel.sensor"];

/// Whether a key is that of a term of a sensor's bias, all of which one fit makes together.
fn is_bias(terms: &[Term], key: &str) -> bool {
    terms.iter().any(|term| term.key == key && term.makes == Makes::Bias)
}

/// Whether a key is about the document itself.
pub(super) fn is_about(key: &str) -> bool {
    ABOUT
        .iter()
        .any(|about| key.strip_prefix(about).is_some_and(|rest| rest.is_empty() || rest.starts_with('.')))
}

/// What is replaced together with a section.
pub(super) fn group(key: &str) -> String {
    // The name of a sensor may have dots.
    let (path, term) = key.rsplit_once('.').unwrap_or(("", key));
    let makes_output = matches!(term, "scale_factor" | "board_ratio_error") || is_bias(&ACCEL_TERMS, term);
    if path.starts_with("gyro.sensor.") && (term == "trend" || is_bias(&GYRO_TERMS, term)) {
        format!("{path} bias")
    } else if path.starts_with("gyro.sensor.") && term.starts_with("increment_weight") {
        format!("{path} weight")
    } else if path.starts_with("accel.sensor.") && makes_output {
        format!("{path} output")
    } else if path.ends_with(".orientation") && matches!(term, "rows" | "weights" | "thermal") {
        format!("{path} axes")
    } else {
        key.to_owned()
    }
}

/// The sections of a document.
pub(super) fn sections(tree: &Table) -> Sections {
    let mut sections = Sections::new();
    for (key, value) in tree.iter().filter(|(key, _)| !is_about(key)) {
        match (key.as_str(), value) {
            ("temperature" | "gyro" | "accel", Value::Table(table)) => {
                for (inner, value) in table {
                    take(&format!("{key}.{inner}"), inner, value, &mut sections);
                }
            }
            _ => {
                sections.insert(key.clone(), value.clone());
            }
        }
    }
    sections
}

fn take(path: &str, key: &str, value: &Value, sections: &mut Sections) {
    match (key, value) {
        ("sensor", Value::Array(list)) => {
            for (name, table) in named(list) {
                for (inner, value) in table.iter().filter(|(inner, _)| *inner != "name") {
                    sections.insert(format!("{path}.{name}.{inner}"), value.clone());
                }
            }
        }
        ("channel", Value::Array(list)) => {
            for (name, table) in named(list) {
                sections.insert(format!("{path}.{name}"), Value::Table(table.clone()));
            }
        }
        ("orientation", Value::Table(table)) => {
            for (inner, value) in table {
                sections.insert(format!("{path}.{inner}"), value.clone());
            }
        }
        _ => {
            sections.insert(path.to_owned(), value.clone());
        }
    }
}

fn named(list: &[Value]) -> impl Iterator<Item = (&str, &Table)> {
    let tables = list.iter().filter_map(Value::as_table);
    tables.map(|table| (table.get("name").and_then(Value::as_str).unwrap_or_default(), table))
}

/// A document's tree with other sections in the place of its own; new sensors and channels stand behind the others.
pub(super) fn with(mut tree: Table, own: &Sections, other: &Sections) -> Table {
    let gone = own.keys().filter(|key| !other.contains_key(*key)).map(|key| (key, None));
    let new = other.iter().filter(|(key, value)| own.get(*key) != Some(*value));
    for (key, value) in gone.chain(new.map(|(key, value)| (key, Some(value.clone())))) {
        put(&mut tree, key, value);
    }
    tree
}

/// Sets a section, or takes it out.
fn put(tree: &mut Table, key: &str, value: Option<Value>) {
    let parts = |list: &'static str| {
        let (kind, own) = list.split_once('.')?;
        Some((kind, own, key.strip_prefix(list)?.strip_prefix('.')?))
    };
    let Some((kind, own, rest)) = LISTS.into_iter().find_map(parts) else {
        let (path, last) = key.rsplit_once('.').unwrap_or(("", key));
        if let Some(table) = table_at(tree, path) {
            set(table, last, value);
        }
        return;
    };
    let list = table_at(tree, kind).map(|table| table.entry(own).or_insert_with(|| Value::Array(Vec::new())));
    let Some(Value::Array(entries)) = list else { return };
    let (name, term) = match rest.rsplit_once('.') {
        Some((name, term)) if own == "sensor" => (name, Some(term)),
        _ => (rest, None),
    };
    let known = named(entries).position(|(other, _)| other == name);
    let at = known.unwrap_or_else(|| {
        entries.push(Value::Table(Table::from_iter([("name".to_owned(), name.into())])));
        entries.len() - 1
    });
    match (term, value) {
        (Some(term), value) => {
            if let Value::Table(entry) = &mut entries[at] {
                set(entry, term, value);
            }
        }
        (None, Some(value)) => entries[at] = value,
        (None, None) => drop(entries.remove(at)),
    }
}

/// The table at a path of keys without names in them; a new one where there is none.
fn table_at<'a>(tree: &'a mut Table, path: &str) -> Option<&'a mut Table> {
    let mut keys = path.split('.').filter(|key| !key.is_empty());
    keys.try_fold(tree, |table, key| {
        table.entry(key).or_insert_with(|| Value::Table(Table::new())).as_table_mut()
    })
}

fn set(table: &mut Table, key: &str, value: Option<Value>) {
    match value {
        Some(value) => {
            table.insert(key.to_owned(), value);
        }
        None => {
            table.remove(key);
        }
    }
}
