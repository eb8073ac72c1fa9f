//! Where a merged document's numbers come from: every part's own origin, and what was taken of it.

use std::collections::BTreeMap;

use isotherm_protocol::document::{Created, Log, Origin};
use serde::{Deserialize, Serialize};
use toml::{Table, Value};

use crate::document::{TOOL, Written, command_line};
use crate::error::Error;
use crate::numbers::hull;
use crate::report::Sigmas;

/// Most logs that a document's origin lists; more are in the parts' own origins only.
const MOST_LOGS: usize = 64;

/// A part's own origin, and what was taken of it, as the merged document keeps them.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Part {
    #[serde(flatten)]
    pub(crate) origin: Origin,
    pub(crate) created: Option<Created>,
    note: Option<String>,
    /// Keys of the sections that were taken.
    #[serde(default)]
    pub(crate) taken: Vec<String>,
}

/// The origin of the merged document.
pub(super) fn origin(
    base: &Written,
    parts: &[Written],
    from: &BTreeMap<String, String>,
) -> Result<Origin, Error> {
    let documents: Vec<&Written> = [base].into_iter().chain(parts).collect();
    let (mut kept, mut log) = (Table::new(), Vec::<Log>::new());
    for document in &documents {
        let (name, document) = (&document.name, &document.document);
        let origin = document.origin.clone().unwrap_or_default();
        for one in &origin.log {
            if log.iter().all(|other| other.sha256 != one.sha256) {
                log.push(one.clone());
            }
        }
        let taken = from.iter().filter(|(_, part)| *part == name).map(|(key, _)| key.clone()).collect();
        let part = Part { origin, created: document.created, note: document.note.clone(), taken };
        kept.insert(name.clone(), Value::try_from(part).map_err(|error| Error::document(&error))?);
    }
    log.truncate(MOST_LOGS);
    let mut details = Table::from_iter([("parts".to_owned(), Value::Table(kept))]);
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
