//! What can go wrong in the demo.

use std::path::PathBuf;

use isotherm_bus::BusError;
use isotherm_protocol::document::Problem;
use isotherm_protocol::key::UnitId;
use isotherm_simulator::ScenarioErrors;
use thiserror::Error;

use isotherm_service::ServiceError;

/// Why the demo did not come to its end.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum DemoError {
    /// A shipped calibration document is bad.
    #[error("a shipped calibration document is bad: {}", words(.0))]
    Document(Vec<Problem>),
    /// A shipped calibration document does not suit the demo.
    #[error("the shipped calibration document {file} cannot be used in the demo")]
    Unusable {
        /// Its name.
        file: &'static str,
    },
    /// A scenario is bad.
    #[error(transparent)]
    Scenario(#[from] ScenarioErrors),
    /// The service did not start.
    #[error(transparent)]
    Service(#[from] ServiceError),
    /// A producer or the subscriber has trouble with Zenoh.
    #[error(transparent)]
    Bus(#[from] BusError),
    /// The status of a unit did not come.
    #[error("no status of unit {0} was received: the service does not answer")]
    Status(UnitId),
    /// The service did not stop in its time.
    #[error("the service did not stop cleanly: see its log")]
    Stop,
    /// A producer's task ended unexpectedly.
    #[error("a producer ended unexpectedly: {0}")]
    Task(#[source] tokio::task::JoinError),
    /// The report cannot be written.
    #[error("cannot write {path}: {source}", path = path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
}

fn words(problems: &[Problem]) -> String {
    problems.iter().map(ToString::to_string).collect::<Vec<_>>().join("; ")
}
