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
    /// It was called wrongly; clap says how.
    Usage = 2,
    /// It finished, but data was lost on the way.
    DataLoss = 3,
    /// A configuration or a calibration document is bad.
    BadConfiguration = 78,
}

impl From<Exit> for ExitCode {
    fn from(exit: Exit) -> Self {
        Self::from(exit as u8)
    }
}
