//! The audit file as a file: whole lines at its end, or nothing.

use std::fmt;
use std::fs::File;
use std::io::{self, ErrorKind, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use isotherm_protocol::history::chain::Chain;
use isotherm_protocol::history::{AuditEntry, LineError};
use isotherm_protocol::key::UnitId;

use super::index::Index;
use super::opened::{Flaw, Opened, Torn};
use super::read::{self, Extent, Line};
use super::{StoreError, folder as files};
use isotherm_document::file::check_regular;

/// Name of the file that is written to.
pub(super) const NAME: &str = "audit.jsonl";

/// What is written to: a file, or in tests one that fails.
pub(super) trait Sink: fmt::Debug + Send {
    /// Writes at the end.
    fn write_all(&mut self, bytes: &[u8]) -> io::Result<()>;
    /// Makes what was written last.
    fn sync(&self) -> io::Result<()>;
    /// Cuts the file.
    fn cut(&self, length: u64) -> io::Result<()>;
}

impl Sink for File {
    fn write_all(&mut self, bytes: &[u8]) -> io::Result<()> {
        Write::write_all(self, bytes)
    }

    fn sync(&self) -> io::Result<()> {
        self.sync_data()
    }

    fn cut(&self, length: u64) -> io::Result<()> {
        self.set_len(length)
    }
}

/// The audit file.
#[derive(Debug)]
pub(super) struct Log {
    folder: PathBuf,
    path: PathBuf,
    pub(super) sink: Box<dyn Sink>,
    /// Bytes of its whole lines.
    length: u64,
    /// Bytes of the lines that it began with.
    carried: u64,
    /// A failed write may have left something behind `length`.
    unclean: bool,
    /// Where the next line carries on; to be taken further by whoever appends lines.
    pub(super) chain: Chain,
}

impl Log {
    /// Opens the audit file of a folder, or makes an empty one. What is found in the last full file and in this one goes to
    /// the index, the oldest first; a last line that was not written to its end is put aside.
    ///
    /// # Errors
    /// [`StoreError::Read`], or [`StoreError::Write`].
    pub(super) fn open(folder: &Path, opened: &mut Opened, index: &mut Index) -> Result<Self, StoreError> {
        let mut chain = Chain::default();
        if let Some(before) = last_full_file(folder)? {
            take_in(&before, false, opened, &mut chain, index)?;
        }
        let path = folder.join(NAME);
        let mut file = append_to(&path)?;
        let (extent, rest_is_whole) = take_in(&path, true, opened, &mut chain, index)?;
        let mut length = extent.lines;
        if extent.rest > 0 {
            let torn = if rest_is_whole { complete(&mut file) } else { move_rest(folder, &mut file, extent) };
            let torn = torn.map_err(StoreError::write(&path))?;
            if torn == Torn::Completed {
                length += extent.rest + 1;
            }
            opened.torn = Some(torn);
        }
        files::sync_folder(folder).map_err(StoreError::write(folder))?;
        if length == 0 {
            chain.begin_file();
        }
        let (folder, sink) = (folder.to_owned(), Box::new(file));
        Ok(Self { folder, path, sink, length, carried: 0, unclean: false, chain })
    }

    /// Whether a full file was put aside, and the present one has nothing.
    pub(super) fn is_empty_behind_a_full_one(&self) -> Result<bool, StoreError> {
        Ok(self.is_empty() && last_full_file(&self.folder)?.is_some())
    }

    /// Appends a line or several, which are on the disk when this returns. Where it fails, nothing of them stays.
    ///
    /// # Errors
    /// [`StoreError::Write`]; a later line may go well.
    pub(super) fn append(&mut self, line: &str) -> Result<(), StoreError> {
        let written = self.clean().and_then(|()| {
            self.unclean = true;
            self.sink.write_all(line.as_bytes()).and_then(|()| self.sink.sync())
        });
        match written {
            Ok(()) => {
                self.unclean = false;
                self.length += line.len() as u64;
                Ok(())
            }
            Err(source) => {
                // Where even that fails, it is tried again before the next line.
                let _ = self.clean();
                Err(StoreError::Write { path: self.path.clone(), source })
            }
        }
    }

    /// Cuts off what a failed write has left.
    fn clean(&mut self) -> io::Result<()> {
        if self.unclean {
            self.sink.cut(self.length)?;
            self.unclean = false;
        }
        Ok(())
    }

    /// Whether the file has no line.
    pub(super) fn is_empty(&self) -> bool {
        self.length == 0
    }

    /// Bytes of lines since the file began, those carried over left out.
    pub(super) fn grown(&self) -> u64 {
        self.length.saturating_sub(self.carried)
    }

    /// Whether somebody else has removed, replaced or changed the file: what is appended now might never be seen again.
    ///
    /// # Errors
    /// [`StoreError::Read`] where that cannot be told.
    pub(super) fn changed_by_others(&self) -> Result<bool, StoreError> {
        match std::fs::metadata(&self.path) {
            Ok(found) => Ok(!self.unclean && found.len() != self.length),
            Err(error) if error.kind() == ErrorKind::NotFound => Ok(true),
            Err(source) => Err(StoreError::Read { path: self.path.clone(), source }),
        }
    }

    /// Puts the file aside under the number of its last entry, and begins a new one with these lines, at whose end the chain
    /// is here. At every moment of it the last full file and the new one hold everything between them.
    ///
    /// # Errors
    /// [`StoreError::Write`], or [`StoreError::Read`].
    pub(super) fn begin_anew(
        &mut self,
        last_number: u64,
        lines: &str,
        chain: Chain,
    ) -> Result<(), StoreError> {
        let write = |source| StoreError::Write { path: self.path.clone(), source };
        let new = files::prepare(&self.folder, NAME, lines.as_bytes()).map_err(write)?;
        if std::fs::metadata(&self.path).is_ok_and(|found| found.len() > 0) {
            // The number is taken already where somebody has put an old file back.
            let names = (last_number..).map(|number| self.folder.join(format!("audit-{number}.jsonl")));
            if let Some(aside) = free(names) {
                std::fs::rename(&self.path, aside).map_err(write)?;
                files::sync_folder(&self.folder).map_err(write)?;
            }
        }
        std::fs::rename(new, &self.path).map_err(write)?;
        files::sync_folder(&self.folder).map_err(write)?;
        self.sink = Box::new(append_to(&self.path)?);
        self.length = lines.len() as u64;
        self.carried = self.length;
        self.unclean = false;
        self.chain = chain;
        Ok(())
    }

    /// The last full file, if there is one, and the one that is written to.
    ///
    /// # Errors
    /// [`StoreError::Read`].
    pub(super) fn files(&self) -> Result<(Option<PathBuf>, &Path), StoreError> {
        Ok((last_full_file(&self.folder)?, &self.path))
    }
}

/// Opens a file to append to it; a new one where there is none.
fn append_to(path: &Path) -> Result<File, StoreError> {
    let open = || File::options().append(true).read(true).create(true).open(path);
    check_regular(path).and_then(|()| open()).map_err(StoreError::write(path))
}

/// The first of these that is no file yet.
fn free(mut paths: impl Iterator<Item = PathBuf>) -> Option<PathBuf> {
    paths.find(|path| !path.exists())
}

/// The file that was put aside last.
fn last_full_file(folder: &Path) -> Result<Option<PathBuf>, StoreError> {
    Ok(full_files(folder)?.pop())
}

/// The files that were put aside, the oldest first.
pub(super) fn full_files(folder: &Path) -> Result<Vec<PathBuf>, StoreError> {
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(StoreError::read(folder))? {
        let entry = entry.map_err(StoreError::read(folder))?;
        let name = entry.file_name().to_string_lossy().into_owned();
        let number = name.strip_prefix("audit-").and_then(|name| name.strip_suffix(".jsonl"));
        if let Some(number) = number.and_then(|number| number.parse::<u64>().ok()) {
            files.push((number, entry.path()));
        }
    }
    files.sort();
    Ok(files.into_iter().map(|(_, path)| path).collect())
}

/// Reads a file: where its lines end, and whether what stands behind the last line feed is a whole entry. Where that
/// `may_be_torn`, it is no damage.
fn take_in(
    path: &Path,
    may_be_torn: bool,
    opened: &mut Opened,
    chain: &mut Chain,
    index: &mut Index,
) -> Result<(Extent, bool), StoreError> {
    let mut rest_is_whole = false;
    // Entries are numbered without a gap: a line that somebody took out is missed by its number.
    let mut next = None;
    let extent = read::lines(path, |Line { number: line, bytes, ended }| {
        rest_is_whole = !ended && AuditEntry::is_whole(bytes);
        chain.pass(bytes);
        match AuditEntry::from_line(bytes) {
            Ok(entry) => {
                opened.entries += 1;
                if let Some(first) = next.filter(|next| entry.number > *next) {
                    opened.note(Flaw::Gap { file: path.to_owned(), line, first, last: entry.number - 1 });
                }
                next = Some(entry.number.saturating_add(1));
                index.apply(&entry);
            }
            Err(_) if may_be_torn && !ended && !rest_is_whole => {}
            Err(error) => {
                opened.damaged += 1;
                opened.note(Flaw::Damage { file: path.to_owned(), line, words: error.to_string() });
                let number = if let LineError::Entry { number, .. } = error { number } else { None };
                next = number.or(next).map(|number| number.saturating_add(1));
                index.skip(number, acceptance_in(bytes));
            }
        }
    });
    Ok((extent.map_err(StoreError::read(path))?, rest_is_whole))
}

/// Unit and revision of a damaged line, where enough of it is there to see that it was an acceptance.
fn acceptance_in(line: &[u8]) -> Option<(UnitId, u64)> {
    let line = String::from_utf8_lossy(line);
    // No text of an entry can hold these: a quotation mark within a text has a backslash before it.
    let (_, unit) = line.split_once("\"unit\":\"").filter(|_| line.contains("\"event\":\"accepted\""))?;
    let (unit, rest) = unit.split_once('"')?;
    let (_, revision) = rest.split_once("\"revision\":")?;
    let digits: String = revision.chars().take_while(char::is_ascii_digit).collect();
    Some((UnitId::new(unit).ok()?, digits.parse().ok()?))
}

/// Adds the line feed that is missing.
fn complete(file: &mut File) -> io::Result<Torn> {
    Write::write_all(file, b"\n")?;
    file.sync_data()?;
    Ok(Torn::Completed)
}

/// Moves what stands behind the last line feed to a file of its own: first there, then away from here.
fn move_rest(folder: &Path, file: &mut File, extent: Extent) -> io::Result<Torn> {
    let names = (1_u64..).map(|number| folder.join(format!("audit.torn-{number}")));
    let to = free(names).ok_or(ErrorKind::AlreadyExists)?;
    file.seek(SeekFrom::Start(extent.lines))?;
    let mut torn = File::create_new(&to)?;
    io::copy(&mut file.take(extent.rest), &mut torn)?;
    torn.sync_all()?;
    file.set_len(extent.lines)?;
    file.sync_data()?;
    Ok(Torn::Moved { to, bytes: extent.rest })
}
