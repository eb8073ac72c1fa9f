//! Files that are there whole, or not at all, whenever the power goes.

use std::fs::File;
use std::io::{self, ErrorKind, Write};
use std::path::{Path, PathBuf};

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
