//! Documents of the watched folder: each names its unit, and two that name one unit are rivals.
//!
//! What is a swap, and what is none: the folder *says* one document for a unit, the content of the one file that names it.
//! It is a swap when the folder says another content than it said last. The name of the file does not matter: a file that is
//! touched, renamed, moved away and back, or left over of two rivals says nothing new, and what came in over the bus since
//! then stays in force. A text that is put back after another one was taken is something new, as any other text is. What
//! was refused was never said, so that a mistake that is taken back changes nothing. What the folder said last stands in
//! the audit file (`Store::said_by_folder`), so that all of this holds over a restart too.
//!
//! A refused document is told at every start for as long as it is there. A unit that has a calibration is not given it by
//! a restart, though it would pass now: the restart may only have forgotten the temperature that spoke against it.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use isotherm_protocol::control::{SwapOptions, SwapOutcome};
use isotherm_protocol::digest::Digest;
use isotherm_protocol::document::Problem;
use isotherm_protocol::escape::shown;
use isotherm_protocol::history::{AuditEvent, CarriedFile, Source};
use isotherm_protocol::key::UnitId;
use isotherm_protocol::overlay;

use super::file::Read;
use super::manager::Worker;
use super::request::Request;
use crate::control::watch::{FolderEvent, read_document};
use isotherm_document::unplaced;

/// Why an overlay in the folder is not taken.
pub(crate) const NO_OVERLAYS: &str =
    "is an overlay, but this folder is for documents: put it in force with `isotherm swap`";
/// Distance of the attempts to write down what could not be.
const RETRY_INTERVAL: Duration = Duration::from_secs(2);

/// What is known of the folder.
#[derive(Debug, Default)]
pub(super) struct Folder {
    pub(super) path: Option<PathBuf>,
    files: BTreeMap<PathBuf, File>,
    /// Files whose documents name a unit.
    naming: BTreeMap<UnitId, BTreeSet<PathBuf>>,
    /// Why it cannot be read.
    pub(super) gone: Option<String>,
    /// Why changes are found by the poll alone.
    pub(super) deaf: Option<String>,
}

/// What is known of a file.
#[derive(Debug, Default)]
struct File {
    /// Unit that a valid document in it names.
    unit: Option<UnitId>,
    /// Unit that it names or named, valid or not.
    hint: Option<UnitId>,
    /// SHA-256 of its content; `None` where it cannot be read.
    digest: Option<Digest>,
    /// Why it is not taken.
    problems: Vec<Problem>,
    /// Whether that is only because of a rival.
    rival: bool,
    /// Whether that is only because it could not be written down: it is tried again.
    unwritten: bool,
}

impl Folder {
    pub(super) fn new(path: Option<PathBuf>) -> Self {
        Self { path, ..Self::default() }
    }

    /// Whether a file has this content.
    pub(super) fn holds(&self, digest: &Digest) -> bool {
        self.files.values().any(|file| file.digest.as_ref() == Some(digest))
    }

    /// Files that are not taken, and why.
    pub(super) fn bad(&self) -> impl Iterator<Item = (&Path, &[Problem])> {
        let bad = self.files.iter().filter(|(_, file)| !file.problems.is_empty());
        bad.map(|(path, file)| (&**path, &*file.problems))
    }

    /// Files whose documents are good and could not be written down.
    pub(super) fn unwritten(&self) -> Vec<PathBuf> {
        let unwritten = self.files.iter().filter(|(_, file)| file.unwritten);
        unwritten.map(|(path, _)| path.clone()).collect()
    }

    /// Enters that the document of a file could not be written down; of a name that is no file's, nothing.
    pub(super) fn note_unwritten(&mut self, path: &Path) {
        if let Some(file) = self.files.get_mut(path) {
            file.unwritten = true;
        }
    }

    /// Files whose documents name a unit.
    fn naming(&self, unit: &UnitId) -> Vec<PathBuf> {
        self.naming.get(unit).into_iter().flatten().cloned().collect()
    }

    /// The first file whose document names a unit, or did while it was valid.
    pub(super) fn first_naming(&self, unit: &UnitId) -> Option<&Path> {
        self.files.iter().find(|(_, file)| file.hint.as_ref() == Some(unit)).map(|(path, _)| path.as_path())
    }

    /// Enters a file that cannot be read; the problem.
    pub(super) fn unreadable(&mut self, path: &Path, reason: &str) -> Problem {
        let problem = unplaced(Some(&path.display().to_string()), format!("cannot be read: {reason}"));
        let file = self.files.entry(path.to_owned()).or_default();
        (file.problems, file.digest, file.unwritten) = (vec![problem.clone()], None, false);
        problem
    }

    /// Enters a file's content; the unit that it named before.
    pub(super) fn enter(&mut self, path: &Path, read: &Read) -> Option<UnitId> {
        let file = self.files.entry(path.to_owned()).or_default();
        file.digest = Some(read.digest);
        file.hint = read.hint.clone().or_else(|| file.hint.take());
        let before = std::mem::replace(&mut file.unit, read.unit());
        let after = file.unit.clone();
        self.names_no_more(path, before.as_ref());
        if let Some(unit) = after {
            self.naming.entry(unit).or_default().insert(path.to_owned());
        }
        before
    }

    /// Enters that a file is gone; the unit that it named.
    fn remove(&mut self, path: &Path) -> Option<UnitId> {
        let unit = self.files.remove(path).and_then(|file| file.unit);
        self.names_no_more(path, unit.as_ref());
        unit
    }

    fn names_no_more(&mut self, path: &Path, unit: Option<&UnitId>) {
        let Some(unit) = unit else { return };
        let Some(files) = self.naming.get_mut(unit) else { return };
        files.remove(path);
        if files.is_empty() {
            self.naming.remove(unit);
        }
    }

    /// Enters why the document of a file is not taken.
    pub(super) fn refuse(&mut self, path: &Path, problem: Problem) {
        if let Some(file) = self.files.get_mut(path) {
            file.problems = vec![problem];
        }
    }
}

impl Worker {
    /// Takes what the watcher tells.
    pub(super) fn folder_event(&mut self, event: FolderEvent) {
        match event {
            FolderEvent::Changed { file, bytes } => {
                let read = Read::of(&file, &bytes);
                let before = self.folder.enter(&file, &read);
                self.take_file(&file, &read, false);
                self.look_for_survivor(before.as_ref());
            }
            FolderEvent::Unreadable { file, reason } => {
                let problem = self.folder.unreadable(&file, &reason);
                tracing::error!("{problem}; the calibration in force stays");
            }
            FolderEvent::Removed { file } => {
                let before = self.folder.remove(&file);
                if let Some(unit) = &before {
                    tracing::warn!(%unit, "{} is gone; the calibration in force stays", file.display());
                } else {
                    tracing::info!("{} is gone, which was no unit's document", file.display());
                }
                self.look_for_survivor(before.as_ref());
            }
            FolderEvent::Away(reason) => {
                let path = self.folder.path.as_deref().unwrap_or(Path::new("")).display();
                if let Some(reason) = &reason {
                    tracing::error!("{path} cannot be read: {reason}; the calibration in force stays");
                } else {
                    tracing::info!("the folder of calibrations can be read again");
                }
                self.folder.gone = reason;
            }
            // Told by the watcher, who knows how long its polls are apart.
            FolderEvent::Deaf(reason) => self.folder.deaf = reason,
        }
    }

    /// Takes a file that was entered; `at_start` where the service has just started. Whether it is in order.
    pub(super) fn take_file(&mut self, path: &Path, read: &Read, at_start: bool) -> bool {
        let file = self.folder.files.get_mut(path);
        let unit = file.and_then(|file| {
            file.unwritten = false;
            file.unit.clone()
        });
        let naming = unit.map(|unit| (self.folder.naming(&unit), unit));
        if let Some((files, unit)) = naming.filter(|(files, _)| files.len() > 1) {
            self.refuse_rivals(&unit, &files, at_start);
            return false;
        }
        let named = self.folder.files.get(path).and_then(|file| file.unit.clone());
        if let Some((words, _)) = named.as_ref().and_then(|unit| self.intake.is_not_taken(unit)) {
            tracing::info!("{} is left alone: {words}", path.display());
            return true;
        }
        if named.is_some_and(|unit| !self.intake.speaks_for(&unit)) {
            tracing::info!("{} is left to the instance that publishes its unit", path.display());
            return true;
        }
        let problems = self.swap_file(path, read, at_start);
        let good = problems.is_empty();
        if let Some(file) = self.folder.files.get_mut(path) {
            file.problems = problems;
            file.rival = false;
        }
        good
    }

    /// Takes the document of a file through the path of every swap; what was wrong with it.
    fn swap_file(&mut self, path: &Path, read: &Read, at_start: bool) -> Vec<Problem> {
        let name = path.display().to_string();
        let bytes = &*read.bytes();
        let may_be_overlay = read.unit().is_none();
        if may_be_overlay && std::str::from_utf8(bytes).is_ok_and(overlay::is_overlay) {
            let problem = unplaced(Some(&name), NO_OVERLAYS.to_owned());
            tracing::error!("{problem}");
            return vec![problem];
        }
        let file = self.folder.files.get(path);
        let valid = file.and_then(|file| file.unit.clone());
        let known = valid.clone().or_else(|| file.and_then(|file| file.hint.clone()));
        let digest = read.digest;
        let active = |unit: &UnitId| self.records.get(unit).and_then(|record| record.last());
        let said = valid.as_ref().filter(|unit| active(unit).is_some());
        // What it led to may not be in force: its copy in the state folder was damaged.
        let is_lacking = |unit: &UnitId| self.records.get(unit).is_some_and(|record| record.lacks(&digest));
        let said = said.filter(|unit| self.store.said_by_folder(unit) == Some(digest));
        if let Some(unit) = said.filter(|unit| !is_lacking(unit)) {
            if !at_start {
                tracing::info!(%unit, "{name} has the same content as before: the calibration in force stays");
            }
            return Vec::new();
        }
        let source = known_source(path, at_start);
        let refused = source.file().and_then(|path| self.store.refused_in_folder(path)) == Some(digest);
        let other_in_force =
            known.as_ref().and_then(active).is_some_and(|active| active.document.digest() != Some(digest));
        let options = SwapOptions::default();
        let request = Request { unit: known.clone(), name, source, overlay: None, options };
        let found = read.found.as_ref();
        if at_start && refused && other_in_force {
            return told_again(&request, self.decide(&request, bytes, found).problems);
        }
        let reply = self.swap(&request, bytes, found);
        let Request { name, source, .. } = request;
        if let (SwapOutcome::Unchanged, Some(path)) = (reply.outcome, source.file()) {
            // Not to be taken for a change later, when something else may be in force.
            let event =
                AuditEvent::CarriedFile(CarriedFile { path: path.to_owned(), digest, refused: false });
            if let Err(error) = self.append(known.as_ref(), "", event) {
                tracing::error!("that {name} was read is not in the audit file: {error}");
            }
        }
        reply.problems
    }

    /// Tells of files that name one unit: none of them is taken, for which of them holds is for the operator to say.
    fn refuse_rivals(&mut self, unit: &UnitId, files: &[PathBuf], at_start: bool) {
        for path in files {
            let others = files.iter().filter(|other| *other != path);
            let others: Vec<_> = others.map(|other| other.display().to_string()).collect();
            let message = format!(
                "unit {unit} is also named by {}: neither is used, the calibration in force stays; remove all but one",
                others.join(", ")
            );
            let file = Some(path.display().to_string());
            let problem = Problem { file, line: 1, column: 1, key: "unit".to_owned(), message };
            let Some(entry) = self.folder.files.get_mut(path) else { continue };
            if entry.problems.first() != Some(&problem) {
                tracing::error!(%unit, "{problem}");
            }
            entry.problems = vec![problem.clone()];
            entry.rival = true;
            let digest = entry.digest.unwrap_or(Digest([0; 32]));
            self.note_rival(unit, known_source(path, at_start), digest, &problem);
        }
    }

    /// Takes the one file that is left of several that named a unit.
    fn look_for_survivor(&mut self, unit: Option<&UnitId>) {
        let naming = unit.map(|unit| self.folder.naming(unit)).unwrap_or_default();
        let [path] = &*naming else { return };
        if !self.folder.files.get(path).is_some_and(|file| file.rival) {
            return;
        }
        self.take_again(path);
    }

    /// Takes a file that is known, as it is now.
    fn take_again(&mut self, path: &Path) {
        match read_document(path) {
            Ok(bytes) => {
                let read = Read::of(path, &bytes);
                self.folder.enter(path, &read);
                self.take_file(path, &read, false);
            }
            // Something is becoming of it, and the watcher is going to tell what.
            Err(error) => tracing::warn!("{} cannot be read: {error}", path.display()),
        }
    }

    /// Judges the documents again that are not taken: what spoke against them may have passed.
    pub(super) fn judge_bad_again(&mut self) {
        let bad: Vec<_> = self.folder.bad().map(|(path, _)| path.to_owned()).collect();
        for path in bad {
            self.take_again(&path);
        }
    }

    /// Tries the documents again that could not be written down, now and then: a disk that was full may have room again.
    pub(super) fn retry_unwritten(&mut self, now: Instant) {
        if now < self.next_retry {
            return;
        }
        self.next_retry = now + RETRY_INTERVAL;
        self.retrying = true;
        for path in self.folder.unwritten() {
            self.take_again(&path);
        }
        self.retrying = false;
    }
}

/// Says again what is wrong with a document that was refused before the service was restarted, and written down then.
fn told_again(request: &Request, mut problems: Vec<Problem>) -> Vec<Problem> {
    if problems.is_empty() {
        let message = "was refused when it was put there, and a restart does not change that: put it in force \
                       with `isotherm swap`, or replace the file";
        problems.push(unplaced(Some(&request.name), message.to_owned()));
    }
    let unit = request.unit.as_ref().map(ToString::to_string).unwrap_or_default();
    for problem in &problems {
        tracing::error!(unit, "refused: {problem}; the calibration in force stays");
    }
    problems
}

/// A file as a source: by its absolute path, so that it is the same one after a start from another folder, and as the audit
/// file has it.
fn known_source(path: &Path, at_start: bool) -> Source {
    let path = shown(&std::path::absolute(path).unwrap_or_else(|_| path.to_owned()).display());
    if at_start { Source::Start { path } } else { Source::Folder { path } }
}
