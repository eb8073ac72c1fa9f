//! Files that are there whole, or not at all, whenever the power goes.

use std::fs::File;
use std::io::{self, ErrorKind, Write};
use std::path::{Path, PathBuf};

/// What the names of half-written files begin with; only one service writes to a state folder at a time.
const TEMPORARY: &str = ".new-";

/// Writes a file beside its place and moves it there: whoever looks finds the old one or the new one, whole.
pub(super) fn write(folder: &Path, name: &str, bytes: &[u8]) -> io::Result<()> {
    let temporary = prepare(folder, name, bytes)?;
    std::fs::rename(temporary, folder.join(name))?;
    sync_folder(folder)
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
        let mut begun = Vec::with_capacity(TOGETHER);
        let written = files.by_ref().take(TOGETHER).try_for_each(|(name, content)| {
            let path = folder.join(format!("{TEMPORARY}{name}"));
            let file =
                File::create(&path).and_then(|mut file| file.write_all(&bytes(content)).map(|()| file));
            file.map(|file| begun.push((name.clone(), path, file))).map_err(|error| (name, error))
        });
        let moved = written.and_then(|()| {
            sync_all(&begun)?;
            begun.iter().try_for_each(|(name, path, _)| {
                std::fs::rename(path, folder.join(name)).map_err(|error| (name.clone(), error))
            })
        });
        if let Err(error) = moved {
            // As far as they have not been moved; what is left goes at the next start at the latest.
            for (_, path, _) in &begun {
                let _ = std::fs::remove_file(path);
            }
            return Err(error);
        }
    }
    // A process that ended right after it moved a file may not have made its name last: also where nothing was written.
    sync_folder(folder).map_err(|error| (String::new(), error))
}

/// Makes the contents of files last.
fn sync_all(files: &[(String, PathBuf, File)]) -> Result<(), (String, io::Error)> {
    if let [(name, _, file)] = files {
        return file.sync_all().map_err(|error| (name.clone(), error));
    }
    let share = files.len().div_ceil(WAITING).max(1);
    let sync = |files: &[(String, PathBuf, File)]| {
        files.iter().try_for_each(|(name, _, file)| file.sync_all().map_err(|error| (name.clone(), error)))
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
    let temporary = folder.join(format!("{TEMPORARY}{name}"));
    match write_through(&temporary, bytes) {
        Ok(()) => Ok(temporary),
        Err(error) => {
            // On a full disk it must not take the last room; what is left of it goes at the next start at the latest.
            let _ = std::fs::remove_file(&temporary);
            Err(error)
        }
    }
}

fn write_through(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let mut file = File::create(path)?;
    file.write_all(bytes)?;
    file.sync_all()
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
