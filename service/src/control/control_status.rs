//! What the service's own status shows of the swap manager.

use std::sync::{Arc, Mutex, PoisonError};

use isotherm_document::few;
use isotherm_protocol::escape::shown;
use isotherm_protocol::service_status::{
    BadDocument, FolderState, FolderStatus, MAX_BAD_DOCUMENTS, StoreStatus,
};

use super::manager::Worker;

/// Kind of the standing problem of a state folder that cannot be written.
pub(crate) const STATE_FOLDER: &str = "state_folder";
/// Kind of the standing problem of documents that are good and could not be written down.
pub(crate) const UNWRITTEN: &str = "unwritten_documents";

/// The present state of folder, store and swaps.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(crate) struct Posted {
    /// Folder of calibrations; `None` where none is configured.
    pub(crate) folder: Option<FolderStatus>,
    /// Documents of it that are not taken.
    pub(crate) bad_documents: Vec<BadDocument>,
    /// State folder; `None` where nothing survives the service.
    pub(crate) store: Option<StoreStatus>,
    /// What is wrong until somebody does something about it.
    pub(crate) problems: Vec<Standing>,
    /// Swaps accepted since the start.
    pub(crate) accepted: u64,
    /// Swaps refused since the start.
    pub(crate) refused: u64,
}

impl Posted {
    /// The problem of a kind, if there is one.
    pub(crate) fn standing(&self, kind: &str) -> Option<&Standing> {
        self.problems.iter().find(|problem| problem.kind == kind)
    }
}

/// Something that is wrong until somebody does something about it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Standing {
    /// Its kind, as in a fault of the status.
    pub(crate) kind: &'static str,
    /// How many units or things it concerns.
    pub(crate) count: u64,
    /// It in words.
    pub(crate) words: String,
}

/// Where the swap manager posts it, and anybody looks at it.
#[derive(Debug, Default)]
pub(crate) struct ControlStatus(Mutex<Arc<Posted>>);

impl ControlStatus {
    /// What is posted: the same for as long as nothing has changed.
    pub(crate) fn read(&self) -> Arc<Posted> {
        Arc::clone(&self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

impl Worker {
    /// Posts the present state.
    pub(super) fn show(&self) {
        let (state, reason) = match (self.folder.gone(), self.folder.deaf()) {
            (Some(reason), _) => (FolderState::Gone, Some(reason.to_owned())),
            (None, Some(reason)) => (FolderState::Polling, Some(reason.to_owned())),
            (None, None) => (FolderState::Watching, None),
        };
        let folder =
            self.folder.path().map(|path| FolderStatus { path: shown(&path.display()), state, reason });
        let bad = self.folder.bad().take(MAX_BAD_DOCUMENTS).map(|(file, problems)| BadDocument {
            file: shown(&file.display()),
            problem: problems.first().map(ToString::to_string).unwrap_or_default(),
            problems: problems.len() as u64,
        });
        let posted = Posted {
            folder,
            bad_documents: bad.collect(),
            store: self
                .store
                .folder()
                .map(|path| StoreStatus { path: shown(&path.display()), audit_entries: self.entries }),
            problems: self.problems(),
            accepted: self.accepted,
            refused: self.refusals.count(),
        };
        let mut control_status = self.control_status.0.lock().unwrap_or_else(PoisonError::into_inner);
        if **control_status != posted {
            *control_status = Arc::new(posted);
        }
    }

    /// What is wrong until somebody does something about it.
    fn problems(&self) -> Vec<Standing> {
        let lost = self.lost.iter().map(|words| Standing {
            kind: STATE_FOLDER,
            count: 1,
            words: format!("swaps are refused, the state folder cannot be written: {words}"),
        });
        let losses = self.losses.first().map(|(_, words)| Standing {
            kind: "audit_file",
            count: self.losses.len() as u64,
            words: words.clone(),
        });
        let untrusted: Vec<_> = self
            .records
            .iter()
            .filter(|(_, record)| record.untrusted.is_some())
            .map(|(unit, _)| unit.as_str())
            .collect();
        let count = untrusted.len() as u64;
        let untrusted = (count > 0).then(|| Standing {
            kind: "untrusted_calibration",
            count,
            words: format!(
                "restored without a signature that is now trusted: {}; `isotherm status UNIT` says what to do",
                few(untrusted)
            ),
        });
        let unwritten = self.folder.unwritten();
        let unwritten = unwritten.first().map(|first| Standing {
            kind: UNWRITTEN,
            count: unwritten.len() as u64,
            words: format!(
                "{} could not be written to the state folder and is not in force; it is tried again: make room on \
                 the disk",
                first.display()
            ),
        });
        lost.chain(losses).chain(untrusted).chain(unwritten).collect()
    }
}
