//! A document as sections that are taken whole, and back.

use std::collections::BTreeMap;

use isotherm_correction::thermal::{ACCEL_TERMS, GYRO_TERMS, Makes, Term};
use toml::{Table, Value};

/// Sections by their key; sensors and channels by their name: `gyro.sensor.x.static_bias`.
pub(super) type Sections = BTreeMap<String, Value>;

/// Keys that say nothing about the correction.
const ABOUT: [&str; 4] = ["schema", "created", "note", "origin"];
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
    let parts: Vec<&str> = key.split('.').collect();
    match parts.as_slice() {
        ["gyro", "sensor", name, term] if *term == "trend" || is_bias(&GYRO_TERMS, term) => {
            format!("gyro.sensor.{name} bias")
        }
        ["gyro", "sensor", name, term] if term.starts_with("increment_weight") => {
            format!("gyro.sensor.{name} weight")
        }
        ["accel", "sensor", name, key]
            if matches!(*key, "scale_factor" | "board_ratio_error") || is_bias(&ACCEL_TERMS, key) =>
        {
            format!("accel.sensor.{name} output")
        }
        [kind, "orientation", "rows" | "weights" | "thermal"] => format!("{kind}.orientation axes"),
        _ => key.to_owned(),
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

/// Sections back as a document; sensors and channels in the order of `base`, new ones behind.
pub(super) fn build(base: &Table, sections: &Sections) -> Table {
    let mut tree: Table = base
        .iter()
        .filter(|(key, _)| is_about(key))
        .map(|(key, value)| (key.clone(), value.clone()))
        .collect();
    let mut lists: BTreeMap<&str, Vec<String>> = BTreeMap::new();
    for (list, path) in [
        ("temperature.channel", ["temperature", "channel"]),
        ("gyro.sensor", ["gyro", "sensor"]),
        ("accel.sensor", ["accel", "sensor"]),
    ] {
        let [first, second] = path;
        let entries = base.get(first).and_then(|kind| kind.get(second)?.as_array());
        let names = entries.into_iter().flat_map(|entries| named(entries)).map(|(name, _)| name.to_owned());
        lists.insert(list, names.collect());
    }
    let mut entries: BTreeMap<&str, BTreeMap<String, Table>> = BTreeMap::new();
    for (key, value) in sections {
        let list = lists
            .keys()
            .copied()
            .find(|list| key.strip_prefix(list).is_some_and(|rest| rest.starts_with('.')));
        let Some((list, rest)) =
            list.and_then(|list| Some((list, key.strip_prefix(list)?.strip_prefix('.')?)))
        else {
            insert(&mut tree, key, value.clone());
            continue;
        };
        // The name of a channel may hold a dot; that of a term never does.
        let (name, inner) = match value {
            Value::Table(table) if list == "temperature.channel" => (rest, Some(table)),
            _ => (rest.rsplit_once('.').map_or(rest, |(name, _)| name), None),
        };
        if let Some(names) = lists.get_mut(list).filter(|names| names.iter().all(|known| known != name)) {
            names.push(name.to_owned());
        }
        let entry = entries.entry(list).or_default().entry(name.to_owned()).or_default();
        entry.insert("name".to_owned(), Value::String(name.to_owned()));
        match (inner, rest.rsplit_once('.')) {
            (Some(table), _) => entry.extend(table.clone()),
            (None, Some((_, term))) => {
                entry.insert(term.to_owned(), value.clone());
            }
            (None, None) => {}
        }
    }
    for (list, names) in &lists {
        let mut of_list = entries.remove(list).unwrap_or_default();
        let tables: Vec<Value> =
            names.iter().filter_map(|name| of_list.remove(name)).map(Value::Table).collect();
        if !tables.is_empty() {
            insert(&mut tree, list, Value::Array(tables));
        }
    }
    tree
}

/// Sets the value at a path of keys without names in them.
fn insert(tree: &mut Table, path: &str, value: Value) {
    match path.split_once('.') {
        None => {
            tree.insert(path.to_owned(), value);
        }
        Some((first, rest)) => {
            let inner = tree.entry(first.to_owned()).or_insert_with(|| Value::Table(Table::new()));
            if let Some(table) = inner.as_table_mut() {
                insert(table, rest, value);
            }
        }
    }
}
