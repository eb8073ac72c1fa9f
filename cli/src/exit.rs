//! Exit codes, in one place.

use std::process::ExitCode;

/// How a command ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum Exit {
    /// Everything was done.
    Ok = 0,
    /// It failed; the reason is on stderr.
    Failed = 1,
    /// It was called wrongly.
    Usage = 2,
    /// It finished, but data was lost on the way.
    DataLoss = 3,
    /// A configuration or a calibration document is bad, or refused.
    BadConfiguration = 78,
}

impl Exit {
    /// What an error stands for: whether the command line is to blame, or a file that somebody wrote.
    #[must_use]
    pub fn blaming(command_line: bool, file: bool) -> Self {
        if file {
            Self::BadConfiguration
        } else if command_line {
            Self::Usage
        } else {
            Self::Failed
        }
    }

    /// The end of what was done, with or without loss.
    #[must_use]
    pub fn of_loss(lost: bool) -> Self {
        if lost { Self::DataLoss } else { Self::Ok }
    }

    /// This end, or [`Exit::Failed`] where all seemed well.
    #[must_use]
    pub fn or_failed(self) -> Self {
        if self == Self::Ok { Self::Failed } else { self }
    }
}

impl From<Exit> for ExitCode {
    fn from(exit: Exit) -> Self {
        Self::from(exit as u8)
    }
}
