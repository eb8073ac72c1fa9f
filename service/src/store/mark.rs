//! Which revisions may have been given, for the day on which the audit file is lost.
//!
//! Which set holds is said by the audit file alone. This file says no more than that no revision above a number was ever
//! given; it is written before that number is reached, a thousand revisions ahead, so that it costs nothing and is never
//! too low. It is read where the audit file has nothing to say.

use std::io;
use std::path::Path;

use serde::{Deserialize, Serialize};

use super::durable;

/// Name of the file.
const NAME: &str = "revisions.json";
/// How far ahead it is written.
const AHEAD: u64 = 1000;

/// What the file says.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub(super) struct Mark {
    /// No revision of any unit above this one was given.
    reserved: u64,
    /// Revisions up to this one are not given again: the audit file that had them was lost.
    pub(super) floor: u64,
}

impl Mark {
    /// What the folder's file says; nothing where there is none, or one that cannot be read.
    pub(super) fn read(folder: &Path) -> Self {
        let text = std::fs::read_to_string(folder.join(NAME)).unwrap_or_default();
        serde_json::from_str(&text).unwrap_or_default()
    }

    /// Reserves a revision that is about to be given.
    pub(super) fn reserve(&mut self, folder: &Path, revision: u64) -> io::Result<()> {
        if revision <= self.reserved {
            return Ok(());
        }
        let next = Self { reserved: revision.saturating_add(AHEAD), ..*self };
        next.write(folder)?;
        *self = next;
        Ok(())
    }

    /// The audit file was lost: no number that may have been given is given again.
    pub(super) fn lose(&mut self, folder: &Path) -> io::Result<()> {
        let next = Self { floor: self.floor.max(self.reserved), ..*self };
        next.write(folder)?;
        *self = next;
        Ok(())
    }

    /// Writes it into a folder.
    pub(super) fn write(&self, folder: &Path) -> io::Result<()> {
        let text = serde_json::to_string(self)? + "\n";
        durable::write(folder, NAME, text.as_bytes())
    }
}
