//! Logs to judge on, and whether the document was made from them.

use std::collections::BTreeSet;

use isotherm_protocol::document::Document;
use toml::Value;

use crate::run::Run;

/// A run, and whether the document was made from it.
#[derive(Debug, Clone)]
pub struct JudgedLog {
    /// The run.
    pub run: Run,
    /// Its digest is among those of the document's origin.
    pub known: bool,
}

/// SHA-256 of all logs that a document names anywhere in its origin, 64 hexadecimal digits each.
#[must_use]
pub fn digests(document: &Document) -> BTreeSet<String> {
    let mut found = BTreeSet::new();
    if let Some(origin) = &document.origin {
        found.extend(origin.log.iter().map(|log| log.sha256.clone()));
        for value in origin.details.iter().flat_map(toml::Table::values) {
            gather(value, &mut found);
        }
    }
    found
}

fn gather(value: &Value, found: &mut BTreeSet<String>) {
    match value {
        Value::Array(values) => values.iter().for_each(|value| gather(value, found)),
        Value::Table(table) => {
            if let Some(Value::String(digest)) = table.get("sha256") {
                found.insert(digest.clone());
            }
            table.values().for_each(|value| gather(value, found));
        }
        _ => {}
    }
}
