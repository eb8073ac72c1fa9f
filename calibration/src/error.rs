//! Everything that can end a command, and the exit code it ends with.

use std::io;
use std::path::Path;

use isotherm_cli::Exit;
use isotherm_correction::earth::PlaceError;
use thiserror::Error;

use crate::finding::Finding;

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
    /// The same, by kind and place.
    #[error("{}", .0.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n"))]
    Found(Vec<Finding>),
    /// A document that was made is refused by its own reader; every problem, one per line.
    #[error("the new document is invalid:\n{}", .0.join("\n"))]
    Document(Vec<String>),
    /// Arguments that do not go together.
    #[error("{0}")]
    Usage(String),
    /// Everything was done, but logs are cut short: every one of them, where.
    #[error("finished with data loss:\n{}", .0.join("\n"))]
    CutShort(Vec<String>),
    /// Standard output that cannot be written.
    #[error("cannot write to standard output: {source}")]
    Stdout {
        /// Why.
        source: io::Error,
    },
}

/// Everything that is wrong with a stated place or attitude.
impl From<Vec<PlaceError>> for Error {
    fn from(errors: Vec<PlaceError>) -> Self {
        Self::Usage(errors.iter().map(ToString::to_string).collect::<Vec<_>>().join("; "))
    }
}

impl Error {
    /// A file that could not be used.
    pub fn file(path: &Path, action: &'static str, source: io::Error) -> Self {
        isotherm_log::error::Error::file(path, action, source).into()
    }

    /// Data that do not allow what was asked for, for one reason.
    pub fn refused(reason: impl Into<String>) -> Self {
        Self::Refused(vec![reason.into()])
    }

    /// A document that cannot be made, for one reason.
    pub fn document(why: &impl ToString) -> Self {
        Self::Document(vec![why.to_string()])
    }

    /// The same, each reason with the log that it is of.
    pub fn of(self, log: &str) -> Self {
        let named =
            |reasons: Vec<String>| reasons.into_iter().map(|reason| format!("{log}: {reason}")).collect();
        match self {
            Self::Refused(reasons) => Self::Refused(named(reasons)),
            Self::Found(found) => Self::Refused(named(found.iter().map(ToString::to_string).collect())),
            other => other,
        }
    }

    /// The same, with the logs that are cut short where that may be why.
    pub fn beside(self, cuts: &[String]) -> Self {
        match self {
            Self::Refused(mut reasons) => {
                let all = reasons.join("\n");
                reasons.extend(cuts.iter().filter(|words| !all.contains(*words)).cloned());
                Self::Refused(reasons)
            }
            Self::Found(found) => Self::Refused(found.iter().map(ToString::to_string).collect()).beside(cuts),
            other => other,
        }
    }

    /// How a command ends that did everything: well, or with what was refused, or with data loss.
    ///
    /// # Errors
    /// [`Error::Refused`], [`Error::CutShort`].
    pub fn end(refused: Vec<String>, cuts: Vec<String>) -> Result<(), Self> {
        match (refused.is_empty(), cuts.is_empty()) {
            (true, true) => Ok(()),
            (true, false) => Err(Self::CutShort(cuts)),
            (false, _) => Err(Self::Refused(refused).beside(&cuts)),
        }
    }

    /// The exit code that this error stands for.
    pub fn exit(&self) -> Exit {
        match self {
            Self::Log(error) => Exit::blaming(error.is_usage(), error.is_document()),
            Self::Usage(_) => Exit::Usage,
            Self::CutShort(_) => Exit::DataLoss,
            _ => Exit::Failed,
        }
    }
}
