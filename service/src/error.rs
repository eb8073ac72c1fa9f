//! What can stop the service.

use std::path::PathBuf;

use isotherm_bus::BusError;
use isotherm_cli::{Exit, failed};
use isotherm_protocol::document::Problem;
use thiserror::Error;

use crate::check::say_problems;
use crate::control::store::StoreError;

/// Why the service did not start, or a command failed.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ServiceError {
    /// A configuration, or a folder that is named with it, cannot be read.
    #[error("cannot read {path}: {source}", path = path.display())]
    Read {
        /// The file or folder.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// A file cannot be written.
    #[error("cannot write {path}: {source}", path = path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// The service configuration is bad.
    #[error("the service configuration is bad: {} problem{}", .0.len(), if .0.len() == 1 { "" } else { "s" })]
    Configuration(Vec<Problem>),
    /// Calibration documents are bad and `strict_start` is set.
    #[error("strict_start is set, and {count} calibration document{} bad", if *.count == 1 { " is" } else { "s are" })]
    BadCalibrations {
        /// How many.
        count: usize,
    },
    /// The folder of calibration documents cannot be read, and there is nothing to go on with.
    #[error(
        "the folder of calibrations {path} cannot be read: {source}; {} (--calibration, or `calibrations` in the \
         configuration; `state` has no last good set, or strict_start is set)",
        to_do(source), path = path.display()
    )]
    NoCalibrations {
        /// The folder.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// The state folder cannot be used.
    #[error(transparent)]
    State(#[from] StoreError),
    /// Metrics cannot be served where they are configured.
    #[error("cannot serve metrics on {address} ([metrics] listen, --metrics): {source}{}", in_use(source))]
    Metrics {
        /// The configured address.
        address: std::net::SocketAddr,
        /// Why.
        source: std::io::Error,
    },
    /// The token of the console in the browser cannot be had.
    #[error("the console's token {path} cannot be read: {source}", path = path.display())]
    Token {
        /// Its file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// The runtime or a thread cannot be started.
    #[error("cannot start a thread: {0}")]
    Thread(#[source] std::io::Error),
    /// Something about the Zenoh session.
    #[error(transparent)]
    Bus(#[from] BusError),
    /// Both instances of a pair connect to each other.
    #[error("pair.other {0}")]
    Other(String),
    /// The other instance of a pair does not connect to this one.
    #[error(
        "the other instance at {other} (pair.other) does not connect to this one: state this one's address there \
         (zenoh.connect)"
    )]
    NotConnected {
        /// Its address.
        other: String,
    },
    /// A subscriber or queryable cannot be declared.
    #[error("cannot declare {key}: {words}", words = isotherm_bus::words(source))]
    Declare {
        /// The key.
        key: &'static str,
        /// What Zenoh says.
        source: zenoh::Error,
    },
}

impl ServiceError {
    /// Says what is wrong, every problem on a line of its own, and gives the exit code.
    pub(crate) fn tell(&self) -> Exit {
        if let Self::Configuration(problems) = self {
            say_problems(problems, &[]);
        }
        failed(self, self.exit())
    }

    /// The exit code that this error stands for.
    #[must_use]
    pub fn exit(&self) -> Exit {
        match self {
            Self::Read { .. }
            | Self::Configuration(_)
            | Self::Other(_)
            | Self::BadCalibrations { .. }
            | Self::NoCalibrations { .. } => Exit::BadConfiguration,
            // A file in the place of the folder.
            Self::State(StoreError::Folder { source, .. })
                if source.kind() == std::io::ErrorKind::NotADirectory =>
            {
                Exit::BadConfiguration
            }
            // An address that is not allowed, not one that somebody else has.
            Self::Metrics { source, .. } if source.kind() == std::io::ErrorKind::Other => {
                Exit::BadConfiguration
            }
            Self::Token { source, .. } if source.kind() == std::io::ErrorKind::InvalidData => {
                Exit::BadConfiguration
            }
            Self::Bus(error) => Exit::blaming(error.is_usage(), error.is_configuration()),
            _ => Exit::Failed,
        }
    }
}

/// What to do about a folder that cannot be read.
fn to_do(error: &std::io::Error) -> &'static str {
    match error.kind() {
        std::io::ErrorKind::NotFound => "create it, or name another",
        std::io::ErrorKind::NotADirectory => "name the folder, not a file",
        std::io::ErrorKind::PermissionDenied => "let the service's user read it",
        _ => "name another",
    }
}

/// What to do about a port that somebody else has.
fn in_use(error: &std::io::Error) -> &'static str {
    match error.kind() {
        std::io::ErrorKind::AddrInUse => "; choose another port, or 0 to let the system choose",
        _ => "",
    }
}
