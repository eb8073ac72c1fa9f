//! What is read back: what holds by the entries so far, documents, the newest entries; and audit files line by line, whatever is
//! in them.

use std::collections::VecDeque;
use std::fs::File;
use std::io::{self, BufRead, BufReader, Read};
use std::path::{Path, PathBuf};

use isotherm_document::file::check_regular;
use isotherm_protocol::digest::Digest;
use isotherm_protocol::history::{AuditEntry, GoodSet, Intent, MAX_LINE_BYTES};
use isotherm_protocol::key::UnitId;

use super::{Journal, Store, StoreError};

impl Store {
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

    /// What problems of a document that is kept are to call it: its file, or what is given where there is no state folder.
    pub(crate) fn document_name(&self, digest: &Digest, otherwise: impl FnOnce() -> String) -> String {
        self.document_file(digest).map_or_else(otherwise, |file| file.display().to_string())
    }

    /// The newest entries of a unit, or of all, the oldest of them first: at most `limit`, and no more than 10 000. They are
    /// read from the audit file and the full one before it; carried-over entries are left out where that one is there.
    ///
    /// # Errors
    /// [`StoreError::Read`].
    pub fn history(&self, unit: Option<&UnitId>, limit: usize) -> Result<Vec<AuditEntry>, StoreError> {
        let limit = limit.min(MAX_ENTRIES);
        match &self.journal {
            Journal::Folder { log, .. } => {
                let (before, current) = log.files()?;
                let mut newest = newest_in(current, unit, limit, before.is_none())?;
                if let Some(before) = before.filter(|_| newest.len() < limit) {
                    let mut older = newest_in(&before, unit, limit - newest.len(), false)?;
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

/// Where the lines of a file end.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Extent {
    /// Up to the last line feed (bytes).
    pub(super) lines: u64,
    /// Behind it: a line that was not written to its end (bytes).
    pub(super) rest: u64,
}

/// One line, as it stands in the file.
#[derive(Debug, Clone, Copy)]
pub(super) struct Line<'l> {
    /// Its number, from 1.
    pub(super) number: u64,
    /// Its bytes, line feed included; of one that is longer than any entry only the beginning, so that no file can fill the
    /// memory.
    pub(super) bytes: &'l [u8],
    /// Whether it has a line feed at its end.
    pub(super) ended: bool,
}

/// Calls `visit` with each line of a file; what stands behind the last line feed comes last.
pub(super) fn lines(path: &Path, mut visit: impl FnMut(Line<'_>)) -> io::Result<Extent> {
    check_regular(path)?;
    let mut reader = BufReader::with_capacity(1 << 16, File::open(path)?);
    let mut extent = Extent { lines: 0, rest: 0 };
    let mut line = Vec::new();
    for number in 1.. {
        line.clear();
        let read = reader.by_ref().take(MAX_LINE_BYTES as u64 + 1).read_until(b'\n', &mut line)?;
        if read == 0 {
            break;
        }
        let mut length = read as u64;
        let mut ended = line.ends_with(b"\n");
        if !ended {
            let (beyond, feed) = skip_line(&mut reader)?;
            length += beyond;
            ended = feed;
        }
        visit(Line { number, bytes: &line, ended });
        if !ended {
            extent.rest = length;
            break;
        }
        extent.lines += length;
    }
    Ok(extent)
}

/// Skips to behind the next line feed: how many bytes, and whether there was one.
fn skip_line(reader: &mut impl BufRead) -> io::Result<(u64, bool)> {
    let mut skipped = 0;
    loop {
        let buffer = reader.fill_buf()?;
        if buffer.is_empty() {
            return Ok((skipped, false));
        }
        let feed = buffer.iter().position(|byte| *byte == b'\n');
        let taken = feed.map_or(buffer.len(), |at| at + 1);
        reader.consume(taken);
        skipped += taken as u64;
        if feed.is_some() {
            return Ok((skipped, true));
        }
    }
}

/// Most entries that are given at once.
const MAX_ENTRIES: usize = 10_000;
/// Within how many bytes of a line its unit, author and event are named.
const MAX_HEAD: usize = 512;

/// The newest `limit` entries of a file, of one unit or of all, the oldest of them first. Damaged lines are skipped: they
/// were told when the file was opened.
fn newest_in(
    path: &Path,
    unit: Option<&UnitId>,
    limit: usize,
    carried: bool,
) -> Result<Vec<AuditEntry>, StoreError> {
    // Cheaper than JSON: most lines of a large file are another unit's, or too old.
    let mark = unit.map(|unit| format!("\"unit\":\"{unit}\""));
    let mut newest: VecDeque<Vec<u8>> = VecDeque::new();
    let read = lines(path, |Line { bytes: line, .. }| {
        let of_unit = mark.as_ref().is_none_or(|mark| contains(line, mark));
        let wanted = of_unit && (carried || !contains(line, "\"event\":\"carried-"));
        if wanted && AuditEntry::is_whole(line) {
            newest.push_back(line.to_vec());
            if newest.len() > limit {
                newest.pop_front();
            }
        }
    });
    read.map_err(StoreError::read(path))?;
    Ok(newest.iter().filter_map(|line| AuditEntry::from_line(line).ok()).collect())
}

/// Whether a line has this mark near its beginning, where unit and event stand. No other text of an entry can hold it: a
/// quotation mark within a text has a backslash before it.
fn contains(line: &[u8], mark: &str) -> bool {
    String::from_utf8_lossy(line.get(..MAX_HEAD).unwrap_or(line)).contains(mark)
}
