//! Where the numbers of a document come from: `[origin]` of the document.

use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use isotherm_protocol::digest::Digest;
use isotherm_protocol::document::{Log, Origin};
use sha2::{Digest as _, Sha256};

use crate::error::Error;

/// Name and version of this program, as documents state it.
pub const TOOL: &str = concat!("isotherm-calibrate ", env!("CARGO_PKG_VERSION"));

/// The origin of a document made from logs by a command; method, ranges and residuals are the fit's to add.
///
/// # Errors
/// [`Error::Log`] where a log cannot be read.
pub fn origin(logs: &[PathBuf], command: &str) -> Result<Origin, Error> {
    let log = logs.iter().map(|path| log_of(path)).collect::<Result<_, _>>()?;
    Ok(Origin { tool: Some(TOOL.to_owned()), command: Some(command.to_owned()), log, ..Origin::default() })
}

/// Name and SHA-256 of a log.
fn log_of(path: &Path) -> Result<Log, Error> {
    let failed = |source: io::Error| Error::file(path, "read the log", source);
    let mut file = File::open(path).map_err(failed)?;
    let mut hash = Sha256::new();
    let mut block = vec![0; 1 << 16];
    loop {
        match file.read(&mut block).map_err(failed)? {
            0 => break,
            count => hash.update(&block[..count]),
        }
    }
    let name = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    let sha256 = Digest::from(<[u8; 32]>::from(hash.finalize())).to_string();
    Ok(Log { name, sha256 })
}

/// The command line as it was given, for the document.
#[must_use]
pub fn command_line() -> String {
    let mut words = std::env::args();
    let _ = words.next();
    words.fold("isotherm-calibrate".to_owned(), |line, word| {
        if word.is_empty() || word.chars().any(|c| c.is_whitespace() || "'\"\\$`".contains(c)) {
            format!("{line} '{}'", word.replace('\'', r"'\''"))
        } else {
            format!("{line} {word}")
        }
    })
}
