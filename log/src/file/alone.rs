//! Files that one program writes at a time.

use std::fs::{File, TryLockError};
use std::io;
use std::path::Path;

use super::refuse_replacing;
use crate::error::Error;

/// Creates a file to be written by nobody else at the same time.
///
/// # Errors
/// [`Error::Usage`] where it is there already and may not be written over, [`Error::File`] also where somebody writes it.
pub(crate) fn create_alone(path: &Path, overwrite: bool) -> Result<File, Error> {
    refuse_replacing(path, overwrite)?;
    let failed = |source| Error::file(path, "create", source);
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
        Err(TryLockError::WouldBlock) => {
            return Err(failed(io::Error::other(
                "another program is writing it: wait until it ends, or stop it",
            )));
        }
        // A file system without locks is written to all the same.
        Ok(()) | Err(TryLockError::Error(_)) => {}
    }
    // A device has no length.
    if overwrite && path.is_file() {
        file.set_len(0).map_err(failed)?;
    }
    Ok(file)
}

/// Whether somebody is writing to a file.
#[must_use]
pub fn is_being_written(path: &Path) -> bool {
    let locked = |file: File| matches!(file.try_lock_shared(), Err(TryLockError::WouldBlock));
    File::open(path).is_ok_and(locked)
}
