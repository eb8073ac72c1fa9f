//! What can go wrong with the state folder.

use std::io;
use std::path::{Path, PathBuf};

use isotherm_protocol::digest::Digest;
use isotherm_protocol::document::MAX_DOCUMENT_BYTES;
use isotherm_protocol::history::LineError;
use thiserror::Error;

/// Why the state folder cannot be used, or something was not written.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum StoreError {
    /// The folder is missing and cannot be made, or is none.
    #[error(
        "cannot use {path} as state folder: {source}; set `state` to a folder that the service may write to",
        path = path.display()
    )]
    Folder {
        /// The folder.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// Another instance has it.
    #[error(
        "the state folder {path} is in use by {holder}; stop that instance, or give this one another `state`",
        path = path.display()
    )]
    Held {
        /// The folder.
        path: PathBuf,
        /// Who holds it, as its lock file says: "process 4711, started 2026-11-21T08:00:00.000Z".
        holder: String,
    },
    /// It was removed, or another folder is in its place, while the service runs.
    #[error(
        "the state folder {path} is no longer the one that the service opened: {reason}; put it back, or make an \
         empty writable folder there, and the service writes what is in force into it",
        path = path.display()
    )]
    Lost {
        /// Where it was.
        path: PathBuf,
        /// What is there now.
        reason: String,
    },
    /// A file of it cannot be read.
    #[error("cannot read {path}: {source}", path = path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// A file of it cannot be written; what it held before it still holds.
    #[error("cannot write {path}: {source}", path = path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// A stored document is not what it was.
    #[error(
        "{path} was changed after it was stored: its SHA-256 is {found}, must be that of its name; restore or remove \
         it",
        path = path.display()
    )]
    Corrupt {
        /// The file.
        path: PathBuf,
        /// The digest that it has.
        found: Digest,
    },
    /// More than a document may have.
    #[error("the document has {bytes} bytes, may have {MAX_DOCUMENT_BYTES}")]
    TooLong {
        /// How many bytes it has.
        bytes: usize,
    },
    /// A calibration was to be written down as accepted whose document is not stored: it would not survive a restart.
    #[error("document {digest} was accepted, but is not stored")]
    NotStored {
        /// Digest of the document or overlay.
        digest: Digest,
    },
    /// An entry that no line can hold.
    #[error("an entry of the audit file {0}")]
    Line(#[from] LineError),
}

impl StoreError {
    /// For `map_err`: something cannot be read.
    pub(super) fn read(path: &Path) -> impl FnOnce(io::Error) -> Self {
        move |source| Self::Read { path: path.to_owned(), source }
    }

    /// For `map_err`: something cannot be written.
    pub(super) fn write(path: &Path) -> impl FnOnce(io::Error) -> Self {
        move |source| Self::Write { path: path.to_owned(), source }
    }
}
