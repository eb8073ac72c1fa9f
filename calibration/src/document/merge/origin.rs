//! Where a merged document's numbers come from: every part's own origin, and what was taken of it.

use std::collections::{BTreeMap, BTreeSet};

use isotherm_protocol::document::Document;
use toml::{Table, Value};

use crate::document::show::terms::tree;
use crate::document::{TOOL, Written, command_line};
use crate::error::Error;
use crate::numbers::hull;
use crate::report::Sigmas;

/// Most logs that a document's origin lists; more are in the parts' own origins only.
const MOST_LOGS: usize = 64;

/// The origin of the merged document.
pub(super) fn origin(
    base: &Written,
    parts: &[Written],
    from: &BTreeMap<String, String>,
) -> Result<Value, Error> {
    let documents: Vec<&Written> = [base].into_iter().chain(parts).collect();
    let (mut kept, mut logs, mut seen) = (Table::new(), Vec::new(), BTreeSet::new());
    for document in &documents {
        let mut own = tree(&document.document)?;
        let mut about =
            own.remove("origin").and_then(|origin| origin.as_table().cloned()).unwrap_or_default();
        for log in about.get("log").and_then(Value::as_array).into_iter().flatten() {
            let digest = log.get("sha256").and_then(Value::as_str).unwrap_or_default();
            if seen.insert(digest.to_owned()) {
                logs.push(log.clone());
            }
        }
        for key in ["created", "note"] {
            if let Some(value) = own.remove(key) {
                about.insert(key.to_owned(), value);
            }
        }
        let sections: Vec<Value> = from
            .iter()
            .filter(|(_, name)| **name == document.name)
            .map(|(key, _)| Value::String(key.clone()))
            .collect();
        about.insert("taken".to_owned(), Value::Array(sections));
        kept.insert(document.name.clone(), Value::Table(about));
    }
    let mut details = Table::new();
    details.insert("parts".to_owned(), Value::Table(kept));
    sigmas(&documents, from).write(&mut details);
    let mut origin = Table::new();
    origin.insert("tool".to_owned(), Value::String(TOOL.to_owned()));
    origin.insert("command".to_owned(), Value::String(command_line()));
    origin.insert("method".to_owned(), Value::String("merge".to_owned()));
    if let Some(range) = widest(&documents, |document| document.origin.as_ref()?.range_deg_c) {
        origin.insert("range_deg_c".to_owned(), range);
    }
    if let Some(range) = widest(&documents, |document| document.origin.as_ref()?.rate_range_deg_c_per_s) {
        origin.insert("rate_range_deg_c_per_s".to_owned(), range);
    }
    logs.truncate(MOST_LOGS);
    if !logs.is_empty() {
        origin.insert("log".to_owned(), Value::Array(logs));
    }
    origin.insert("details".to_owned(), Value::Table(details));
    Ok(Value::Table(origin))
}

/// The range that all documents cover together.
fn widest(documents: &[&Written], of: fn(&Document) -> Option<[f64; 2]>) -> Option<Value> {
    let ranges = documents.iter().filter_map(|document| of(&document.document));
    let [low, high] = hull(ranges)?;
    Some(Value::Array(vec![Value::Float(low), Value::Float(high)]))
}

/// Standard errors of what was taken, each from where it was taken.
fn sigmas(documents: &[&Written], from: &BTreeMap<String, String>) -> Sigmas {
    let mut sigmas = Sigmas::default();
    for document in documents {
        for ((kind, sensor, term), values) in Sigmas::of(&document.document).iter() {
            let key = match term {
                "axis_arcsec" => format!("{kind}.orientation.rows"),
                "increment_weight_ppm" => {
                    let weight = format!("{kind}.sensor.{sensor}.increment_weight");
                    let of = from.keys().find(|key| key.starts_with(&weight) && !key.ends_with("_error"));
                    of.cloned().unwrap_or_default()
                }
                term => format!("{kind}.sensor.{sensor}.{term}"),
            };
            if from.get(&key).is_some_and(|name| *name == document.name) {
                sigmas.put(kind, sensor, term, values.to_vec());
            }
        }
    }
    sigmas
}
