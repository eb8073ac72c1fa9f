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
mod error;
mod folder;
mod index;
mod log;
mod opened;
mod read;
mod retention;
mod trial;
mod verify;

pub use error::StoreError;
pub(crate) use opened::instead;
pub use opened::{Flaw, Loss, Opened, Torn};
pub use verify::{Break, Lost, Verification, verify};

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::path::{Path, PathBuf};
use std::time::{Instant, SystemTime};

use isotherm_protocol::digest::Digest;
use isotherm_protocol::history::chain::Chain;
use isotherm_protocol::history::{AuditEntry, AuditEvent};
use isotherm_protocol::key::UnitId;

use blobs::BlobStore;
use folder::{Lock, Mark};
use index::Index;
use log::Log;
use read::likeness;

use crate::control::compressed::Compressed;

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
    /// Of units whose history other instances send: what is written down, by what it has in common with theirs.
    written: BTreeMap<UnitId, BTreeSet<Digest>>,
    /// Length at which a new audit file is begun (bytes).
    full_bytes: u64,
    /// No new file could be begun; told once.
    stuck: bool,
    /// What may go is to be taken away.
    prune_due: bool,
    /// Lines of the audit file were lost.
    is_damaged: bool,
    /// What somebody else did to the audit file while it was written to, in words.
    changed: Option<String>,
    /// Why the last write failed, until one works.
    write_failure: Option<String>,
    /// When it is tried whether one works.
    next_trial: Instant,
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
        folder::make_folder(folder).map_err(unusable)?;
        // Taken before anything else is touched: the files may be another instance's.
        let lock = Lock::take(folder)?;
        // A crash came between putting a full file aside and beginning a new one: nothing is lost, though there is none.
        let being_begun_anew = folder::is_half_written(folder, log::NAME);
        folder::sweep(folder).map_err(unusable)?;
        let documents = BlobStore::open(folder.join("documents"))?;
        let overlays = BlobStore::open(folder.join("overlays"))?;

        let mut opened = Opened::default();
        let mut index = Index::default();
        let log = Log::open(folder, &mut opened, &mut index)?;
        // The last line alone may be missing after a crash in mid-write.
        let cut = Mark::last_entry(folder).filter(|written| *written > index.next_number());
        let unwritten = |source| StoreError::Write { path: folder.to_owned(), source };
        let mut of_files = Vec::new();
        let mut mark = match Mark::read(folder) {
            Ok(Some(mark)) => mark,
            // No revision was given yet.
            Ok(None) if index.highest() == 0 && cut.is_none() => Mark::default(),
            lost => {
                let reason = lost
                    .map_or_else(|error| format!("cannot be read ({error})"), |_| "is missing".to_owned());
                let mark = Mark::beyond(index.highest());
                mark.write(folder).map_err(unwritten)?;
                of_files.push(Loss::Unmarked { file: folder.join(folder::MARK), reason, floor: mark.floor });
                mark
            }
        };
        let has_older = log.is_empty_behind_a_full_one()? && !being_begun_anew;
        let kept = documents.count();
        if has_older || (opened.entries == 0 && kept > 0) {
            mark.lose(folder).map_err(unwritten)?;
            // The numbers of what is lost are missed.
            index.last_number = index.last_number.max(Mark::last_entry(folder).unwrap_or(0));
            let (folder, floor) = (folder.to_owned(), mark.floor);
            of_files.insert(0, Loss::Emptied { folder, documents: kept, has_older, floor });
        } else if let Some(written) = cut {
            mark.lose(folder).map_err(unwritten)?;
            of_files.insert(0, Loss::Cut { last: index.last_number, written, floor: mark.floor });
            index.last_number = written;
        } else if index.highest() > 0 {
            mark.reserve(folder, index.highest()).map_err(unwritten)?;
        }
        index.floor = mark.floor;
        // A calibration that never was a document is in force without an acceptance: that alone is no loss.
        let lost = index.lost().filter(|_| opened.damaged > 0).map(|(unit, revision)| {
            let in_its_place = index.sets(unit).next_back().map(|set| set.revision);
            Loss::Revision { unit: unit.clone(), revision, in_its_place }
        });
        opened.losses = lost.chain(of_files).collect();
        let journal = Journal::Folder { path: folder.to_owned(), log, lock, mark };
        let is_damaged = !(opened.losses.is_empty() && opened.flaws.is_empty());
        let prune_due = true;
        let store = Self { journal, documents, overlays, index, prune_due, is_damaged, ..Self::in_memory() };
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
            written: BTreeMap::new(),
            full_bytes: FULL_BYTES,
            stuck: false,
            prune_due: false,
            is_damaged: false,
            changed: None,
            write_failure: None,
            next_trial: Instant::now(),
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
        self.write(|store| store.documents.put(bytes))
    }

    /// Keeps calibration documents, each under its digest: all of them are on the disk when this returns. Much sooner than
    /// one by one.
    ///
    /// # Errors
    /// As [`Self::put_document`]; some may be kept then.
    pub(crate) fn put_documents(&mut self, documents: &[(Digest, Compressed)]) -> Result<(), StoreError> {
        self.write(|store| store.documents.put_all(documents))
    }

    /// Keeps an overlay, as [`Self::put_document`] does a document.
    ///
    /// # Errors
    /// The same.
    pub fn put_overlay(&mut self, bytes: &[u8]) -> Result<Digest, StoreError> {
        self.write(|store| store.overlays.put(bytes))
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
        let entries = entries.into_iter().collect();
        self.write(|store| store.write_entries(time, entries))
    }

    fn write_entries(
        &mut self,
        time: SystemTime,
        entries: Vec<(Option<&UnitId>, &str, AuditEvent)>,
    ) -> Result<u64, StoreError> {
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
        let numbered = (self.index.next_number()..).zip(entries);
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
            let unit = entry.unit.as_deref().and_then(|unit| UnitId::new(unit).ok());
            if let Some(written) = unit.and_then(|unit| self.written.get_mut(&unit)) {
                written.insert(likeness(entry));
            }
        }
        if let Journal::Folder { path, .. } = &self.journal {
            Mark::note_entry(path, self.index.last_number);
        }
        Ok(self.index.last_number)
    }

    /// Refuses what would not survive a restart.
    fn check_stored(&self, event: &AuditEvent) -> Result<(), StoreError> {
        let AuditEvent::Accepted(accepted) = event else { return Ok(()) };
        let document = Some(accepted.digest).filter(|digest| !self.documents.holds(digest));
        let overlay = accepted.overlay.filter(|digest| !self.overlays.holds(digest));
        document.or(overlay).map_or(Ok(()), |digest| Err(StoreError::NotStored { digest }))
    }

    /// Refuses to write into a folder that is not the one that was opened.
    fn check_held(&self) -> Result<(), StoreError> {
        let Journal::Folder { path, lock, .. } = &self.journal else { return Ok(()) };
        if lock.is_in(path) {
            return Ok(());
        }
        let reason = if path.is_dir() { "another folder is in its place" } else { "it was removed" };
        Err(StoreError::Lost { path: path.clone(), reason: reason.to_owned() })
    }

    /// Sees to it that what is written down is found again: where the state folder was removed and another one stands in its
    /// place, that one is taken, locked, and given all that holds: these documents and overlays, and an audit file that
    /// begins with what was carried over. Files that it holds already stay, its audit file is put aside. `true` where that
    /// was done.
    ///
    /// No folder is made: where a disk was unmounted it would be made in its place.
    ///
    /// # Errors
    /// [`StoreError::Lost`] while there is none; [`StoreError::Held`] where another instance has it; else as
    /// [`Store::open`]. Nothing can be written down then, and a later call may go well.
    pub(crate) fn keep(
        &mut self,
        time: SystemTime,
        documents: impl IntoIterator<Item: AsRef<[u8]>>,
        overlays: impl IntoIterator<Item: AsRef<[u8]>>,
    ) -> Result<bool, StoreError> {
        let lost = match self.check_held() {
            Ok(()) => {
                // Where that cannot be told, the next entry cannot be written.
                let _ = self.note_change();
                self.try_if_due(Instant::now());
                self.prune_if_due(time);
                return Ok(false);
            }
            Err(lost) => lost,
        };
        let Journal::Folder { path, mark, .. } = &self.journal else { return Ok(false) };
        let (path, mark) = (path.clone(), *mark);
        if !path.is_dir() {
            return Err(lost);
        }
        let lock = Lock::take(&path)?;
        folder::sweep(&path).map_err(StoreError::write(&path))?;
        let mut shelves = [BlobStore::open(path.join("documents"))?, BlobStore::open(path.join("overlays"))?];
        let [of_documents, of_overlays] = &mut shelves;
        documents.into_iter().try_for_each(|bytes| of_documents.put(bytes.as_ref()).map(drop))?;
        overlays.into_iter().try_for_each(|bytes| of_overlays.put(bytes.as_ref()).map(drop))?;
        mark.write(&path).map_err(StoreError::write(&path))?;
        let mut log = Log::open(&path, &mut Opened::default(), &mut Index::default())?;
        let (lines, last_number, chain) = self.carried_lines(time)?;
        log.begin_anew(self.index.last_number, &lines, chain)?;
        Mark::note_entry(&path, last_number);
        self.index.last_number = last_number;
        [self.documents, self.overlays] = shelves;
        self.journal = Journal::Folder { path, log, lock, mark };
        self.write_failure = None;
        Ok(true)
    }

    /// What a new audit file begins with, the number of its last entry, and the chain there.
    fn carried_lines(&self, time: SystemTime) -> Result<(String, u64, Chain), StoreError> {
        let mut number = self.index.last_number;
        let mut lines = String::new();
        let mut chain = match &self.journal {
            Journal::Folder { log, .. } => log.chain,
            Journal::Memory(_) => Chain::default(),
        };
        chain.begin_file();
        for (unit, event) in self.index.carried() {
            number = number.saturating_add(1);
            lines.push_str(&chain.line(&entry(number, time, unit, "", event))?);
        }
        Ok((lines, number, chain))
    }

    /// What somebody else did to the audit file since it was opened, in words: entries may be missing.
    pub(crate) fn changed_by_others(&self) -> Option<&str> {
        self.changed.as_deref()
    }

    /// Whether somebody else has changed the audit file; that it was stays known.
    fn note_change(&mut self) -> Result<bool, StoreError> {
        let Journal::Folder { log, path, .. } = &self.journal else { return Ok(false) };
        let changed = log.changed_by_others()?;
        if changed && self.changed.is_none() {
            let (folder, next) = (path.display(), self.index.next_number());
            let words = format!(
                "the audit file in {folder} was removed or changed by someone else while the service ran: entries before \
                 {next} may be missing. `isotherm history --verify {folder}` names them; look for them in a backup"
            );
            tracing::error!("{words}");
            self.changed = Some(words);
        }
        Ok(changed)
    }

    /// Begins a new audit file where this one is full, empty behind a full one, or no longer ours.
    fn begin_anew_if_due(&mut self, time: SystemTime) -> Result<(), StoreError> {
        let taken_away = self.note_change()?;
        let Journal::Folder { log, path, .. } = &self.journal else { return Ok(()) };
        if taken_away {
            tracing::warn!("a new audit file is started in {}", path.display());
        }
        let full = log.grown() >= self.full_bytes;
        let lacks_carried = log.is_empty() && !self.index.is_empty();
        if !(taken_away || full || lacks_carried) {
            return Ok(());
        }
        let (lines, number, chain) = self.carried_lines(time)?;
        let Journal::Folder { log, .. } = &mut self.journal else { return Ok(()) };
        match log.begin_anew(self.index.last_number, &lines, chain) {
            Ok(()) => {
                self.index.last_number = number;
                (self.stuck, self.prune_due) = (false, true);
                Ok(())
            }
            // A full file goes on being written to, rather than refuse what it still has room for.
            Err(error) if full && !taken_away => {
                if !self.stuck {
                    tracing::warn!("the audit file is full and no new one can be started: {error}");
                }
                self.stuck = true;
                Ok(())
            }
            Err(error) => Err(error),
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
