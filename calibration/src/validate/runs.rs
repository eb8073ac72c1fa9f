//! Logs to judge on, and whether the document was made from them.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use isotherm_protocol::document::Document;
use toml::{Table, Value};

use crate::document::{files_of, name_of, origin};
use crate::error::Error;
use crate::runs::Run;

/// A run, and whether the document was made from it.
#[derive(Debug, Clone)]
pub struct JudgedLog {
    /// The run.
    pub run: Run,
    /// It, a part of it, or a folder that it is from, is among the logs of the document's origin.
    pub known: bool,
}

impl JudgedLog {
    /// A run beside the document that is to be judged on it. Logs are known by their SHA-256: the run's files, the folder that it was
    /// given as with the files in it, and a folder around it that the document names.
    ///
    /// # Errors
    /// [`Error::Log`] where a log cannot be read.
    pub fn new(run: Run, document: &Document) -> Result<Self, Error> {
        let named = logs_of(document);
        let mut known = false;
        if !named.is_empty() {
            for path in around(&run, &named)? {
                known |= origin(&[path], "")?.log.iter().any(|log| named.contains_key(&log.sha256));
            }
        }
        Ok(Self { run, known })
    }
}

/// Everything by which a run may be known.
fn around(run: &Run, named: &BTreeMap<String, String>) -> Result<BTreeSet<PathBuf>, Error> {
    let mut paths: BTreeSet<PathBuf> = run.files().iter().chain(run.logs()).cloned().collect();
    let given: Vec<PathBuf> = paths.iter().cloned().collect();
    for path in given {
        if path.is_dir() {
            paths.extend(files_of(&path)?);
            continue;
        }
        // The digest of a folder takes all of its files, so only where the document has one of this name.
        let folder = path.canonicalize().ok().and_then(|path| path.parent().map(Path::to_path_buf));
        let is_named = |folder: &PathBuf| {
            let name = name_of(folder);
            named.values().any(|other| *other == name)
        };
        paths.extend(folder.filter(is_named));
    }
    Ok(paths)
}

/// SHA-256 (64 hexadecimal digits) and name of all logs that a document names anywhere in its origin.
fn logs_of(document: &Document) -> BTreeMap<String, String> {
    let mut found = BTreeMap::new();
    if let Some(origin) = &document.origin {
        found.extend(origin.log.iter().map(|log| (log.sha256.clone(), log.name.clone())));
        origin.details.iter().flat_map(Table::values).for_each(|value| gather(value, &mut found));
    }
    found
}

fn gather(value: &Value, found: &mut BTreeMap<String, String>) {
    match value {
        Value::Array(values) => values.iter().for_each(|value| gather(value, found)),
        Value::Table(table) => {
            if let Some(Value::String(digest)) = table.get("sha256") {
                let name = table.get("name").and_then(Value::as_str).unwrap_or_default();
                found.insert(digest.clone(), name.to_owned());
            }
            table.values().for_each(|value| gather(value, found));
        }
        _ => {}
    }
}
