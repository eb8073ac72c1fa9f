//! What the service's own status shows of the swap manager.

use std::sync::{Arc, Mutex, PoisonError};

use isotherm_document::few;
use isotherm_protocol::escape::shown;
use isotherm_protocol::history::GoodSet;
use isotherm_protocol::key::UnitId;
use isotherm_protocol::service_status::{
    BadDocument, FolderState, FolderStatus, MAX_BAD_DOCUMENTS, ServiceStatus, StoreStatus,
};
use isotherm_protocol::status::Fault;

use super::manager::Worker;

/// Kind of the fault of a state folder that cannot be written.
pub(crate) const STATE_FOLDER: &str = "state_folder";
/// Kind of the fault of units whose calibration that was accepted last could not be put in force again.
pub(crate) const OLDER: &str = "older_calibration";
/// Kind of the fault of units whose calibration would be refused today.
pub(crate) const UNTRUSTED: &str = "untrusted_calibration";
/// Kind of the fault of units whose calibration in force is not in the audit file.
pub(crate) const NOT_IN_FILE: &str = "unwritten_calibration";
/// Kind of the fault of units whose history at the other instance could not be copied.
const UNCOPIED: &str = "uncopied_history";
/// Kind of the fault of units whose calibration that was accepted last does not hold, for an instance published without it.
const SET_ASIDE: &str = "set_aside_calibration";
/// Kind of the fault of documents that are good and could not be written down.
pub(crate) const UNWRITTEN: &str = "unwritten_documents";

/// Where the swap manager posts its part of the service's status, and anybody looks at it: folders, swaps, and the faults that last until
/// somebody does something about them, which have no time.
#[derive(Debug, Default)]
pub(crate) struct ControlStatus(Mutex<Arc<ServiceStatus>>);

impl ControlStatus {
    /// What is posted: the same for as long as nothing has changed.
    pub(crate) fn read(&self) -> Arc<ServiceStatus> {
        Arc::clone(&self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

impl Worker {
    /// Posts the present state.
    pub(super) fn show(&self) {
        let (state, reason) = match (&self.folder.gone, &self.folder.deaf) {
            (Some(reason), _) => (FolderState::Gone, Some(reason.clone())),
            (None, Some(reason)) => (FolderState::Polling, Some(reason.clone())),
            (None, None) => (FolderState::Watching, None),
        };
        let path = self.folder.path.as_ref();
        let calibrations = path.map(|path| FolderStatus { path: shown(&path.display()), state, reason });
        let bad = self.folder.bad().take(MAX_BAD_DOCUMENTS).map(|(file, problems)| BadDocument {
            file: shown(&file.display()),
            problem: problems.first().map(ToString::to_string).unwrap_or_default(),
            problems: problems.len() as u64,
        });
        let posted = ServiceStatus {
            calibrations,
            bad_documents: bad.collect(),
            store: self.store.folder().map(|path| StoreStatus {
                path: shown(&path.display()),
                audit_entries: self.store.last_number(),
            }),
            faults: self.faults(),
            swaps_accepted: self.accepted,
            swaps_refused: self.refusals.count,
            ..ServiceStatus::default()
        };
        let mut control_status = self.control_status.0.lock().unwrap_or_else(PoisonError::into_inner);
        if **control_status != posted {
            *control_status = Arc::new(posted);
        }
    }

    /// That a set was accepted and does not hold, and how it is put in force.
    pub(super) fn aside(&self, unit: &UnitId, set: &GoodSet) -> String {
        let holds = self.store.last_good(unit).map_or(0, |good| good.revision);
        let document = self.store.document_name(&set.digest, || "DOCUMENT".to_owned());
        format!(
            "unit {unit}: revision {} (sha256 {}) was accepted, but an instance that did not have it published: revision \
             {holds} is in force; to put the other one in force: isotherm swap {unit} {document}",
            set.revision,
            set.digest.to_string().get(..16).unwrap_or_default(),
        )
    }

    /// What is wrong until somebody does something about it.
    fn faults(&self) -> Vec<Fault> {
        let mut faults = Vec::new();
        let mut add = |kind: &str, count: usize, first| {
            faults.push(Fault { kind: kind.to_owned(), count: count as u64, first, last_unix_ms: 0 });
        };
        if let Some(words) = &self.lost {
            let words = format!("swaps are refused, the state folder cannot be written: {words}");
            add(STATE_FOLDER, 1, words);
        }
        let changed = self.store.changed_by_others().map(ToOwned::to_owned);
        let mut losses = self.losses.iter().map(ToString::to_string).chain(changed);
        if let Some(words) = losses.next() {
            add("audit_file", 1 + losses.count(), words);
        }
        let skipped = self.records.iter().filter_map(|(unit, record)| Some((unit, record.skipped.as_ref()?)));
        if let Some((unit, first)) = skipped.clone().next() {
            add(OLDER, skipped.count(), format!("unit {unit}: {}", first.words));
        }
        let untrusted = self.records.iter().filter(|(_, record)| record.untrusted.is_some());
        let untrusted: Vec<_> = untrusted.map(|(unit, _)| unit.as_str()).collect();
        if !untrusted.is_empty() {
            let words = format!(
                "restored without a signature that is now trusted: {}; `isotherm status UNIT` says what to do",
                few(&untrusted)
            );
            add(UNTRUSTED, untrusted.len(), words);
        }
        if let Some((unit, _)) = self.followed.first() {
            let words = format!(
                "unit {unit}: the calibration or command in force is not in the audit file, and a restart forgets it; it is \
                 tried again: make room on the disk"
            );
            add(NOT_IN_FILE, self.followed.len(), words);
        }
        if let Some(unit) = self.uncopied.first() {
            let words = format!(
                "unit {unit}: the history of the other instance is not copied; it is tried again: make room on the disk"
            );
            add(UNCOPIED, self.uncopied.len(), words);
        }
        let mut aside = self.store.set_aside();
        if let Some((unit, set)) = aside.next() {
            add(SET_ASIDE, 1 + aside.count(), self.aside(unit, set));
        }
        let unwritten = self.folder.unwritten();
        if let Some(first) = unwritten.first() {
            let words = format!(
                "{} could not be written to the state folder and is not in force; it is tried again: make room on \
                 the disk",
                first.display()
            );
            add(UNWRITTEN, unwritten.len(), words);
        }
        faults
    }
}
