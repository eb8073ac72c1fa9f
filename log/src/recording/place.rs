//! The file that a recording goes to.

use std::fs::{File, TryLockError};
use std::io;
use std::path::Path;

use crate::error::Error;
use crate::file::refuse_replacing;

/// Creates a file to be written by nobody else at the same time.
///
/// # Errors
/// [`Error::Usage`] where it is there already and may not be written over, [`Error::File`] also where somebody writes it.
pub(super) fn create(path: &Path, overwrite: bool) -> Result<File, Error> {
    refuse_replacing(path, overwrite)?;
    let failed = |source| Error::file(path, "create the recording", source);
    let mut options = File::options();
    options.write(true);
    // Not cut to nothing here: whose it is shows only when it is locked.
    if overwrite {
        options.create(true).truncate(false)
    } else {
        options.create_new(true)
    };
    let file = options.open(path).map_err(failed)?;
    match file.try_lock() {
        Err(TryLockError::WouldBlock) => return Err(failed(io::Error::other("it is being written"))),
        // A file system without locks is none to do without recordings for.
        Ok(()) | Err(TryLockError::Error(_)) => {}
    }
    if overwrite {
        file.set_len(0).map_err(failed)?;
    }
    Ok(file)
}

/// Whether somebody is writing a recording to a file.
#[must_use]
pub fn is_being_written(path: &Path) -> bool {
    let locked = |file: File| matches!(file.try_lock_shared(), Err(TryLockError::WouldBlock));
    File::open(path).is_ok_and(locked)
}
