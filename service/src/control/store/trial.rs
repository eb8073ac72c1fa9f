//! Whether the state folder can be written: without it every swap is refused.

use std::io::Write;
use std::time::{Duration, Instant};

use super::{Journal, Store, StoreError};

/// How often it is tried where nothing else is written.
const INTERVAL: Duration = Duration::from_secs(2);
/// What is written for a trial: as much as a large document and its entries need.
static TRIAL: [u8; 65536] = [0; 65536];

impl Store {
    /// Why nothing can be written: the last write failed, as on a full disk.
    pub(crate) fn write_failure(&self) -> Option<&str> {
        self.write_failure.as_deref()
    }

    /// Writes into the folder that was opened, and remembers that it failed until the next time that works.
    pub(super) fn write<T>(
        &mut self,
        write: impl FnOnce(&mut Self) -> Result<T, StoreError>,
    ) -> Result<T, StoreError> {
        let written = self.check_held().and_then(|()| write(self));
        match &written {
            Ok(_) => self.write_failure = None,
            Err(error @ StoreError::Write { .. }) => self.write_failure = Some(error.to_string()),
            Err(_) => {}
        }
        written
    }

    /// Writes a file that has no name and is gone at once, so that a full disk is known before a swap is refused.
    pub(super) fn try_if_due(&mut self, now: Instant) {
        let Journal::Folder { path, .. } = &self.journal else { return };
        if now < self.next_trial {
            return;
        }
        self.next_trial = now + INTERVAL;
        let folder = path.join("documents");
        let tried = tempfile::tempfile_in(&folder).and_then(|mut file| file.write_all(&TRIAL));
        // Its failure is remembered.
        let _ = self.write(|_| tried.map_err(StoreError::write(&folder)));
    }
}
