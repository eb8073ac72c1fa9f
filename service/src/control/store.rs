//! What the service remembers over a restart: the state folder.
//!
//! | file | holds |
//! |---|---|
//! | `lock` | who uses the folder; locked while the service lives |
//! | `audit.jsonl` | every swap, refusal and command, one JSON object a line ([`AuditEntry`]), chained by digests |
//! | `audit-<number>.jsonl` | full audit files, by the number of their last entry; never written to again |
//! | `audit.torn-<n>` | last lines that a crash has cut in mid-write |
//! | `documents/<sha256>.toml` | every calibration document that was accepted |
//! | `overlays/<sha256>.toml` | every result of a pre-launch calibration |
//! | `revisions.json` | a number that no revision goes beyond, should the audit file be lost |
//! | `last-entry` | the number of the last entry, should the end of the audit file be lost |
//!
//! What a function has written is on the disk when it returns; a crash at whatever moment leaves whole documents and whole
//! lines. Everything here waits for the disk, so that it must never be called from a receive thread. A service without a
//! state folder uses [`Store::in_memory`]: the same, and nothing survives.

mod blobs;
mod durable;
mod error;
mod history;
mod index;
mod keep;
mod lock;
mod log;
mod mark;
mod opened;
mod retention;
mod scan;
mod verify;

pub use error::StoreError;
pub use opened::{Cut, Damage, Emptied, Gap, LostRevision, Opened, Torn};
pub use verify::{Break, Verification, verify};

use std::collections::VecDeque;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use isotherm_protocol::digest::Digest;
use isotherm_protocol::history::{AuditEntry, AuditEvent, GoodSet, Intent};
use isotherm_protocol::key::UnitId;

use blobs::BlobStore;
use index::Index;
use lock::Lock;
use log::{Found, Log};
use mark::Mark;

use crate::control::compressed::CompressedBytes;

/// How long an audit file becomes before a new one is begun (bytes).
const FULL_BYTES: u64 = 64 << 20;
/// Most entries that are kept where there is no state folder.
const MAX_RECENT: usize = 1000;

/// The state folder, or its stand-in in memory.
#[derive(Debug)]
pub struct Store {
    journal: Journal,
    documents: BlobStore,
    overlays: BlobStore,
    index: Index,
    /// Number of the next entry.
    next_number: u64,
    /// Length at which a new audit file is begun (bytes).
    full_bytes: u64,
    /// No new file could be begun; told once.
    stuck: bool,
    /// What may go is to be taken away.
    prune_due: bool,
    /// Lines of the audit file were lost.
    is_damaged: bool,
}

/// Where the entries go.
#[derive(Debug)]
enum Journal {
    Folder { path: PathBuf, log: Log, lock: Lock, mark: Mark },
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
        let being_begun_anew = log::was_being_begun_anew(folder);
        durable::sweep(folder).map_err(unusable)?;
        let documents = BlobStore::open(folder.join("documents"))?;
        let overlays = BlobStore::open(folder.join("overlays"))?;

        let mut opened = Opened::default();
        let mut index = Index::default();
        let mut next_number = 1;
        let log = Log::open(folder, &mut opened, &mut |found| match found {
            Found::Entry(entry) => {
                next_number = next_number.max(entry.number.saturating_add(1));
                index.apply(&entry);
            }
            // Whatever stood there had a number.
            Found::Skipped { number, acceptance } => {
                next_number = next_number.max(number.unwrap_or(next_number).saturating_add(1));
                if let Some((unit, revision)) = acceptance {
                    index.lose(&unit, revision);
                }
            }
        })?;
        let mut mark = Mark::read(folder);
        let unmarked = |source| StoreError::Write { path: folder.to_owned(), source };
        let has_older = log.is_empty_behind_a_full_one()? && !being_begun_anew;
        let kept = documents.count();
        if has_older || (opened.entries == 0 && kept > 0) {
            mark.lose(folder).map_err(unmarked)?;
            // The numbers of what is lost are missed.
            next_number = next_number.max(Mark::last_entry(folder).unwrap_or(0).saturating_add(1));
            let (folder, floor) = (folder.to_owned(), mark.floor);
            opened.emptied = Some(Emptied { folder, documents: kept, has_older, floor });
        // The last line alone may be missing after a crash in mid-write.
        } else if let Some(written) = Mark::last_entry(folder).filter(|written| *written > next_number) {
            mark.lose(folder).map_err(unmarked)?;
            opened.cut = Some(Cut { last: next_number - 1, written, floor: mark.floor });
            next_number = written.saturating_add(1);
        } else if index.highest() > 0 {
            mark.reserve(folder, index.highest()).map_err(unmarked)?;
        }
        index.floor = mark.floor;
        // A calibration that never was a document is in force without an acceptance: that alone is no loss.
        if opened.damaged > 0 {
            let lost = index.lost().map(|(unit, revision)| LostRevision {
                unit: unit.to_string(),
                revision,
                in_its_place: index.sets(unit).next_back().map(|set| set.revision),
            });
            opened.lost = lost.collect();
        }
        let journal = Journal::Folder { path: folder.to_owned(), log, lock, mark };
        let full_bytes = FULL_BYTES;
        let is_damaged = opened.losses().next().is_some() || opened.damaged > 0 || !opened.gaps.is_empty();
        let (stuck, prune_due) = (false, true);
        let store = Self {
            journal,
            documents,
            overlays,
            index,
            next_number,
            full_bytes,
            stuck,
            prune_due,
            is_damaged,
        };
        Ok((store, opened))
    }

    /// A store that is gone with the process: of documents the newest 64 MiB are kept, of entries the newest 1000.
    #[must_use]
    pub fn in_memory() -> Self {
        Self {
            journal: Journal::Memory(VecDeque::new()),
            documents: BlobStore::in_memory(),
            overlays: BlobStore::in_memory(),
            index: Index::default(),
            next_number: 1,
            full_bytes: FULL_BYTES,
            stuck: false,
            prune_due: false,
            is_damaged: false,
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
    /// [`StoreError::TooLong`], [`StoreError::Lost`] or [`StoreError::Write`].
    pub fn put_document(&mut self, bytes: &[u8]) -> Result<Digest, StoreError> {
        self.check_held()?;
        self.documents.put(bytes)
    }

    /// Keeps calibration documents, each under its digest: all of them are on the disk when this returns. Much sooner than
    /// one by one.
    ///
    /// # Errors
    /// As [`Self::put_document`]; some may be kept then.
    pub fn put_documents(&mut self, documents: &[(Digest, CompressedBytes)]) -> Result<(), StoreError> {
        self.check_held()?;
        self.documents.put_all(documents)
    }

    /// Keeps an overlay, as [`Self::put_document`] does a document.
    ///
    /// # Errors
    /// The same.
    pub fn put_overlay(&mut self, bytes: &[u8]) -> Result<Digest, StoreError> {
        self.check_held()?;
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
    /// [`StoreError::Lost`]; [`StoreError::NotStored`] for an accepted calibration whose document or overlay was not put before; otherwise
    /// [`StoreError::Write`] or [`StoreError::Read`]. Nothing is written then, and a later entry may go well.
    pub fn append(
        &mut self,
        time: SystemTime,
        unit: Option<&UnitId>,
        by: &str,
        event: AuditEvent,
    ) -> Result<u64, StoreError> {
        self.append_all(time, [(unit, by, event)])
    }

    /// Writes entries down in their order, as [`Self::append`] does one, and gives the number of the last; all of them are on
    /// the disk when this returns.
    ///
    /// # Errors
    /// The same; of none of them anything is written then.
    pub fn append_all<'e>(
        &mut self,
        time: SystemTime,
        entries: impl IntoIterator<Item = (Option<&'e UnitId>, &'e str, AuditEvent)>,
    ) -> Result<u64, StoreError> {
        let entries: Vec<_> = entries.into_iter().collect();
        self.check_held()?;
        entries.iter().try_for_each(|(_, _, event)| self.check_stored(event))?;
        self.begin_anew_if_due(time)?;
        let revision = |event: &AuditEvent| match event {
            AuditEvent::Accepted(accepted) => Some(accepted.revision),
            _ => None,
        };
        if let (Some(highest), Journal::Folder { path, mark, .. }) =
            (entries.iter().filter_map(|(_, _, event)| revision(event)).max(), &mut self.journal)
        {
            mark.reserve(path, highest).map_err(StoreError::write(path))?;
        }
        let numbered = (self.next_number..).zip(entries);
        let entries: Vec<_> =
            numbered.map(|(number, (unit, by, event))| entry(number, time, unit, by, event)).collect();
        match &mut self.journal {
            Journal::Folder { log, .. } => {
                let mut chain = log.chain;
                let lines: Result<Vec<_>, _> = entries.iter().map(|entry| chain.line(entry)).collect();
                log.append(&lines?.concat())?;
                log.chain = chain;
            }
            Journal::Memory(recent) => {
                recent.extend(entries.iter().cloned());
                recent.drain(..recent.len().saturating_sub(MAX_RECENT));
            }
        }
        for entry in &entries {
            self.index.apply(entry);
        }
        self.next_number = self.next_number.saturating_add(entries.len() as u64);
        if let Journal::Folder { path, .. } = &self.journal {
            Mark::note_entry(path, self.next_number.saturating_sub(1));
        }
        Ok(self.next_number.saturating_sub(1))
    }

    /// Refuses what would not survive a restart.
    fn check_stored(&self, event: &AuditEvent) -> Result<(), StoreError> {
        let AuditEvent::Accepted(accepted) = event else { return Ok(()) };
        let document = Some(accepted.digest).filter(|digest| !self.documents.holds(digest));
        let overlay = accepted.overlay.filter(|digest| !self.overlays.holds(digest));
        document.or(overlay).map_or(Ok(()), |digest| Err(StoreError::NotStored { digest }))
    }

    /// What an operator wants of a unit, by the commands that were carried out.
    #[must_use]
    pub fn intent(&self, unit: &UnitId) -> Option<&Intent> {
        self.index.intent(unit)
    }

    /// Units that were ever given a calibration or a command.
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

    /// Digest of what was last seen in a file of the watched folder, accepted or refused.
    #[must_use]
    pub fn seen_in_folder(&self, path: &str) -> Option<Digest> {
        self.index.seen(path)
    }

    /// Digest of what was last refused in a file of the watched folder, where nothing else was seen in it since.
    #[must_use]
    pub fn refused_in_folder(&self, path: &str) -> Option<Digest> {
        self.index.refused(path)
    }

    /// Digest of what was last refused in a file of the watched folder because of another one that names its unit.
    #[must_use]
    pub fn rival_in_folder(&self, path: &str) -> Option<Digest> {
        self.index.rival(path)
    }

    /// Digest of what the watched folder said for a unit last and was taken, under whatever name: the same again, under
    /// whatever name, is no swap.
    #[must_use]
    pub fn said_by_folder(&self, unit: &UnitId) -> Option<Digest> {
        self.index.said_by_folder(unit)
    }

    /// The file that a document is kept in; `None` where there is no state folder.
    #[must_use]
    pub fn document_file(&self, digest: &Digest) -> Option<PathBuf> {
        self.documents.file(digest)
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
