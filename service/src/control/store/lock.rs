//! One service to a state folder.

use std::fs::{File, TryLockError};
use std::io::{Read, Write};
use std::os::unix::fs::MetadataExt;
use std::path::Path;
use std::time::SystemTime;

use isotherm_protocol::history::WallTime;

use super::StoreError;

/// Name of the file.
const NAME: &str = "lock";
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
        let (own, found) = (self.file.metadata(), std::fs::metadata(folder.join(NAME)));
        own.is_ok_and(|own| found.is_ok_and(|found| identity(own) == identity(found)))
    }

    /// Takes it. What an earlier holder left in the file means nothing: the system knows whether it lives.
    ///
    /// # Errors
    /// [`StoreError::Held`] where another instance has it, [`StoreError::Write`] where the file cannot be made or locked.
    pub(super) fn take(folder: &Path) -> Result<Self, StoreError> {
        let path = folder.join(NAME);
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
