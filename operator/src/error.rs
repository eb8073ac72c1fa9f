//! What can keep an operator's command from being carried out.

use std::path::PathBuf;
use std::time::Duration;

use isotherm_bus::BusError;
use isotherm_cli::Exit;
use isotherm_protocol::key;
use isotherm_protocol::pair::{PairReport, Role};
use isotherm_protocol::status::Status;
use thiserror::Error;

/// Why an operator's command failed.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ConsoleError {
    /// The session cannot be opened, or something cannot be declared on it.
    #[error(transparent)]
    Bus(#[from] BusError),
    /// Nobody answers on a key.
    #[error(
        "no service at {tried} answers on {key} within {}.{} s: start one there, check --namespace, or give its \
         address with --connect HOST:PORT or ISOTHERM_CONNECT",
        waited.as_secs(), waited.subsec_millis() / 100
    )]
    NoAnswer {
        /// The key.
        key: String,
        /// How long it was waited for.
        waited: Duration,
        /// Where it was looked for.
        tried: String,
    },
    /// Nobody answers on a key, though the connection stands.
    #[error(
        "nobody at {tried} answers {name} on {key} within {}.{} s, though connected: check that the service's access \
         control allows the certificate of {name}, that a service runs there, and --namespace",
        waited.as_secs(), waited.subsec_millis() / 100
    )]
    NotAllowed {
        /// The key.
        key: String,
        /// How long it was waited for.
        waited: Duration,
        /// Where it was looked for.
        tried: String,
        /// Common name of the certificate.
        name: String,
    },
    /// A question ended before its time without an answer.
    #[error(
        "{tried} did not answer on {key}: the connection broke, or no service there publishes the unit{}",
        if *is_order {
            ". An order may have been carried out: check `isotherm status` and `isotherm history`, then try again"
        } else {
            "; try again"
        }
    )]
    Ended {
        /// The key.
        key: String,
        /// Where the service is.
        tried: String,
        /// Whether something was to be done.
        is_order: bool,
    },
    /// Only an instance that does not speak for the unit was asked.
    #[error(
        "{name} is the standby for {unit}, which {elsewhere} publishes: give the address of that instance with --connect, \
         or the addresses of both"
    )]
    Standby {
        /// The instance that was asked.
        name: String,
        /// The unit.
        unit: String,
        /// The others of its pair, and where they are.
        elsewhere: String,
    },
    /// The service is there, the unit is not.
    #[error("the service has heard no unit {unit}; it has heard {}", known(units))]
    NoUnit {
        /// The serial asked for.
        unit: String,
        /// The serials that it knows.
        units: Vec<String>,
    },
    /// The service answers with an error.
    #[error("the service answers: {0}")]
    Refused(String),
    /// An answer is not understood.
    #[error("the answer on {key} cannot be read: {reason}; has the service another version?")]
    Answer {
        /// The key.
        key: String,
        /// What is wrong with it.
        reason: String,
    },
    /// A file cannot be read.
    #[error("cannot read {path}: {source}", path = path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// There is nobody to ask, and `--yes` was not given.
    #[error("standard input is not a terminal: give --yes to proceed without confirmation, or --dry-run")]
    Unasked,
    /// Asked, and answered with no.
    #[error("nothing was changed")]
    Declined,
    /// A terminal is needed.
    #[error(
        "standard output is not a terminal, or TERM is dumb: use `isotherm status`, for programs with --json"
    )]
    NoTerminal,
    /// The terminal does not do what it is told.
    #[error("the terminal cannot be used: {0}")]
    Terminal(#[source] std::io::Error),
    /// It was interrupted.
    #[error("interrupted")]
    Interrupted,
    /// What was waited for did not happen.
    #[error("{0}")]
    TimedOut(String),
}

impl ConsoleError {
    /// Of a unit of which no answer came: another instance speaks for it, or the answer was lost on the way.
    pub(super) fn unanswered(
        unit: &str,
        key: &str,
        is_order: bool,
        tried: &str,
        instances: &[PairReport],
    ) -> Self {
        let silent = |report: &PairReport| {
            report.role(unit).filter(|role| *role != Role::Speaking)?;
            let (name, unit) = (report.member.name.clone(), unit.to_owned());
            Some(Self::Standby { name, unit, elsewhere: report.elsewhere()? })
        };
        let ended = || Self::Ended { key: key.to_owned(), tried: tried.to_owned(), is_order };
        instances.iter().find_map(silent).unwrap_or_else(ended)
    }

    /// Of a unit whose status is not among those that came: nobody knows it, or no answer came of it.
    pub(super) fn unlisted(unit: &str, tried: &str, statuses: &[Status], instances: &[PairReport]) -> Self {
        if instances.is_empty() || instances.iter().any(|report| report.role(unit).is_some()) {
            return Self::unanswered(unit, key::ALL_STATUS, false, tried, instances);
        }
        let units = statuses.iter().map(|status| status.unit.clone()).collect();
        Self::NoUnit { unit: unit.to_owned(), units }
    }

    /// The exit code that this error stands for.
    #[must_use]
    pub fn exit(&self) -> Exit {
        match self {
            Self::Unasked | Self::NoTerminal => Exit::Usage,
            Self::Bus(error) => Exit::blaming(error.is_usage(), error.is_configuration()),
            _ => Exit::Failed,
        }
    }
}

fn known(units: &[String]) -> String {
    if units.is_empty() { "none yet".to_owned() } else { units.join(", ") }
}
