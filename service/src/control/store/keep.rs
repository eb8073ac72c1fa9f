//! What is written to goes on being ours, and goes on fitting: a folder that is lost, a file that is full.

use std::time::SystemTime;

use isotherm_protocol::history::chain::Chain;

use super::blobs::BlobStore;
use super::lock::Lock;
use super::log::Log;
use super::{Journal, Opened, Store, StoreError, durable, entry};

impl Store {
    /// Refuses to write into a folder that is not the one that was opened.
    pub(super) fn check_held(&self) -> Result<(), StoreError> {
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
        durable::sweep(&path).map_err(StoreError::write(&path))?;
        let mut shelves = [BlobStore::open(path.join("documents"))?, BlobStore::open(path.join("overlays"))?];
        let [of_documents, of_overlays] = &mut shelves;
        documents.into_iter().try_for_each(|bytes| of_documents.put(bytes.as_ref()).map(drop))?;
        overlays.into_iter().try_for_each(|bytes| of_overlays.put(bytes.as_ref()).map(drop))?;
        mark.write(&path).map_err(StoreError::write(&path))?;
        let mut log = Log::open(&path, &mut Opened::default(), &mut |_| {})?;
        let (lines, next_number, chain) = self.carried_lines(time)?;
        log.begin_anew(self.next_number.saturating_sub(1), &lines, chain)?;
        self.next_number = next_number;
        [self.documents, self.overlays] = shelves;
        self.journal = Journal::Folder { path, log, lock, mark };
        Ok(true)
    }

    /// What a new audit file begins with, the number behind it, and the chain there.
    fn carried_lines(&self, time: SystemTime) -> Result<(String, u64, Chain), StoreError> {
        let mut number = self.next_number;
        let mut lines = String::new();
        let mut chain = match &self.journal {
            Journal::Folder { log, .. } => log.chain,
            Journal::Memory(_) => Chain::default(),
        };
        chain.begin_file();
        for (unit, event) in self.index.carried() {
            lines.push_str(&chain.line(&entry(number, time, unit, "", event))?);
            number = number.saturating_add(1);
        }
        Ok((lines, number, chain))
    }

    /// Begins a new audit file where this one is full, empty behind a full one, or no longer ours.
    pub(super) fn begin_anew_if_due(&mut self, time: SystemTime) -> Result<(), StoreError> {
        let Journal::Folder { log, path, .. } = &self.journal else { return Ok(()) };
        let taken_away = log.changed_by_others()?;
        if taken_away {
            tracing::warn!(
                "the audit file in {} was changed by someone else: a new one is begun",
                path.display()
            );
        }
        let full = log.grown() >= self.full_bytes;
        let lacks_carried = log.is_empty() && !self.index.is_empty();
        if !(taken_away || full || lacks_carried) {
            return Ok(());
        }
        let (lines, number, chain) = self.carried_lines(time)?;
        let Journal::Folder { log, .. } = &mut self.journal else { return Ok(()) };
        match log.begin_anew(self.next_number.saturating_sub(1), &lines, chain) {
            Ok(()) => {
                self.next_number = number;
                (self.stuck, self.prune_due) = (false, true);
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
}
