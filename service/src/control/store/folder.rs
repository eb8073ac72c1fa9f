//! The state folder itself: locked by one service, its files whole or not there whenever the power goes, and what is known should
//! the audit file be lost.

use std::fs::{File, TryLockError};
use std::io::{self, ErrorKind, Read, Write};
use std::os::unix::fs::{FileExt, MetadataExt};
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use isotherm_document::file::check_regular;
use isotherm_protocol::history::WallTime;
use serde::{Deserialize, Serialize};

use super::StoreError;

/// Name of the file that is locked.
const LOCK: &str = "lock";
/// Most bytes that are read of what the holder says of itself.
const MAX_HOLDER_BYTES: u64 = 200;

/// The lock of a state folder: held until dropped, or until the process ends in whatever way.
#[derive(Debug)]
pub(super) struct Lock {
    file: File,
}

impl Lock {
    /// Whether what is called so in the folder is this lock: not where the folder was removed or replaced.
    pub(super) fn is_in(&self, folder: &Path) -> bool {
        let identity = |found: std::fs::Metadata| (found.dev(), found.ino());
        let (own, found) = (self.file.metadata(), std::fs::metadata(folder.join(LOCK)));
        own.is_ok_and(|own| found.is_ok_and(|found| identity(own) == identity(found)))
    }

    /// Takes it. What an earlier holder left in the file means nothing: the system knows whether it lives.
    ///
    /// # Errors
    /// [`StoreError::Held`] where another instance has it, [`StoreError::Write`] where the file cannot be made or locked.
    pub(super) fn take(folder: &Path) -> Result<Self, StoreError> {
        let path = folder.join(LOCK);
        let open = File::options().read(true).write(true).create(true).truncate(false).open(&path);
        let mut file = open.map_err(StoreError::write(&path))?;
        match file.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => {
                return Err(StoreError::Held { path: folder.to_owned(), holder: holder(file) });
            }
            Err(TryLockError::Error(source)) => return Err(StoreError::Write { path, source }),
        }
        let started = WallTime::from(SystemTime::now());
        let words = format!("process {}, started {started}\n", std::process::id());
        // A full disk keeps nobody from holding the lock; whoever comes second is told less.
        let _ = file.set_len(0).and_then(|()| file.write_all(words.as_bytes()));
        Ok(Self { file })
    }
}

impl Drop for Lock {
    fn drop(&mut self) {
        // A child process that is just being started has the file open too, for a moment: closing it here is not enough.
        let _ = self.file.unlock();
    }
}

/// What the holder says of itself.
fn holder(file: File) -> String {
    let mut bytes = Vec::new();
    let read = file.take(MAX_HOLDER_BYTES).read_to_end(&mut bytes);
    let words = String::from_utf8_lossy(&bytes).trim().to_owned();
    if read.is_err() || words.is_empty() { "another process".to_owned() } else { words }
}

/// Name of the mark's file.
pub(super) const MARK: &str = "revisions.json";
/// Name of the file with the number of the last entry.
const LAST_ENTRY: &str = "last-entry";
/// How far ahead it is written.
pub(super) const AHEAD: u64 = 1000;

/// Which revisions may have been given, for the day on which the audit file is lost.
///
/// Which set holds is said by the audit file alone. This file says no more than that no revision above a number was ever
/// given; it is written before that number is reached, a thousand revisions ahead, so that it costs nothing and is never
/// too low. It is read where the audit file has nothing to say.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub(super) struct Mark {
    /// No revision of any unit above this one was given.
    reserved: u64,
    /// Revisions up to this one are not given again: the audit file that had them was lost.
    pub(super) floor: u64,
}

impl Mark {
    /// What the folder's file says; `None` where there is none.
    ///
    /// # Errors
    /// Where it cannot be read, or is damaged.
    pub(super) fn read(folder: &Path) -> io::Result<Option<Self>> {
        let path = folder.join(MARK);
        match check_regular(&path).and_then(|()| std::fs::read_to_string(path)) {
            Ok(text) => Ok(Some(serde_json::from_str(&text)?)),
            Err(error) if error.kind() == ErrorKind::NotFound => Ok(None),
            Err(error) => Err(error),
        }
    }

    /// One in the place of a file that is lost, above the highest revision that is known.
    pub(super) fn beyond(highest: u64) -> Self {
        let floor = highest.saturating_add(AHEAD);
        Self { reserved: floor, floor }
    }

    /// Reserves a revision that is about to be given.
    pub(super) fn reserve(&mut self, folder: &Path, revision: u64) -> io::Result<()> {
        if revision <= self.reserved {
            return Ok(());
        }
        self.turn_into(folder, Self { reserved: revision.saturating_add(AHEAD), ..*self })
    }

    /// The audit file was lost: no number that may have been given is given again.
    pub(super) fn lose(&mut self, folder: &Path) -> io::Result<()> {
        self.turn_into(folder, Self { floor: self.floor.max(self.reserved), ..*self })
    }

    fn turn_into(&mut self, folder: &Path, next: Self) -> io::Result<()> {
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
        write(folder, MARK, text.as_bytes())
    }
}

/// What the names of half-written files begin with; only one service writes to a state folder at a time.
const TEMPORARY: &str = ".new-";

/// Writes a file beside its place and moves it there: whoever looks finds the old one or the new one, whole.
pub(super) fn write(folder: &Path, name: &str, bytes: &[u8]) -> io::Result<()> {
    write_all(folder, [(name.to_owned(), bytes)], <[u8]>::to_vec).map_err(|(_, error)| error)
}

/// Files that are written before any of them is waited for.
const TOGETHER: usize = 64;
/// Most of them that are waited for at the same time: a disk takes the waiting of many in one.
const WAITING: usize = 16;

/// Writes files as [`write`] does one, many at a time. `bytes` makes the content of each.
///
/// # Errors
/// That of the first that could not be written, with its name; some of the others may be there then, whole.
pub(super) fn write_all<T>(
    folder: &Path,
    files: impl IntoIterator<Item = (String, T)>,
    bytes: impl Fn(T) -> Vec<u8>,
) -> Result<(), (String, io::Error)> {
    let mut files = files.into_iter().peekable();
    while files.peek().is_some() {
        let group: Vec<_> = files.by_ref().take(TOGETHER).collect();
        let temporaries: Vec<_> = group.iter().map(|(name, _)| temporary(folder, name)).collect();
        if let Err(error) = write_group(folder, group, &bytes) {
            // As far as they have not been moved.
            for path in &temporaries {
                remove(path);
            }
            return Err(error);
        }
    }
    // A process that ended right after it moved a file may not have made its name last: also where nothing was written.
    sync_folder(folder).map_err(|error| (String::new(), error))
}

/// Writes some files, and moves them when all of them are on the disk.
fn write_group<T>(
    folder: &Path,
    group: Vec<(String, T)>,
    bytes: &impl Fn(T) -> Vec<u8>,
) -> Result<(), (String, io::Error)> {
    let mut begun = Vec::with_capacity(group.len());
    for (name, content) in group {
        match begin(&temporary(folder, &name), &bytes(content)) {
            Ok(file) => begun.push((name, file)),
            Err(error) => return Err((name, error)),
        }
    }
    sync_all(&begun)?;
    begun.into_iter().try_for_each(|(name, _)| {
        std::fs::rename(temporary(folder, &name), folder.join(&name)).map_err(|error| (name, error))
    })
}

/// Makes the contents of files last.
fn sync_all(files: &[(String, File)]) -> Result<(), (String, io::Error)> {
    if let [(name, file)] = files {
        return file.sync_all().map_err(|error| (name.clone(), error));
    }
    let share = files.len().div_ceil(WAITING).max(1);
    let sync = |files: &[(String, File)]| {
        files.iter().try_for_each(|(name, file)| file.sync_all().map_err(|error| (name.clone(), error)))
    };
    std::thread::scope(|scope| {
        let waiting: Vec<_> = files.chunks(share).map(|files| scope.spawn(move || sync(files))).collect();
        waiting.into_iter().try_for_each(|waiting| {
            waiting.join().unwrap_or_else(|_| Err((String::new(), io::Error::other("a thread has panicked"))))
        })
    })
}

/// Writes a file under its temporary name, through to the disk.
pub(super) fn prepare(folder: &Path, name: &str, bytes: &[u8]) -> io::Result<PathBuf> {
    let temporary = temporary(folder, name);
    match begin(&temporary, bytes).and_then(|file| file.sync_all()) {
        Ok(()) => Ok(temporary),
        Err(error) => {
            remove(&temporary);
            Err(error)
        }
    }
}

/// Where a file is written before it is moved to its place.
fn temporary(folder: &Path, name: &str) -> PathBuf {
    folder.join(format!("{TEMPORARY}{name}"))
}

fn begin(path: &Path, bytes: &[u8]) -> io::Result<File> {
    let mut file = File::create(path)?;
    file.write_all(bytes)?;
    Ok(file)
}

/// Takes away what could not be written: on a full disk it must not take the last room; what is left of it goes at the next
/// start at the latest.
fn remove(temporary: &Path) {
    let _ = std::fs::remove_file(temporary);
}

/// Makes the names in a folder last.
pub(super) fn sync_folder(folder: &Path) -> io::Result<()> {
    File::open(folder)?.sync_all()
}

/// Makes a folder where it is missing, and its name last.
pub(super) fn make_folder(folder: &Path) -> io::Result<()> {
    match std::fs::read_dir(folder) {
        Ok(_) => Ok(()),
        Err(error) if error.kind() == ErrorKind::NotFound => {
            std::fs::create_dir_all(folder)?;
            folder.parent().filter(|parent| !parent.as_os_str().is_empty()).map_or(Ok(()), sync_folder)
        }
        Err(error) => Err(error),
    }
}

/// Whether a crash has left this file half-written.
pub(super) fn is_half_written(folder: &Path, name: &str) -> bool {
    folder.join(format!("{TEMPORARY}{name}")).exists()
}

/// Removes what a crash has left half-written.
pub(super) fn sweep(folder: &Path) -> io::Result<()> {
    for entry in std::fs::read_dir(folder)? {
        let entry = entry?;
        if entry.file_name().to_string_lossy().starts_with(TEMPORARY) {
            std::fs::remove_file(entry.path())?;
        }
    }
    Ok(())
}
