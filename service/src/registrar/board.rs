//! What the service's own status shows of the registrar.

use std::sync::{Mutex, PoisonError};

use isotherm_protocol::service_status::{
    BadDocument, FolderState, FolderStatus, MAX_BAD_DOCUMENTS, StoreStatus,
};

use super::work::Work;

/// The present state of folder, store and swaps.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(crate) struct Posted {
    /// Folder of calibrations; `None` where none is configured.
    pub(crate) folder: Option<FolderStatus>,
    /// Documents of it that are not taken.
    pub(crate) bad_documents: Vec<BadDocument>,
    /// State folder; `None` where nothing survives the service.
    pub(crate) store: Option<StoreStatus>,
    /// Calibrations accepted since the start.
    pub(crate) accepted: u64,
    /// Calibrations refused since the start.
    pub(crate) refused: u64,
}

/// Where the registrar posts it, and anybody looks at it.
#[derive(Debug, Default)]
pub(crate) struct Board(Mutex<Posted>);

impl Board {
    /// What is posted.
    pub(crate) fn read(&self) -> Posted {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}

impl Work {
    /// Posts the present state.
    pub(super) fn show(&self) {
        let folder = self.folder.path().map(|path| FolderStatus {
            path: path.display().to_string(),
            state: if self.folder.gone().is_some() { FolderState::Gone } else { FolderState::Watching },
            reason: self.folder.gone().map(ToOwned::to_owned),
        });
        let bad = self.folder.bad().take(MAX_BAD_DOCUMENTS).map(|(file, problems)| BadDocument {
            file: file.display().to_string(),
            problem: problems.first().map(ToString::to_string).unwrap_or_default(),
            problems: problems.len() as u64,
        });
        let posted = Posted {
            folder,
            bad_documents: bad.collect(),
            store: self
                .store
                .folder()
                .map(|path| StoreStatus { path: path.display().to_string(), audit_entries: self.entries }),
            accepted: self.records.values().map(|record| record.accepted).sum(),
            refused: self.refusals.count(),
        };
        *self.board.0.lock().unwrap_or_else(PoisonError::into_inner) = posted;
    }
}
