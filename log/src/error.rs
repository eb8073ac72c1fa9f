//! Everything that can be wrong with a log, or with what it is read by.

use std::io;
use std::path::Path;

use isotherm_protocol::key::{UnitId, UnitIdError};
use isotherm_protocol::raw::BatchError;
use thiserror::Error;

use crate::mapping::Problem;
use crate::text::LogError;

/// Why a log, a mapping or a calibration document cannot be used.
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
    #[error("{}", isotherm_document::listed(.0))]
    Mapping(Vec<Problem>),
    /// A calibration document with problems, one per line.
    #[error("{}", .0.join("\n"))]
    Calibration(Vec<String>),
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
    /// A tick of a text log that no frame can carry.
    #[error("unit {unit}: {source}")]
    Batch {
        /// The unit.
        unit: UnitId,
        /// Why.
        source: BatchError,
    },
    /// A unit that was asked for and that a recording does not have.
    #[error("{recording} has no unit {unit}; it has {there}")]
    NoSuchUnit {
        /// The recordings.
        recording: String,
        /// The unit.
        unit: UnitId,
        /// Those that it has.
        there: String,
    },
    /// A file that is no corrected log of any form.
    #[error(
        "{path} has no corrected ticks: give a recording (MCAP) that has some, or a CSV or wire file of `isotherm-replay correct`"
    )]
    NoCorrectedTicks {
        /// The file.
        path: String,
    },
    /// A log without anything that a command could work on: what it would do.
    #[error("the log has nothing to {0}: no raw and no corrected ticks of the chosen units and times")]
    Nothing(&'static str),
    /// What was given does not go together.
    #[error("{0}")]
    Usage(String),
}

impl Error {
    /// A file that could not be used.
    #[must_use]
    pub fn file(path: &Path, action: &'static str, source: io::Error) -> Self {
        Self::File { path: path.display().to_string(), action, source }
    }

    /// Whether the command line is to blame.
    #[must_use]
    pub fn is_usage(&self) -> bool {
        matches!(self, Self::Usage(_) | Self::Unit { .. })
    }

    /// Whether a mapping or calibration document is.
    #[must_use]
    pub fn is_document(&self) -> bool {
        matches!(self, Self::Mapping(_) | Self::Calibration(_))
    }
}
