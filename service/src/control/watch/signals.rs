//! What wakes the watcher's thread, and how its end is waited for.

use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// Shared by the watcher, its thread and the source of events. Nobody holds it for longer than a word.
#[derive(Debug, Default)]
pub(super) struct Signals {
    state: Mutex<State>,
    changed: Condvar,
}

#[derive(Debug, Default)]
struct State {
    heard: Heard,
    ended: bool,
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
    /// Something has happened in the folder.
    pub(super) fn stir(&self) {
        self.change(|state| state.heard.stirred = true);
    }

    /// The source of events has ended.
    pub(super) fn deafen(&self) {
        self.change(|state| state.heard.deaf = true);
    }

    /// Every file is to be read again.
    pub(super) fn reread(&self) {
        self.change(|state| state.heard.reread = true);
    }

    /// The thread is to end.
    pub(super) fn stop(&self) {
        self.change(|state| state.heard.stop = true);
    }

    /// Whether the thread is to end.
    pub(super) fn stopping(&self) -> bool {
        self.lock().heard.stop
    }

    /// Waits for a signal, until a time at the latest, and takes what was signalled.
    pub(super) fn wait(&self, until: Instant) -> Heard {
        let limit = until.saturating_duration_since(Instant::now());
        let (mut state, _) = self
            .changed
            .wait_timeout_while(self.lock(), limit, |state| state.heard == Heard::default())
            .unwrap_or_else(PoisonError::into_inner);
        let heard = state.heard;
        state.heard = Heard { stop: heard.stop, ..Heard::default() };
        heard
    }

    /// The thread has ended.
    pub(super) fn end(&self) {
        self.change(|state| state.ended = true);
    }

    /// Whether the thread has ended.
    pub(super) fn has_ended(&self) -> bool {
        self.lock().ended
    }

    /// Waits until the thread has ended; `false` where it does not within the limit.
    pub(super) fn wait_for_end(&self, limit: Duration) -> bool {
        let (state, _) = self
            .changed
            .wait_timeout_while(self.lock(), limit, |state| !state.ended)
            .unwrap_or_else(PoisonError::into_inner);
        state.ended
    }

    fn change(&self, change: impl FnOnce(&mut State)) {
        change(&mut self.lock());
        self.changed.notify_all();
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
