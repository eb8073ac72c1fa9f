//! What is known of each file of the folder, and what was told of it. Reads no clock and no file.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::Instant;

use isotherm_protocol::digest::Digest;

use super::folder::{Content, Sight};
use super::{FolderEvent, Known, grace};
use crate::config::FolderSettings;

/// A file that never settles is read after this many settling times.
const PATIENCE: u32 = 20;

/// What was told of a file last.
#[derive(Debug, Clone, PartialEq, Eq)]
enum Told {
    Nothing,
    Content(Digest),
    /// Why; `None` where the owner found it so before the start, for a reason not known here.
    Unreadable(Option<String>),
}

/// A file that has changed and has not settled.
#[derive(Debug, Clone, Copy)]
struct Unrest {
    first: Instant,
    last: Instant,
}

/// One file.
#[derive(Debug)]
struct Entry {
    sight: Sight,
    told: Told,
    unrest: Option<Unrest>,
}

/// All files.
#[derive(Debug)]
pub(super) struct FileStates {
    settings: FolderSettings,
    entries: BTreeMap<PathBuf, Entry>,
    /// The file that was compared last.
    compared: Option<PathBuf>,
}

impl FileStates {
    /// With what the owner knows already.
    pub(super) fn new(settings: FolderSettings, known: Known) -> Self {
        let now = Instant::now();
        // Restless from the start: whether it still is what the owner read has to be seen.
        let unrest = Some(Unrest { first: now, last: now });
        let entries = known.into_iter().map(|(file, known)| {
            let told = known.map_or(Told::Unreadable(None), Told::Content);
            (file, Entry { sight: Sight::Absent, told, unrest })
        });
        Self { settings, entries: entries.collect(), compared: None }
    }

    /// The files of which something is known.
    pub(super) fn files(&self) -> impl Iterator<Item = &PathBuf> {
        self.entries.keys()
    }

    /// What was seen of a file at the last look.
    pub(super) fn sight(&self, file: &Path) -> Option<&Sight> {
        self.entries.get(file).map(|entry| &entry.sight)
    }

    /// A look has seen this.
    pub(super) fn see(&mut self, now: Instant, file: &Path, sight: Sight) {
        match self.entries.get_mut(file) {
            Some(entry) if entry.sight == sight => {}
            Some(entry) => {
                entry.sight = sight;
                entry.stir(now);
            }
            None if sight == Sight::Absent => {}
            None => {
                let unrest = Some(Unrest { first: now, last: now });
                self.entries.insert(file.to_owned(), Entry { sight, told: Told::Nothing, unrest });
            }
        }
    }

    /// Something is different about a file that looks the same.
    pub(super) fn stir(&mut self, now: Instant, file: &Path) {
        if let Some(entry) = self.entries.get_mut(file) {
            entry.stir(now);
        }
    }

    /// When the next file has settled.
    pub(super) fn next_due(&self) -> Option<Instant> {
        self.entries.values().filter_map(|entry| self.due_at(entry)).min()
    }

    /// The files that have settled.
    pub(super) fn due(&self, now: Instant) -> Vec<PathBuf> {
        let due = |entry: &Entry| self.due_at(entry).is_some_and(|due| due <= now);
        self.entries.iter().filter(|(_, entry)| due(entry)).map(|(file, _)| file.clone()).collect()
    }

    /// When it has settled, where it has not.
    fn due_at(&self, entry: &Entry) -> Option<Instant> {
        let Unrest { first, last } = entry.unrest?;
        Some(match entry.sight {
            Sight::File(_) => (last + self.settings.settle).min(first + self.settings.settle * PATIENCE),
            // What is about to be replaced is away for a moment, or a link to nothing.
            Sight::Odd(_) | Sight::Absent => last + grace(&self.settings),
        })
    }

    /// Up to `count` settled files, each in its turn.
    pub(super) fn next_to_compare(&mut self, count: usize) -> Vec<PathBuf> {
        let settled = |entry: &Entry| entry.unrest.is_none() && matches!(entry.sight, Sight::File(_));
        let mut files: Vec<_> =
            self.entries.iter().filter(|(_, entry)| settled(entry)).map(|(file, _)| file).collect();
        let next = files.partition_point(|file| Some(*file) <= self.compared.as_ref());
        files.rotate_left(next);
        let turn: Vec<_> = files.into_iter().take(count).cloned().collect();
        self.compared = turn.last().cloned();
        turn
    }

    /// Whether a reading says of a file what was told of it.
    pub(super) fn is_told(&self, file: &Path, reading: &Result<Content, String>) -> bool {
        self.entries.get(file).is_some_and(|entry| match (&entry.told, reading) {
            (Told::Content(told), Ok(content)) => content.steady && *told == content.digest,
            (Told::Unreadable(Some(told)), Err(reason)) => told == reason,
            _ => false,
        })
    }

    /// A settled file has been read, or cannot be: what is to be told. `None` also where it was written meanwhile and has to settle
    /// anew.
    pub(super) fn read(
        &mut self,
        now: Instant,
        file: &Path,
        reading: Result<Content, String>,
    ) -> Option<FolderEvent> {
        let patience = self.settings.settle * PATIENCE;
        let entry = self.entries.get_mut(file)?;
        let content = match reading {
            Ok(content) => content,
            Err(reason) => {
                entry.unrest = None;
                let told = std::mem::replace(&mut entry.told, Told::Unreadable(Some(reason.clone())));
                let known = told == Told::Unreadable(None) || told == entry.told;
                return (!known).then(|| FolderEvent::Unreadable { file: file.to_owned(), reason });
            }
        };
        let impatient =
            entry.unrest.is_some_and(|unrest| now.saturating_duration_since(unrest.first) >= patience);
        if !content.steady && !impatient {
            entry.stir(now);
            return None;
        }
        entry.unrest = None;
        let Content { bytes, digest, .. } = content;
        let told = std::mem::replace(&mut entry.told, Told::Content(digest));
        (told != Told::Content(digest)).then(|| FolderEvent::Changed { file: file.to_owned(), bytes })
    }

    /// A file has been gone for the grace time: what is to be told.
    pub(super) fn removed(&mut self, file: &Path) -> Option<FolderEvent> {
        let entry = self.entries.remove(file)?;
        (entry.told != Told::Nothing).then(|| FolderEvent::Removed { file: file.to_owned() })
    }
}

impl Entry {
    fn stir(&mut self, now: Instant) {
        let first = self.unrest.map_or(now, |unrest| unrest.first);
        self.unrest = Some(Unrest { first, last: now });
    }
}

#[cfg(test)]
mod tests;
