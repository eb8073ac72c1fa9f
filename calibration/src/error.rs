//! Everything that can end a command, and the exit code it ends with.

use std::io;
use std::path::Path;

use thiserror::Error;

/// Why a command ended early.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum Error {
    /// A log, a mapping, a calibration document or another file.
    #[error(transparent)]
    Log(#[from] isotherm_log::error::Error),
    /// The data do not allow what was asked for: every reason, one per line, each with what to do.
    #[error("{}", .0.join("\n"))]
    Refused(Vec<String>),
    /// A document that was made is refused by its own reader; every problem, one per line.
    #[error("the document that was made does not hold:\n{}", .0.join("\n"))]
    Document(Vec<String>),
    /// Arguments that do not go together.
    #[error("{0}")]
    Usage(String),
    /// Standard output that cannot be written.
    #[error("cannot write to standard output: {source}")]
    Stdout {
        /// Why.
        source: io::Error,
    },
}

impl Error {
    /// A file that could not be used.
    #[must_use]
    pub fn file(path: &Path, action: &'static str, source: io::Error) -> Self {
        isotherm_log::error::Error::file(path, action, source).into()
    }

    /// The program's exit code: 1 failed or refused, 2 usage, 78 bad mapping or calibration document.
    #[must_use]
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Log(error) => error.exit_code(),
            Self::Usage(_) => 2,
            _ => 1,
        }
    }
}
