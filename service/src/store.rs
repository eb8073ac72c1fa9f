//! What the service remembers over a restart: the state folder.
//!
//! | file | holds |
//! |---|---|
//! | `lock` | who uses the folder; locked while the service lives |
//! | `audit.jsonl` | every swap, refusal and command, one JSON object a line ([`AuditEntry`]) |
//! | `audit-<number>.jsonl` | full audit files, by the number of their last entry; never written to again |
//! | `audit.torn-<n>` | last lines that a crash has cut in mid-write |
//! | `documents/<sha256>.toml` | every calibration document that was accepted |
//! | `overlays/<sha256>.toml` | every result of a pre-launch calibration |
//!
//! What a function has written is on the disk when it returns; a crash at whatever moment leaves whole documents and whole
//! lines. Everything here waits for the disk, so that it must never be called from a receive thread. A service without a
//! state folder uses [`Store::in_memory`]: the same, and nothing survives.

mod durable;
mod error;
mod history;
mod index;
mod lock;
mod log;
mod opened;
mod scan;
mod shelf;

pub use error::StoreError;
pub use opened::{Damage, Opened, Torn};

use std::collections::VecDeque;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use isotherm_protocol::digest::Digest;
use isotherm_protocol::history::{AuditEntry, AuditEvent, GoodSet};
use isotherm_protocol::key::UnitId;

use index::Index;
use lock::Lock;
use log::{Found, Log};
use shelf::Shelf;

/// How long an audit file becomes before a new one is begun (bytes).
const FULL_BYTES: u64 = 64 << 20;
/// Most entries that are kept where there is no state folder.
const MAX_RECENT: usize = 1000;

/// The state folder, or its stand-in in memory.
#[derive(Debug)]
pub struct Store {
    journal: Journal,
    documents: Shelf,
    overlays: Shelf,
    index: Index,
    /// Number of the next entry.
    next_number: u64,
    /// Length at which a new audit file is begun (bytes).
    full_bytes: u64,
    /// No new file could be begun; told once.
    stuck: bool,
}

/// Where the entries go.
#[derive(Debug)]
enum Journal {
    Folder { path: PathBuf, log: Log, _lock: Lock },
    Memory(VecDeque<AuditEntry>),
}

impl Store {
    /// Opens a state folder for this process alone; it is made if missing. What the audit file was found like is the second
    /// value: damaged lines are skipped, a line that was not written to its end is put aside, and both are told.
    ///
    /// # Errors
    /// [`StoreError::Folder`], [`StoreError::Held`], [`StoreError::Read`] or [`StoreError::Write`].
    pub fn open(folder: &Path) -> Result<(Self, Opened), StoreError> {
        let unusable = |source| StoreError::Folder { path: folder.to_owned(), source };
        durable::make_folder(folder).map_err(unusable)?;
        // Taken before anything else is touched: the files may be another instance's.
        let lock = Lock::take(folder)?;
        durable::sweep(folder).map_err(unusable)?;
        let documents = Shelf::open(folder.join("documents"))?;
        let overlays = Shelf::open(folder.join("overlays"))?;

        let mut opened = Opened::default();
        let mut index = Index::default();
        let mut next_number = 1;
        let log = Log::open(folder, &mut opened, &mut |found| match found {
            Found::Entry(entry) => {
                next_number = next_number.max(entry.number.saturating_add(1));
                index.apply(&entry);
            }
            // Whatever stood there had a number.
            Found::Skipped { number } => {
                next_number = next_number.max(number.unwrap_or(next_number).saturating_add(1));
            }
        })?;
        let journal = Journal::Folder { path: folder.to_owned(), log, _lock: lock };
        let full_bytes = FULL_BYTES;
        Ok((Self { journal, documents, overlays, index, next_number, full_bytes, stuck: false }, opened))
    }

    /// A store that is gone with the process: of documents the newest 64 MiB are kept, of entries the newest 1000.
    #[must_use]
    pub fn in_memory() -> Self {
        Self {
            journal: Journal::Memory(VecDeque::new()),
            documents: Shelf::in_memory(),
            overlays: Shelf::in_memory(),
            index: Index::default(),
            next_number: 1,
            full_bytes: FULL_BYTES,
            stuck: false,
        }
    }

    /// The state folder; `None` for one in memory.
    #[must_use]
    pub fn folder(&self) -> Option<&Path> {
        match &self.journal {
            Journal::Folder { path, .. } => Some(path),
            Journal::Memory(_) => None,
        }
    }

    /// Keeps a calibration document and gives its digest; one that is kept already is left as it is.
    ///
    /// # Errors
    /// [`StoreError::TooLong`], or [`StoreError::Write`].
    pub fn put_document(&mut self, bytes: &[u8]) -> Result<Digest, StoreError> {
        self.documents.put(bytes)
    }

    /// Keeps an overlay, as [`Self::put_document`] does a document.
    ///
    /// # Errors
    /// The same.
    pub fn put_overlay(&mut self, bytes: &[u8]) -> Result<Digest, StoreError> {
        self.overlays.put(bytes)
    }

    /// A calibration document, checked against its digest; `None` where it is not kept.
    ///
    /// # Errors
    /// [`StoreError::Read`], or [`StoreError::Corrupt`] where it has been changed.
    pub fn document(&self, digest: &Digest) -> Result<Option<Vec<u8>>, StoreError> {
        self.documents.get(digest)
    }

    /// An overlay, as [`Self::document`] gives a document.
    ///
    /// # Errors
    /// The same.
    pub fn overlay(&self, digest: &Digest) -> Result<Option<Vec<u8>>, StoreError> {
        self.overlays.get(digest)
    }

    /// Writes an entry down and gives its number; it is on the disk when this returns. Texts and lists are cut to their
    /// bounds. Entries of a unit come in the order of their revisions.
    ///
    /// # Errors
    /// [`StoreError::NotStored`] for an accepted calibration whose document or overlay was not put before; otherwise
    /// [`StoreError::Write`] or [`StoreError::Read`]. Nothing is written then, and a later entry may go well.
    pub fn append(
        &mut self,
        time: SystemTime,
        unit: Option<&UnitId>,
        by: &str,
        event: AuditEvent,
    ) -> Result<u64, StoreError> {
        self.check_stored(&event)?;
        self.begin_anew_if_due(time)?;
        let entry = entry(self.next_number, time, unit, by, event);
        match &mut self.journal {
            Journal::Folder { log, .. } => log.append(&entry.to_line()?)?,
            Journal::Memory(recent) => {
                recent.push_back(entry.clone());
                if recent.len() > MAX_RECENT {
                    recent.pop_front();
                }
            }
        }
        self.index.apply(&entry);
        self.next_number = entry.number.saturating_add(1);
        Ok(entry.number)
    }

    /// Refuses what would not survive a restart.
    fn check_stored(&self, event: &AuditEvent) -> Result<(), StoreError> {
        let AuditEvent::Accepted(accepted) = event else { return Ok(()) };
        let document = Some(accepted.digest).filter(|digest| !self.documents.holds(digest));
        let overlay = accepted.overlay.filter(|digest| !self.overlays.holds(digest));
        document.or(overlay).map_or(Ok(()), |digest| Err(StoreError::NotStored { digest }))
    }

    /// Begins a new audit file where this one is full, empty behind a full one, or no longer ours.
    fn begin_anew_if_due(&mut self, time: SystemTime) -> Result<(), StoreError> {
        let Journal::Folder { log, path, .. } = &mut self.journal else { return Ok(()) };
        let taken_away = log.changed_by_others()?;
        if taken_away {
            tracing::warn!("the audit file in {} was changed by others: a new one is begun", path.display());
        }
        let full = log.grown() >= self.full_bytes;
        let lacks_carried = log.is_empty() && !self.index.is_empty();
        if !(taken_away || full || lacks_carried) {
            return Ok(());
        }
        let mut number = self.next_number;
        let mut lines = String::new();
        for (unit, event) in self.index.carried() {
            lines.push_str(&entry(number, time, unit, "", event).to_line()?);
            number = number.saturating_add(1);
        }
        match log.begin_anew(self.next_number.saturating_sub(1), &lines) {
            Ok(()) => {
                self.next_number = number;
                self.stuck = false;
                Ok(())
            }
            // A full file goes on being written to, rather than refuse what it still has room for.
            Err(error) if full && !taken_away => {
                if !self.stuck {
                    tracing::warn!("the audit file is full and no new one can be begun: {error}");
                }
                self.stuck = true;
                Ok(())
            }
            Err(error) => Err(error),
        }
    }

    /// Units that were ever given a calibration.
    pub fn units(&self) -> impl Iterator<Item = &UnitId> {
        self.index.units()
    }

    /// The calibration that was accepted last for a unit and not withdrawn: what a restart begins with. It may not have come
    /// in force yet, see [`GoodSet::in_force`].
    #[must_use]
    pub fn last_good(&self, unit: &UnitId) -> Option<&GoodSet> {
        self.index.sets(unit).next_back()
    }

    /// Good sets of a unit, the newest first: at most 1000, and the last eight at least.
    pub fn good_sets(&self, unit: &UnitId) -> impl Iterator<Item = &GoodSet> {
        self.index.sets(unit).rev()
    }

    /// The set that a rollback goes to: the newest before the last good one that corrects otherwise. After a rollback it is
    /// the one before that which was gone back to, so that a second rollback goes further back.
    #[must_use]
    pub fn previous(&self, unit: &UnitId) -> Option<&GoodSet> {
        self.index.previous(unit)
    }

    /// The good set of a revision.
    #[must_use]
    pub fn by_revision(&self, unit: &UnitId, revision: u64) -> Option<&GoodSet> {
        self.index.sets(unit).rfind(|set| set.revision == revision)
    }

    /// Highest revision counter that a unit was ever given, withdrawn ones included; 0 where none. The next one is one more.
    #[must_use]
    pub fn highest_revision(&self, unit: &UnitId) -> u64 {
        self.index.highest_revision(unit)
    }

    /// Digest of what was last seen in a file of the watched folder, accepted or refused: the same again is no swap.
    #[must_use]
    pub fn seen_in_folder(&self, path: &str) -> Option<Digest> {
        self.index.seen(path)
    }

    /// The newest entries of a unit, or of all, the oldest of them first: at most `limit`, and no more than 10 000. They are
    /// read from the audit file and the full one before it; carried-over entries are left out where that one is there.
    ///
    /// # Errors
    /// [`StoreError::Read`].
    pub fn history(&self, unit: Option<&UnitId>, limit: usize) -> Result<Vec<AuditEntry>, StoreError> {
        let limit = limit.min(history::MAX_ENTRIES);
        match &self.journal {
            Journal::Folder { log, .. } => {
                let (before, current) = log.files()?;
                let mut newest = history::newest(current, unit, limit, before.is_none())?;
                if let Some(before) = before.filter(|_| newest.len() < limit) {
                    let mut older = history::newest(&before, unit, limit - newest.len(), false)?;
                    older.append(&mut newest);
                    newest = older;
                }
                Ok(newest)
            }
            Journal::Memory(recent) => {
                let of_unit = |entry: &&AuditEntry| {
                    unit.is_none_or(|unit| entry.unit.as_deref() == Some(unit.as_str()))
                };
                let mut newest: Vec<_> = recent.iter().rev().filter(of_unit).take(limit).cloned().collect();
                newest.reverse();
                Ok(newest)
            }
        }
    }
}

/// An entry within its bounds.
fn entry(number: u64, time: SystemTime, unit: Option<&UnitId>, by: &str, event: AuditEvent) -> AuditEntry {
    let unit = unit.map(ToString::to_string);
    AuditEntry { number, time: time.into(), unit, by: by.to_owned(), event }.bounded()
}

#[cfg(test)]
mod tests;
