//! Exit codes, in one place.

use std::process::ExitCode;

use isotherm_bus::BusError;

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
    /// What an error of the session stands for.
    #[must_use]
    pub fn of_bus(error: &BusError) -> Self {
        if error.is_configuration() {
            Self::BadConfiguration
        } else if error.is_usage() {
            Self::Usage
        } else {
            Self::Failed
        }
    }
}

impl From<Exit> for ExitCode {
    fn from(exit: Exit) -> Self {
        Self::from(exit as u8)
    }
}
