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
