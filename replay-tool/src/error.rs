//! Everything that can end a command, and the exit code it ends with.

use std::io;
use std::path::Path;

use isotherm_bus::BusError;
use isotherm_cli::Exit;
use thiserror::Error;

/// Why a command ended early.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum Error {
    /// A log, a mapping, a calibration document or another file.
    #[error(transparent)]
    Log(#[from] isotherm_log::error::Error),
    /// A scenario with problems, one per line.
    #[error("{}", .0.join("\n"))]
    Scenario(Vec<String>),
    /// Standard output that cannot be written.
    #[error("cannot write to standard output: {0}")]
    Stdout(#[source] io::Error),
    /// Arguments that do not go together.
    #[error("{0}")]
    Usage(String),
    /// Zenoh.
    #[error(transparent)]
    Bus(#[from] BusError),
    /// No service where one is needed, or none that sends anything back.
    #[error("{0}")]
    Service(String),
    /// A log without a message to work on: what was not done, and what kind of message there is none of.
    #[error(
        "nothing was {0}: there is no {1} of these units, topics and times; `isotherm-replay list LOG` shows what there is"
    )]
    Nothing(&'static str, &'static str),
    /// A log that ends before the tick that was asked for.
    #[error("the log ends at gyro tick {last}, before --from {from}")]
    EndsBefore {
        /// Its last gyro tick.
        last: u64,
        /// What was asked for.
        from: u64,
    },
    /// The asynchronous runtime does not start.
    #[error("cannot start the runtime: {0}")]
    Runtime(#[source] io::Error),
    /// Ctrl-C or a stop signal.
    #[error("stopped by a signal")]
    Stopped,
}

impl Error {
    /// A file that could not be used.
    pub(crate) fn file(path: &Path, action: &'static str, source: io::Error) -> Self {
        isotherm_log::error::Error::file(path, action, source).into()
    }

    /// Whether whoever read the results has gone away, as `head` does: who does has what was wanted.
    pub(crate) fn is_reader_gone(&self) -> bool {
        match self {
            Self::Stdout(source) | Self::Log(isotherm_log::error::Error::File { source, .. }) => {
                source.kind() == io::ErrorKind::BrokenPipe
            }
            _ => false,
        }
    }

    /// The exit code that this error stands for.
    #[must_use]
    pub fn exit(&self) -> Exit {
        match self {
            Self::Log(error) => Exit::blaming(error.is_usage(), error.is_document()),
            Self::Bus(error) => Exit::blaming(error.is_usage(), error.is_configuration()),
            Self::Usage(_) => Exit::Usage,
            Self::Scenario(_) => Exit::BadConfiguration,
            _ => Exit::Failed,
        }
    }
}
