//! What can end a bench.

use std::fmt::Display;
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
        subject: &'static str,
        /// What is wrong with it.
        what: String,
    },
    /// A session.
    #[error(transparent)]
    Bus(#[from] isotherm_bus::BusError),
    /// Cases of which no figure was told, or that take more than they took.
    #[error("{}", .0.join("\n"))]
    Failed(Vec<String>),
}

impl Error {
    pub(crate) fn file(path: &Path, source: io::Error) -> Self {
        Self::File { path: path.to_owned(), source }
    }

    pub(crate) fn invalid(path: &Path, what: impl Display) -> Self {
        Self::Invalid { path: path.to_owned(), what: what.to_string() }
    }

    /// For `map_err`: what has become of a part.
    pub(crate) fn of<E: Display>(part: &'static str) -> impl Fn(E) -> Self {
        move |what| Self::Part { part, what: what.to_string() }
    }

    pub(crate) fn zenoh(part: &'static str) -> impl Fn(zenoh::Error) -> Self {
        move |error| Self::Part { part, what: isotherm_bus::words(&error) }
    }
}
