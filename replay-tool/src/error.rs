//! Everything that can end a command, and the exit code it ends with.

use std::io;
use std::path::Path;

use isotherm_bus::BusError;
use isotherm_protocol::key::UnitIdError;
use thiserror::Error;

use crate::log::LogError;
use crate::mapping::Problem;

/// Why a command ended early.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum Error {
    /// A file that cannot be opened, read or written.
    #[error("{path}: cannot {action}: {source}")]
    File {
        /// The file.
        path: String,
        /// What was tried.
        action: &'static str,
        /// Why it failed.
        source: io::Error,
    },
    /// A mapping with problems.
    #[error("{}", lines(.0))]
    Mapping(Vec<Problem>),
    /// A calibration document with problems, one per line.
    #[error("{}", .0.join("\n"))]
    Calibration(Vec<String>),
    /// A scenario with problems, one per line.
    #[error("{}", .0.join("\n"))]
    Scenario(Vec<String>),
    /// A log that cannot be read on.
    #[error(transparent)]
    Log(#[from] LogError),
    /// A serial that cannot be one.
    #[error("unit {serial:?} {source}")]
    Unit {
        /// The serial.
        serial: String,
        /// Why.
        source: UnitIdError,
    },
    /// Standard output that cannot be written.
    #[error("cannot write to standard output: {source}")]
    Stdout {
        /// Why.
        source: io::Error,
    },
    /// Arguments that do not go together.
    #[error("{0}")]
    Usage(String),
    /// A tick that does not fit a frame.
    #[error("cannot write a frame: {0}")]
    Codec(#[from] isotherm_protocol::codec::CodecError),
    /// Zenoh.
    #[error(transparent)]
    Bus(#[from] BusError),
    /// The asynchronous runtime does not start.
    #[error("cannot start the runtime: {source}")]
    Runtime {
        /// Why.
        source: io::Error,
    },
    /// Ctrl-C or a stop signal.
    #[error("stopped by a signal")]
    Stopped,
}

impl Error {
    /// A file that could not be used.
    pub(crate) fn file(path: &Path, action: &'static str, source: io::Error) -> Self {
        Self::File { path: path.display().to_string(), action, source }
    }

    /// The program's exit code: 1 failed, 2 usage, 78 bad mapping, calibration document, scenario or Zenoh option.
    #[must_use]
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Usage(_) | Self::Unit { .. } | Self::Bus(BusError::Range { .. }) => 2,
            Self::Mapping(_)
            | Self::Calibration(_)
            | Self::Scenario(_)
            | Self::Bus(BusError::Configuration { .. } | BusError::Option { .. }) => 78,
            _ => 1,
        }
    }
}

/// One line per problem.
fn lines(problems: &[Problem]) -> String {
    let lines: Vec<_> = problems.iter().map(ToString::to_string).collect();
    lines.join("\n")
}
