//! What can end a bench.

use std::io;
use std::path::{Path, PathBuf};

use thiserror::Error;

/// Why a bench ended early.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum Error {
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
    /// A process of a chain has failed.
    #[error("{part}: {what}")]
    Part {
        /// Which.
        part: &'static str,
        /// What became of it.
        what: String,
    },
    /// A program that is to be measured is not there.
    #[error("{} is not there: build it with `cargo build --release --locked --workspace --bins`", .0.display())]
    Missing(PathBuf),
    /// What came out is not what should have.
    #[error("{subject}: {what}: what it gives is wrong, so its speed is not told")]
    Output {
        /// What was measured.
        subject: String,
        /// What is wrong with it.
        what: String,
    },
    /// Cases of which no figure was told.
    #[error("{}", .0.join("\n"))]
    Failed(Vec<String>),
    /// A session.
    #[error(transparent)]
    Bus(#[from] isotherm_bus::BusError),
    /// Something takes more than it took.
    #[error("{}", .0.join("\n"))]
    Slower(Vec<String>),
}

impl Error {
    pub(crate) fn file(path: &Path, source: io::Error) -> Self {
        Self::File { path: path.to_owned(), source }
    }

    pub(crate) fn zenoh(part: &'static str, error: &zenoh::Error) -> Self {
        Self::Part { part, what: isotherm_bus::words(error) }
    }
}
