//! What can keep the bridge from working.

use isotherm_bus::BusError;
use isotherm_cli::Exit;
use isotherm_document::Problem;
use isotherm_service::ServiceError;
use thiserror::Error;

/// Why the bridge did not start, or a command failed.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum Error {
    /// A file cannot be read.
    #[error(transparent)]
    File(#[from] isotherm_log::error::Error),
    /// The mapping is bad.
    #[error("the mapping is bad: {} problem{}", .0.len(), if .0.len() == 1 { "" } else { "s" })]
    Mapping(Vec<Problem>),
    /// Something about a Zenoh session.
    #[error(transparent)]
    Bus(#[from] BusError),
    /// The service in this process.
    #[error(transparent)]
    Service(#[from] ServiceError),
    /// Signals cannot be heard.
    #[error("cannot listen to signals: {0}")]
    Signals(#[source] std::io::Error),
}

impl Error {
    /// The exit code that this error stands for.
    #[must_use]
    pub fn exit(&self) -> Exit {
        match self {
            Self::Mapping(_) => Exit::BadConfiguration,
            Self::Service(error) => error.exit(),
            Self::Bus(error) => Exit::blaming(error.is_usage(), error.is_configuration()),
            Self::File(_) | Self::Signals(_) => Exit::Failed,
        }
    }

    /// Every problem, where it is one of a file.
    #[must_use]
    pub fn problems(&self) -> &[Problem] {
        match self {
            Self::Mapping(problems) | Self::Service(ServiceError::Configuration(problems)) => problems,
            _ => &[],
        }
    }
}
