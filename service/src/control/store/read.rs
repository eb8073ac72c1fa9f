//! What is read back: documents, the newest entries; and audit files line by line, whatever is in them.

use std::fs::File;
use std::io::{self, BufRead, BufReader, Read, Seek, SeekFrom};
use std::path::Path;

use isotherm_document::file::check_regular;
use isotherm_protocol::digest::Digest;
use isotherm_protocol::history::{AuditEntry, MAX_LINE_BYTES};
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

    /// What problems of a document that is kept are to call it: its file, or what is given where there is no state folder.
    pub(crate) fn document_name(&self, digest: &Digest, otherwise: impl FnOnce() -> String) -> String {
        self.documents.file(digest).map_or_else(otherwise, |file| file.display().to_string())
    }

    /// The newest entries of a unit, or of all, the oldest of them first: at most `limit`, and no more than 10 000. They are
    /// read from the audit file, from its end, and the full one before it; carried-over entries are left out where that one is there.
    ///
    /// # Errors
    /// [`StoreError::Read`].
    pub fn history(&self, unit: Option<&UnitId>, limit: usize) -> Result<Vec<AuditEntry>, StoreError> {
        self.history_after(0, unit, limit)
    }

    /// The same of those with a higher number alone.
    ///
    /// # Errors
    /// [`StoreError::Read`].
    pub(crate) fn history_after(
        &self,
        after: u64,
        unit: Option<&UnitId>,
        limit: usize,
    ) -> Result<Vec<AuditEntry>, StoreError> {
        let mark = unit.map(|unit| format!("\"unit\":\"{unit}\""));
        let mut newest = Newest { mark, limit: limit.min(MAX_ENTRIES), after, entries: Vec::new() };
        match &self.journal {
            Journal::Folder { log, .. } => {
                let (before, current) = log.files()?;
                if !newest.read(current, before.is_none())?
                    && let Some(before) = before
                {
                    newest.read(&before, false)?;
                }
            }
            Journal::Memory(recent) => {
                let of_unit = |entry: &&AuditEntry| {
                    unit.is_none_or(|unit| entry.unit.as_deref() == Some(unit.as_str()))
                };
                let recent = recent.iter().rev().take_while(|entry| entry.number > after);
                newest.entries = recent.filter(of_unit).take(limit).cloned().collect();
            }
        }
        newest.entries.reverse();
        Ok(newest.entries)
    }

    /// Whether an entry of a unit is written down, under whatever number.
    ///
    /// # Errors
    /// [`StoreError::Read`].
    pub(crate) fn has_written(&mut self, unit: &UnitId, entry: &AuditEntry) -> Result<bool, StoreError> {
        if !self.written.contains_key(unit) {
            let entries = self.history(Some(unit), MAX_ENTRIES)?;
            self.written.insert(unit.clone(), entries.iter().map(likeness).collect());
        }
        Ok(self.written.get(unit).is_some_and(|written| written.contains(&likeness(entry))))
    }
}

/// What an entry has in common with its copies in the audit files of other instances.
pub(super) fn likeness(entry: &AuditEntry) -> Digest {
    Digest::of(&serde_json::to_vec(&(&entry.time, &entry.by, &entry.event)).unwrap_or_default())
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

/// Bytes of a file that are read at once, from its end.
const BLOCK: usize = 1 << 16;

/// Collects the newest entries of one unit or of all.
struct Newest {
    /// What a line of the unit has in it.
    mark: Option<String>,
    limit: usize,
    after: u64,
    /// The newest first.
    entries: Vec<AuditEntry>,
}

impl Newest {
    /// Reads a file from its end; whether nothing older is wanted. Damaged lines are skipped: they were told when the file was
    /// opened.
    fn read(&mut self, path: &Path, carried: bool) -> Result<bool, StoreError> {
        let mut done = self.entries.len() >= self.limit;
        let read = lines_from_end(path, |line| {
            // Cheaper than JSON: most lines of a large file are another unit's.
            let of_unit = self.mark.as_ref().is_none_or(|mark| contains(line, mark));
            let wanted = of_unit && (carried || !contains(line, "\"event\":\"carried-"));
            if let Some(entry) = wanted.then(|| AuditEntry::from_line(line).ok()).flatten() {
                done = entry.number <= self.after;
                if !done {
                    self.entries.push(entry);
                    done = self.entries.len() >= self.limit;
                }
            }
            !done
        });
        read.map_err(StoreError::read(path))?;
        Ok(done)
    }
}

/// Calls `visit` with each line that has a line feed, the last one first, for as long as it says so. One that is longer than any entry
/// is left out.
fn lines_from_end(path: &Path, mut visit: impl FnMut(&[u8]) -> bool) -> io::Result<()> {
    check_regular(path)?;
    let mut file = File::open(path)?;
    let mut at = file.seek(SeekFrom::End(0))?;
    // What stands behind the last line feed is no line.
    let (mut rest, mut skips): (Vec<u8>, bool) = (Vec::new(), true);
    while at > 0 {
        let length = at.min(BLOCK as u64);
        at -= length;
        file.seek(SeekFrom::Start(at))?;
        let mut block = Vec::new();
        file.by_ref().take(length).read_to_end(&mut block)?;
        block.append(&mut rest);
        let mut end = block.len();
        while let Some(feed) = block.get(..end).and_then(|block| block.iter().rposition(|it| *it == b'\n')) {
            let line = block.get(feed + 1..end).unwrap_or_default();
            if !std::mem::take(&mut skips) && !visit(line) {
                return Ok(());
            }
            end = feed;
        }
        block.truncate(end);
        rest = block;
        if rest.len() > MAX_LINE_BYTES {
            (rest, skips) = (Vec::new(), true);
        }
    }
    if !skips {
        visit(&rest);
    }
    Ok(())
}

/// Whether a line has this mark near its beginning, where unit and event stand. No other text of an entry can hold it: a
/// quotation mark within a text has a backslash before it.
fn contains(line: &[u8], mark: &str) -> bool {
    String::from_utf8_lossy(line.get(..MAX_HEAD).unwrap_or(line)).contains(mark)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_from_the_end_are_those_of_the_file_the_last_one_first() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("lines");
        let overlong = "x".repeat(MAX_LINE_BYTES + 2 * BLOCK);
        let long = "y".repeat(BLOCK);
        for lines in [
            vec![],
            vec!["a", "", "b"],
            vec![&long, "a", &long, "b"],
            vec!["a", &overlong, "b", &long],
            vec![&overlong, "b"],
        ] {
            for torn in ["", "torn", &long] {
                let text: String = lines.iter().flat_map(|line| [line, "\n"]).collect();
                std::fs::write(&path, text + torn).unwrap();
                let mut read = Vec::new();
                lines_from_end(&path, |line| {
                    read.push(line.to_vec());
                    true
                })
                .unwrap();
                let kept = lines.iter().rev().filter(|line| line.len() <= MAX_LINE_BYTES);
                let kept: Vec<_> = kept.map(|line| line.as_bytes().to_vec()).collect();
                assert!(read == kept, "{} lines of {}", read.len(), lines.len());
                let mut first = 0;
                lines_from_end(&path, |_| {
                    first += 1;
                    false
                })
                .unwrap();
                assert_eq!(first, kept.len().min(1));
            }
        }
    }
}
