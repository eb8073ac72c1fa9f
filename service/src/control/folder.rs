//! Documents of the watched folder: each names its unit, and two that name one unit are rivals.
//!
//! What is a swap, and what is none: the folder *says* one document for a unit, the content of the one file that names it.
//! It is a swap when the folder says another content than it said last. The name of the file does not matter: a file that is
//! touched, renamed, moved away and back, or left over of two rivals says nothing new, and what came in over the bus since
//! then stays in force. A text that is put back after another one was taken is something new, as any other text is. What
//! was refused was never said, so that a mistake that is taken back changes nothing. What the folder said last stands in
//! the audit file (`Store::said_by_folder`), so that all of this holds over a restart too. Of a pair each instance has a folder of its
//! own: what the other's said is none of it, and what is new here waits until this instance publishes.
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
    /// Whether its content is new and left to the instance that publishes: taken when this one does.
    left: bool,
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

    /// Files whose documents are left to the instance that publishes their unit.
    fn left(&self) -> Vec<(PathBuf, Option<UnitId>)> {
        let left = self.files.iter().filter(|(_, file)| file.left);
        left.map(|(path, file)| (path.clone(), file.unit.clone())).collect()
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
        let (unit, hint, problems) = (file.unit.take(), file.hint.take(), vec![problem.clone()]);
        *file = File { unit, hint, problems, ..File::default() };
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

    /// Enters what was found wrong with a file that is the only one of its unit.
    pub(super) fn settle(&mut self, path: &Path, problems: Vec<Problem>) {
        if let Some(file) = self.files.get_mut(path) {
            (file.problems, file.rival) = (problems, false);
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
        let named = self.folder.files.get_mut(path).and_then(|file| {
            (file.unwritten, file.left) = (false, false);
            file.unit.clone()
        });
        if let Some(unit) = &named {
            let files = self.folder.naming(unit);
            if files.len() > 1 {
                self.refuse_rivals(unit, &files, at_start);
                return false;
            }
            if let Some((words, _)) = self.intake.is_not_taken(unit) {
                tracing::info!("{} is left alone: {words}", path.display());
                self.folder.settle(path, Vec::new());
                return true;
            }
            if !self.intake.speaks_for(unit) {
                tracing::info!("{} is left to the instance that publishes its unit", path.display());
                self.folder.settle(path, Vec::new());
                self.leave(unit, path, read.digest, at_start);
                return true;
            }
        }
        let problems = self.swap_file(path, read, at_start);
        let good = problems.is_empty();
        self.folder.settle(path, problems);
        good
    }

    /// Leaves a file to the instance that publishes its unit. What is new in it is taken when this one publishes; what was there when
    /// this folder was first read is noted, so that a restart does not take it for a change.
    fn leave(&mut self, unit: &UnitId, path: &Path, digest: Digest, at_start: bool) {
        let source = known_source(path, at_start);
        let was_seen = source.file().and_then(|path| self.store.seen_in_folder(path)).is_some();
        let is_said = self.store.said_by_folder(unit) == Some(digest);
        if is_said {
            return;
        }
        if at_start && !was_seen {
            self.note_said(unit, &source, digest);
        } else if let Some(file) = self.folder.files.get_mut(path) {
            file.left = true;
        }
    }

    /// Notes what this folder says for a unit, where another instance's folder said something else behind it: the file has not changed.
    pub(super) fn say_again(&mut self, unit: &UnitId) {
        let [path] = &*self.folder.naming(unit) else { return };
        let file = self.folder.files.get(path).filter(|file| file.problems.is_empty() && !file.left);
        let Some(digest) = file.and_then(|file| file.digest) else { return };
        if self.store.said_by_folder(unit) != Some(digest) {
            self.note_said(unit, &known_source(path, false), digest);
        }
    }

    /// Writes down what a file holds: not to be taken for a change later, when something else may be in force.
    fn note_said(&mut self, unit: &UnitId, source: &Source, digest: Digest) {
        let Some(path) = source.file() else { return };
        let event = AuditEvent::CarriedFile(CarriedFile { path: path.to_owned(), digest, refused: false });
        if let Err(error) = self.append(Some(unit), "", event) {
            tracing::error!("that {path} was read is not in the audit file: {error}");
        }
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
        if let (SwapOutcome::Unchanged, Some(unit)) = (reply.outcome, &known) {
            self.note_said(unit, &request.source, digest);
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
        let left = self.folder.left().into_iter().map(|(path, _)| path);
        for path in bad.into_iter().chain(left) {
            self.take_again(&path);
        }
    }

    /// Tries the documents again, now and then, that could not be written down, as a disk that was full may have room again; and those
    /// that were left to another instance, once this one publishes.
    pub(super) fn retry_files(&mut self, now: Instant) {
        if now < self.next_retry {
            return;
        }
        self.next_retry = now + RETRY_INTERVAL;
        self.retrying = true;
        for path in self.folder.unwritten() {
            self.take_again(&path);
        }
        self.retrying = false;
        for (path, unit) in self.folder.left() {
            if unit.is_none_or(|unit| self.intake.speaks_for(&unit)) {
                self.take_again(&path);
            }
        }
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

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use isotherm_protocol::control::Schedule;
    use isotherm_protocol::history::{Acceptance, AuditEntry};
    use isotherm_protocol::pair::{Member, Mode};

    use super::*;
    use crate::config::Settings;
    use crate::control::Carried;
    use crate::control::revision::Calibrations;
    use crate::control::store::Store;
    use crate::pair::Pair;
    use crate::receive::intake::Intake;

    /// Beside an instance that publishes, or alone.
    fn intake(settings: &Settings, is_alone: bool) -> Arc<Intake> {
        let outlets = Box::new(|_: &_| Err("there is none".into()));
        let intake = Intake::new(settings.clone(), Calibrations::default(), outlets);
        if is_alone {
            return Arc::new(intake);
        }
        let group = Pair::new(settings, "me".to_owned(), 2, Vec::new()).me().group.clone();
        let (instance, name) = ("other".to_owned(), "other".to_owned());
        let other = Member { instance, name, mode: Mode::Standby, priority: 0, started_unix_ms: 1, group };
        Arc::new(intake.paired_with(Arc::new(Pair::new(settings, "me".to_owned(), 2, vec![other]))))
    }

    #[test]
    fn of_a_standby_s_folder_what_is_new_is_taken_when_it_publishes_and_nothing_else_is() {
        let (folder, unit) = (tempfile::tempdir().unwrap(), UnitId::new("ZLG-0001").unwrap());
        let file = folder.path().join("unit.toml");
        let settings = Settings { calibrations: Some(folder.path().to_owned()), ..Settings::default() };
        let text = |bias: &str| {
            include_str!("../../../config/calibration/ZLG-0001.toml")
                .replace("[0.41, ", &format!("[{bias}, "))
        };
        let changed = |text: String| {
            std::fs::write(&file, &text).unwrap();
            FolderEvent::Changed { file: file.clone(), bytes: text.into_bytes() }
        };
        let (old, theirs, new) = (text("0.41"), text("0.5"), text("0.6"));
        std::fs::write(&file, &old).unwrap();
        let mut worker = Worker::new(&settings, intake(&settings, false), Store::in_memory(), Vec::new());
        assert_eq!(worker.read_folder().unwrap().1, 0);
        worker.folder_event(changed(old.replace("smoothing_s", "smoothign_s")));
        assert_eq!(worker.folder.bad().count(), 1);
        worker.folder_event(changed(old.clone()));
        assert_eq!(worker.folder.bad().count(), 0, "mended");
        // A swap by a file of the other instance's folder.
        let event = AuditEvent::Accepted(Acceptance {
            revision: 2,
            digest: worker.store.put_document(theirs.as_bytes()).unwrap(),
            overlay: None,
            source: Source::Folder { path: "/elsewhere/unit.toml".to_owned() },
            base: None,
            changed: Vec::new(),
            schedule: Schedule::NextTick,
            slew_ms: 0,
        });
        let (time, by) = (std::time::SystemTime::UNIX_EPOCH.into(), String::new());
        let entries = vec![AuditEntry { number: 1, time, unit: Some(unit.to_string()), by, event }];
        assert!(worker.carry(&Carried { unit: unit.clone(), holds: true, entries, kept: BTreeMap::new() }));
        let revision = |worker: &Worker| worker.records[&unit].last().unwrap().number.counter;
        // Alone, with the folder as it was: after a restart, too.
        let mut worker = Worker::new(&settings, intake(&settings, true), worker.store, Vec::new());
        worker.restore();
        worker.read_folder().unwrap();
        assert_eq!(revision(&worker), 2, "this file has not changed");
        worker.intake = intake(&settings, false);
        worker.folder_event(changed(new));
        worker.judge_bad_again();
        worker.retry_files(worker.next_retry);
        assert_eq!(revision(&worker), 2, "left to the other instance");
        let reason = "no permission".to_owned();
        worker.folder_event(FolderEvent::Unreadable { file: file.clone(), reason });
        assert_eq!(worker.folder.left(), [], "nothing to take while it cannot be read");
        worker.folder_event(changed(text("0.6")));
        worker.intake = intake(&settings, true);
        worker.retry_files(worker.next_retry);
        assert_eq!(revision(&worker), 3);
    }
}
