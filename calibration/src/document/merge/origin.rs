//! Where a merged document's numbers come from: every part's own origin, and what was taken of it.

use std::collections::BTreeMap;

use isotherm_protocol::document::{Log, Origin};
use toml::{Table, Value};

use super::sections::of_sigma;
use crate::document::provenance::{BASE, MOST_LOGS, base_of};
use crate::document::show::terms::tree;
use crate::document::{TOOL, Written, command_line};
use crate::error::Error;
use crate::numbers::hull;
use crate::report::Sigmas;

/// The origin of the merged document.
pub(super) fn origin(
    base: &Written,
    parts: &[Written],
    from: &BTreeMap<String, String>,
) -> Result<Origin, Error> {
    let documents: Vec<&Written> = [base].into_iter().chain(parts).collect();
    let (mut kept, mut log) = (Table::new(), Vec::<Log>::new());
    for document in &documents {
        let own = tree(&document.document)?;
        let mut about = own.get("origin").and_then(Value::as_table).cloned().unwrap_or_default();
        let dated = ["created", "note"].into_iter();
        about.extend(dated.filter_map(|key| Some((key.to_owned(), own.get(key)?.clone()))));
        let taken = from.iter().filter(|(_, name)| **name == document.name);
        about.insert("taken".to_owned(), Value::Array(taken.map(|(key, _)| key.as_str().into()).collect()));
        kept.insert(document.name.clone(), Value::Table(about));
        for one in document.document.origin.iter().flat_map(|origin| &origin.log) {
            if log.iter().all(|other| other.sha256 != one.sha256) {
                log.push(one.clone());
            }
        }
    }
    // The others are in the parts' own origins.
    log.truncate(MOST_LOGS);
    let parts = ("parts".to_owned(), Value::Table(kept));
    let mut details = Table::from_iter([parts, (BASE.to_owned(), base_of(Some(base)))]);
    sigmas(&documents, from).write(&mut details);
    let origins = || documents.iter().filter_map(|document| document.document.origin.as_ref());
    Ok(Origin {
        tool: Some(TOOL.to_owned()),
        command: Some(command_line()),
        method: Some("merge".to_owned()),
        range_deg_c: hull(origins().filter_map(|origin| origin.range_deg_c)),
        rate_range_deg_c_per_s: hull(origins().filter_map(|origin| origin.rate_range_deg_c_per_s)),
        log,
        details: Some(details),
        ..Origin::default()
    })
}

/// Standard errors of what was taken, each from where it was taken.
fn sigmas(documents: &[&Written], from: &BTreeMap<String, String>) -> Sigmas {
    let mut sigmas = Sigmas::default();
    for document in documents {
        for (of, values) in Sigmas::of(&document.document).iter() {
            let key = of_sigma(of, |key| from.contains_key(key));
            if from.get(&key).is_some_and(|name| *name == document.name) {
                sigmas.put(of, values.to_vec());
            }
        }
    }
    sigmas
}
