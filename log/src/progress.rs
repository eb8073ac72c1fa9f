//! How far a log has been read.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// How far a log has been read; cheap to clone and to ask from another thread.
#[derive(Debug, Clone)]
pub struct Progress {
    /// Bytes read of all files, compressed where they are.
    read: Arc<AtomicU64>,
    /// Bytes of all files.
    total: u64,
}

impl Progress {
    /// Of `total` bytes, so many as `read` counts.
    pub(crate) fn new(read: Arc<AtomicU64>, total: u64) -> Self {
        Self { read, total }
    }

    /// Bytes read so far.
    #[must_use]
    pub fn read(&self) -> u64 {
        self.read.load(Ordering::Relaxed)
    }

    /// Bytes there are.
    #[must_use]
    pub fn total(&self) -> u64 {
        self.total
    }

    /// Bytes there are, and how many have been read: what a progress bar takes.
    pub fn watch(&self) -> (u64, impl Fn() -> u64 + Send + Sync + use<>) {
        let watched = self.clone();
        (self.total, move || watched.read())
    }
}
