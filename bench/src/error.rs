//! What can end a bench.

use std::io;
use std::path::{Path, PathBuf};

use thiserror::Error;

/// Why a bench ended early.
#[derive(Debug, Error)]
pub(crate) enum Error {
    /// A case gives a wrong result: its speed would say nothing.
    #[error(
        "{case}: {what} is {value:e}, must be at most {limit:e}: what it gives is wrong, so its speed is not measured"
    )]
    Wrong {
        /// The case.
        case: String,
        /// What is wrong.
        what: &'static str,
        /// What it is.
        value: f64,
        /// What it may be.
        limit: f64,
    },
    /// A document or a file with figures does not hold.
    #[error("{}: {what}", path.display())]
    Invalid {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        what: String,
    },
    /// A file cannot be used.
    #[error("{}: {source}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// Instructions cannot be counted.
    #[error("cannot count instructions: {0}")]
    Count(String),
    /// Something takes more than it took.
    #[error("{}", .0.join("\n"))]
    Slower(Vec<String>),
}

impl Error {
    pub(crate) fn file(path: &Path, source: io::Error) -> Self {
        Self::File { path: path.to_owned(), source }
    }
}
