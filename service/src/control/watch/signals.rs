//! What wakes the watcher's thread.

use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Instant;

/// Shared by the watcher, its thread and the source of events. Nobody holds it for longer than a word.
#[derive(Debug, Default)]
pub(super) struct Signals {
    heard: Mutex<Heard>,
    changed: Condvar,
}

/// What has been signalled since the last wait.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
#[expect(clippy::struct_excessive_bools, reason = "each is a signal of its own")]
pub(super) struct Heard {
    /// Something has happened in the folder.
    pub(super) stirred: bool,
    /// No further event is going to come from the present watch.
    pub(super) deaf: bool,
    /// Somebody wants every file read again.
    pub(super) reread: bool,
    /// The thread is to end. Stays.
    pub(super) stop: bool,
}

impl Signals {
    /// Gives a signal.
    pub(super) fn give(&self, signal: impl FnOnce(&mut Heard)) {
        signal(&mut self.lock());
        self.changed.notify_all();
    }

    /// Whether the thread is to end.
    pub(super) fn stopping(&self) -> bool {
        self.lock().stop
    }

    /// Waits for a signal, until a time at the latest, and takes what was signalled.
    pub(super) fn wait(&self, until: Instant) -> Heard {
        let limit = until.saturating_duration_since(Instant::now());
        let (mut state, _) = self
            .changed
            .wait_timeout_while(self.lock(), limit, |heard| *heard == Heard::default())
            .unwrap_or_else(PoisonError::into_inner);
        let stop = state.stop;
        std::mem::replace(&mut *state, Heard { stop, ..Heard::default() })
    }

    fn lock(&self) -> MutexGuard<'_, Heard> {
        self.heard.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
