//! The audit files of a folder, verified as one chain, and the documents that they name: by whoever may read them, while a service writes
//! there or not.

use std::collections::BTreeMap;
use std::fmt;
use std::path::{Path, PathBuf};

use isotherm_protocol::digest::Digest;
use isotherm_protocol::history::AuditEntry;
use isotherm_protocol::history::chain::{Broken, Head, Verifier};
use isotherm_protocol::overlay::base_of;
use serde::Serialize;
use thiserror::Error;

use super::blobs::BlobStore;
use super::folder::Mark;
use super::index::Index;
use super::log::{NAME, full_files};
use super::retention::KEPT_FILES;
use super::{StoreError, read};

/// Most breaks that are kept in words.
const MAX_BREAKS: usize = 100;

/// What was found.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Verification {
    /// The state folder.
    pub folder: PathBuf,
    /// Whether nothing is broken.
    pub holds: bool,
    /// How many audit files there are.
    pub files: usize,
    /// How many entries they have.
    pub entries: u64,
    /// Number of the first entry that is there: older files are removed.
    pub first: Option<u64>,
    /// Number of the first entry with a digest: those before it are of an older version.
    pub begins: Option<u64>,
    /// The last entry and its digest, to be noted elsewhere.
    pub head: Option<Head>,
    /// The first 100 places where the chain is broken.
    pub breaks: Vec<Break>,
    /// How many there are.
    pub broken: u64,
    /// Documents and overlays that a rollback could go to and that are missing or were altered: the first 100.
    pub lost: Vec<Lost>,
}

/// A document or an overlay that is not as it was stored.
#[derive(Debug, Clone, PartialEq, Eq, Error, Serialize)]
#[error(
    "{file} {words}; revision {revision} of unit {unit} needs it: restore it from a backup",
    file = file.display()
)]
pub struct Lost {
    /// Its file.
    pub file: PathBuf,
    /// Serial of the unit that it was accepted for last.
    pub unit: String,
    /// The revision.
    pub revision: u64,
    /// Why it cannot be used.
    pub words: String,
}

/// A place where the chain is broken.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Break {
    /// The audit file.
    pub file: PathBuf,
    /// Line, from 1.
    pub line: u64,
    /// Number of the entry, where it can be read.
    pub number: Option<u64>,
    /// Serial of its unit, where it names one.
    pub unit: Option<String>,
    /// What is broken, and what to do about it.
    pub words: String,
}

/// Verifies the audit files of a state folder; where a digest was noted, that its entry is still there.
///
/// # Errors
/// [`StoreError::Read`]
pub fn verify(folder: &Path, noted: Option<Digest>) -> Result<Verification, StoreError> {
    loop {
        let files = full_files(folder)?;
        let found = once(folder, &files, noted);
        // Otherwise a service has put a full file aside meanwhile.
        if full_files(folder)?.last() == files.last() {
            return found;
        }
    }
}

fn once(folder: &Path, full: &[PathBuf], noted: Option<Digest>) -> Result<Verification, StoreError> {
    // First of all: a service may be writing.
    let written = Mark::last_entry(folder);
    // Only beside as many files as are kept is an older one removed for its age.
    let is_whole = full.len() < KEPT_FILES;
    let mut verifier = if is_whole { Verifier::from_first() } else { Verifier::default() };
    let (mut breaks, mut broken) = (Vec::new(), 0);
    let mut index = Index::default();
    let mut note = |file: &Path, line: u64, found: Option<Broken>| {
        let Some(Broken { number, unit, fault }) = found else { return };
        broken += 1;
        if breaks.len() < MAX_BREAKS {
            breaks.push(Break { file: file.to_owned(), line, number, unit, words: fault.to_string() });
        }
    };
    let mut is_there = noted.is_none();
    let current = folder.join(NAME);
    let mut last_line = 0;
    for file in full.iter().chain([&current]) {
        last_line = 0;
        let read = read::lines(file, |read::Line { number: line, bytes, ended }| {
            // What is being written, or was when the power went, is no entry yet.
            if file == &current && !ended && !AuditEntry::is_whole(bytes) {
                return;
            }
            last_line = line;
            note(file, line, verifier.line(bytes));
            if let Ok(entry) = AuditEntry::from_line(bytes) {
                index.apply(&entry);
            }
            is_there |= verifier.head.is_some_and(|head| noted == Some(head.digest));
        });
        read.map_err(StoreError::read(file))?;
    }
    note(&current, last_line, verifier.end(written));
    if let Some(noted) = noted.filter(|_| !is_there) {
        broken += 1;
        let words = format!(
            "no entry has the noted digest {noted}: the chain was rewritten or cut, or is another service's; compare \
             it with a backup"
        );
        breaks.push(Break { file: current, line: last_line, number: None, unit: None, words });
    }
    let Verifier { entries, first, begins, head, .. } = verifier;
    let lost = lost(folder, &index);
    let (folder, files, holds) = (folder.to_owned(), full.len() + 1, broken == 0 && lost.is_empty());
    Ok(Verification { folder, holds, files, entries, first, begins, head, breaks, broken, lost })
}

/// What can be gone back to, and is not as it was stored.
fn lost(folder: &Path, index: &Index) -> Vec<Lost> {
    let shelves = ["documents", "overlays"].map(|name| BlobStore::Folder(folder.join(name)));
    let [documents, overlays] = &shelves;
    let mut named = BTreeMap::new();
    for (unit, set) in index.all_sets() {
        let below = set.overlay.and_then(|overlay| base_of(&overlays.get(&overlay).ok()??));
        let files = [(documents, Some(set.digest)), (overlays, set.overlay), (documents, below)];
        for (shelf, digest) in files.into_iter().filter_map(|(shelf, digest)| Some((shelf, digest?))) {
            let Some(file) = shelf.file(&digest) else { continue };
            named.insert(file, (shelf, digest, unit, set.revision));
        }
    }
    let lost = named.into_iter().filter_map(|(file, (shelf, digest, unit, revision))| {
        let words = match shelf.get(&digest) {
            Ok(Some(_)) => return None,
            Ok(None) => "is missing".to_owned(),
            Err(StoreError::Corrupt { found, .. }) => format!("was altered: its SHA-256 is {found}"),
            Err(StoreError::Read { source, .. }) => format!("cannot be read: {source}"),
            Err(error) => error.to_string(),
        };
        Some(Lost { file, unit: unit.to_string(), revision, words })
    });
    lost.take(MAX_BREAKS).collect()
}

impl fmt::Display for Break {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}: ", self.file.display(), self.line)?;
        if let Some(number) = self.number {
            write!(f, "entry {number}")?;
            self.unit.iter().try_for_each(|unit| write!(f, " of unit {unit}"))?;
            f.write_str(": ")?;
        }
        f.write_str(&self.words)
    }
}

impl fmt::Display for Verification {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { folder, files, entries, first, begins, head, broken, lost, .. } = self;
        let folder = folder.display();
        let many =
            |count: u64, one: &str, more: &str| format!("{count} {}", if count == 1 { one } else { more });
        let verdict = match broken {
            0 => "the chain holds".to_owned(),
            broken => format!("the chain is broken in {}", many(*broken, "place", "places")),
        };
        let verdict = match lost.len() as u64 {
            0 => verdict,
            lost => format!("{verdict}; {} missing or altered", many(lost, "document", "documents")),
        };
        let in_files = many(*files as u64, "file", "files");
        writeln!(f, "{folder}: {} in {in_files}: {verdict}", many(*entries, "entry", "entries"))?;
        match (first, begins) {
            (Some(first), Some(begins)) if first < begins => {
                writeln!(f, "entries before {begins} have no digest: an older version wrote them")?;
            }
            (Some(_), None) => writeln!(f, "no entry has a digest: an older version wrote them")?,
            (Some(first), _) if *first > 1 && self.holds => {
                writeln!(f, "it begins with entry {first}: older files are gone")?;
            }
            _ => {}
        }
        match head {
            Some(Head { number, digest }) => writeln!(f, "entry {number} has the digest {digest}"),
            None => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests;
