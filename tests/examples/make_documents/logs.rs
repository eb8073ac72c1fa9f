//! The real logs, read as `isotherm-replay` reads them.

use std::path::{Path, PathBuf};

use isotherm_protocol::document::Log;
use isotherm_tests::logs::{RealLog, events};
use sha2::{Digest, Sha256};

use crate::write::Failure;

/// A log's events.
pub(crate) use isotherm_log::text::LogEvent;

/// Reads a log.
///
/// # Errors
/// Where it cannot be read as its mapping says.
pub(crate) fn read(data: &Path, log: RealLog) -> Result<Vec<LogEvent>, Failure> {
    events(data, log).map_err(|error| Failure::Log { path: log.path(data), message: error.to_string() })
}

/// Name and digest of a log, for the document.
///
/// # Errors
/// Where the file cannot be read.
pub(crate) fn origin(data: &Path, log: RealLog) -> Result<Log, Failure> {
    let path: PathBuf = log.path(data);
    let bytes = std::fs::read(&path).map_err(|source| Failure::File { path: path.clone(), source })?;
    let name = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    let sha256 = Sha256::digest(&bytes).iter().fold(String::new(), |hex, byte| format!("{hex}{byte:02x}"));
    Ok(Log { name, sha256 })
}
