//! Which revisions may have been given, for the day on which the audit file is lost.
//!
//! Which set holds is said by the audit file alone. This file says no more than that no revision above a number was ever
//! given; it is written before that number is reached, a thousand revisions ahead, so that it costs nothing and is never
//! too low. It is read where the audit file has nothing to say.

use std::fs::File;
use std::io;
use std::os::unix::fs::FileExt;
use std::path::Path;

use serde::{Deserialize, Serialize};

use super::durable;
use isotherm_document::file::check_regular;

/// Name of the file.
const NAME: &str = "revisions.json";
/// Name of the file with the number of the last entry.
const LAST_ENTRY: &str = "last-entry";
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
        let path = folder.join(NAME);
        let text = check_regular(&path).and_then(|()| std::fs::read_to_string(path)).unwrap_or_default();
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

    /// Number of the last entry that was written into a folder, as far as it is known.
    pub(super) fn last_entry(folder: &Path) -> Option<u64> {
        let path = folder.join(LAST_ENTRY);
        check_regular(&path).ok()?;
        std::fs::read_to_string(path).ok()?.trim_start_matches('0').trim().parse().ok()
    }

    /// Notes the number of an entry that was written: should the end of the audit file be lost, its length tells nothing.
    ///
    /// Not waited for. Where it is lost with the power it says less than was written, which is no worse than without it.
    pub(super) fn note_entry(folder: &Path, number: u64) {
        let path = folder.join(LAST_ENTRY);
        let write = || {
            check_regular(&path)?;
            let file = File::options().write(true).create(true).truncate(false).open(&path)?;
            file.write_all_at(format!("{number:020}\n").as_bytes(), 0)
        };
        if let Err(error) = write() {
            tracing::debug!("{} cannot be written: {error}", path.display());
        }
    }

    /// Writes it into a folder.
    pub(super) fn write(&self, folder: &Path) -> io::Result<()> {
        let text = serde_json::to_string(self)? + "\n";
        durable::write(folder, NAME, text.as_bytes())
    }
}
