//! An entry as a line of JSON with its checksum.
//!
//! The last field of a line is `crc`: the CRC-32 (of zlib and gzip) of the line as it would be without that field, in eight
//! hexadecimal digits. So a line cut off in mid-write, or with a byte turned over, is known for what it is.

use std::fmt::Display;

use serde::Deserialize;
use thiserror::Error;

use super::AuditEntry;
use crate::escape::clipped;

/// Longest line, its line feed included.
pub const MAX_LINE_BYTES: usize = 1 << 17;

/// What of an error of JSON is shown, in characters: it repeats what it does not understand.
const LONGEST_WORDS: usize = 300;
/// What stands before the checksum's digits.
const BEFORE: &str = ",\"crc\":\"";
/// What stands behind them.
const BEHIND: &str = "\"}";

/// Why a line is no entry.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum LineError {
    /// Not UTF-8, or without the checksum at its end: not a line of this kind, or cut off.
    #[error("does not end in its checksum: cut off, or not an audit line")]
    Form,
    /// Longer than any entry.
    #[error("has {bytes} bytes, may have {MAX_LINE_BYTES}")]
    Length {
        /// Its length.
        bytes: usize,
    },
    /// The checksum does not fit: the line was damaged, or written by hand.
    #[error("checksum is {found}, must be {need:08x}: the line was damaged or edited")]
    Checksum {
        /// As it stands in the line.
        found: String,
        /// What the line has.
        need: u32,
    },
    /// Whole, yet not understood: written by a newer version.
    #[error("cannot be read; was it written by a newer version? {words}")]
    Entry {
        /// What JSON says.
        words: String,
        /// Its number, where it has one.
        number: Option<u64>,
    },
}

/// What every entry of whatever version has.
#[derive(Deserialize)]
pub(super) struct Name {
    pub(super) number: u64,
    #[serde(default)]
    pub(super) unit: Option<String>,
}

impl AuditEntry {
    /// The entry as a line without a digest, line feed included; [`Chain::line`](super::chain::Chain::line) writes one with it.
    ///
    /// # Errors
    /// [`LineError::Length`] for an entry that was not [`bounded`](Self::bounded) and is too long.
    pub fn to_line(&self) -> Result<String, LineError> {
        sealed(self.to_json()?)
    }

    pub(super) fn to_json(&self) -> Result<String, LineError> {
        let unwritable = |error: serde_json::Error| LineError::Entry {
            words: error.to_string(),
            number: Some(self.number),
        };
        serde_json::to_string(self).map_err(unwritable)
    }

    /// Reads a line, with or without its line feed.
    ///
    /// # Errors
    /// [`LineError`] where it is damaged or not understood.
    pub fn from_line(line: &[u8]) -> Result<Self, LineError> {
        read(&checked(line)?)
    }

    /// Whether a line is whole, by its checksum.
    #[must_use]
    pub fn is_whole(line: &[u8]) -> bool {
        checked(line).is_ok()
    }
}

/// What a line says.
pub(super) fn read<'j, T: Deserialize<'j>>(json: &'j str) -> Result<T, LineError> {
    serde_json::from_str(json).map_err(|error| LineError::Entry {
        words: clipped(&error.to_string(), LONGEST_WORDS),
        number: serde_json::from_str(json).ok().map(|Name { number, .. }| number),
    })
}

/// A JSON object with one more field, a text.
pub(super) fn with_last(mut json: String, before: &str, text: impl Display) -> String {
    json.pop();
    format!("{json}{before}{text}{BEHIND}")
}

/// A JSON object without its last field, and the text that this is.
pub(super) fn without_last<'j>(json: &'j str, before: &str) -> Option<(String, &'j str)> {
    let (rest, text) = json.strip_suffix(BEHIND)?.rsplit_once(before)?;
    Some((format!("{rest}}}"), text))
}

/// JSON as a line, with its checksum.
pub(super) fn sealed(json: String) -> Result<String, LineError> {
    let crc = crc32fast::hash(json.as_bytes());
    let line = with_last(json, BEFORE, format_args!("{crc:08x}")) + "\n";
    if line.len() > MAX_LINE_BYTES { Err(LineError::Length { bytes: line.len() }) } else { Ok(line) }
}

/// The line without its checksum, if that fits.
pub(super) fn checked(line: &[u8]) -> Result<String, LineError> {
    if line.len() > MAX_LINE_BYTES {
        return Err(LineError::Length { bytes: line.len() });
    }
    let line = str::from_utf8(line).map_err(|_| LineError::Form)?;
    let line = line.strip_suffix('\n').unwrap_or(line);
    let (json, digits) = without_last(line, BEFORE).ok_or(LineError::Form)?;
    let need = crc32fast::hash(json.as_bytes());
    if format!("{need:08x}") == digits {
        Ok(json)
    } else {
        Err(LineError::Checksum { found: digits.chars().take(8).collect(), need })
    }
}
