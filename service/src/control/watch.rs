//! The calibration folder as it changes: tells what the content of each document has become.
//!
//! Editors write in place, in two goes, beside the file and rename over it, or delete it and write it anew; network
//! shares send no events, and links change without their own folder noticing. All of that is one thing here: a thread
//! looks at the whole folder, and a file whose state differs from the last look is restless until it has stayed the
//! same for the settling time. Then it is read, and told if its *content* is not the one told last. Events of the file
//! system decide nothing: they only call for a look before the next poll. So a watch that was lost, or never was
//! granted, costs time and no change.
//!
//! | module | holds |
//! |---|---|
//! | `folder` | which files count, what a look and a reading see |
//! | `states` | what is known and was told of each file |
//! | `events` | events of the file system |
//! | `signals` | how a look is asked for, and the end |
//! | `worker` | the thread |

mod events;
mod folder;
mod signals;
mod states;
mod worker;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use isotherm_protocol::digest::Digest;

use crate::config::FolderSettings;

use self::events::FsEvents;
use self::signals::Signals;
use self::states::FileStates;
use self::worker::Worker;

pub(crate) use self::folder::{files_in, read_document};

/// How long an ending waits for the thread, which a dead network share may hold.
const STOP_LIMIT: Duration = Duration::from_secs(1);
/// How often it looks whether the thread has ended.
const STOP_INTERVAL: Duration = Duration::from_millis(1);

/// What has become of a document, or of the folder. Names of files are the folder's joined with the file's own.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum FolderEvent {
    /// A file has a content that is not the one told last, or is back with any content after it was unreadable or
    /// removed. A renamed file is changed under its new name first, and removed under its old one after the grace time.
    Changed {
        /// The file.
        file: PathBuf,
        /// Its content; of a longer file, one byte more than a document may have
        /// ([`MAX_DOCUMENT_BYTES`](isotherm_protocol::document::MAX_DOCUMENT_BYTES)).
        bytes: Vec<u8>,
    },
    /// A file cannot be read: no permission, a loop of links, a pipe, a folder in its place. Told once per reason.
    Unreadable {
        /// The file.
        file: PathBuf,
        /// Why, in words that go on after "cannot be read: ".
        reason: String,
    },
    /// A file that was told has been gone for longer than the grace time.
    Removed {
        /// The file.
        file: PathBuf,
    },
    /// Why the folder itself cannot be read for longer than the grace time, in words that go on after "cannot be read: ". Nothing is
    /// told of its files until it is back, without a reason: a lost network share does not remove a document. Told once per reason.
    Away(Option<String>),
    /// Why the system grants no events of the folder, so that changes are found by the poll alone; without a reason, events come again.
    /// Told once per reason.
    Deaf(Option<String>),
}

/// What the owner knows of files before the watcher starts, so that nothing is told twice: SHA-256 of the bytes, cut as those of
/// [`FolderEvent::Changed`], whether it was a good document or not; nothing of what was found and could not be read.
pub(crate) type Known = BTreeMap<PathBuf, Option<Digest>>;

/// How long a file, or the folder, may be gone without being called so.
fn grace(settings: &FolderSettings) -> Duration {
    settings.settle * 2
}

/// A watched folder. Ends with its thread when it is dropped.
#[derive(Debug)]
pub(crate) struct Watcher {
    signals: Arc<Signals>,
    thread: JoinHandle<()>,
}

impl Watcher {
    /// Begins to watch the `*.toml` of a folder, hidden files and sub-folders excepted.
    ///
    /// `known` is what was read of them before, by the names that events give. What differs from it is told first: read
    /// the folder, then start the watcher, and no change can fall between. `sink` is called from the watcher's own
    /// thread, one event at a time; while it works nothing is looked at, and nothing is lost.
    ///
    /// # Errors
    /// Where the system gives no thread. A folder that cannot be read is none: it is told as
    /// [`FolderEvent::Away`], and watched when it appears. Where the system grants no events, a warning is logged
    /// and the poll does all of the work.
    pub(crate) fn start(
        folder: &Path,
        settings: FolderSettings,
        known: Known,
        sink: impl Fn(FolderEvent) + Send + 'static,
    ) -> std::io::Result<Self> {
        Self::start_with(folder, settings, known, sink, events::listener)
    }

    /// The same with another source of events.
    fn start_with(
        folder: &Path,
        settings: FolderSettings,
        known: Known,
        sink: impl Fn(FolderEvent) + Send + 'static,
        listener: events::MakeListener,
    ) -> std::io::Result<Self> {
        let signals = Arc::new(Signals::default());
        let events = FsEvents::new(folder, settings.poll, Arc::clone(&signals), listener);
        let states = FileStates::new(settings, known);
        let work = Worker::new(folder, settings, (Arc::clone(&signals), events), states, sink);
        let thread = std::thread::Builder::new().name("isotherm-watcher".to_owned());
        Ok(Self { signals, thread: thread.spawn(move || work.run())? })
    }

    /// Has every file read and compared with what was told of it, soon.
    pub(crate) fn reread(&self) {
        self.signals.give(|heard| heard.reread = true);
    }

    /// Ends the watching; whether the thread ended within a second. One that a dead network share or the sink holds is
    /// left behind, and ends when it is let go.
    pub(crate) fn stop(&self) -> bool {
        self.signals.give(|heard| heard.stop = true);
        let limit = Instant::now() + STOP_LIMIT;
        while !self.thread.is_finished() && Instant::now() < limit {
            std::thread::sleep(STOP_INTERVAL);
        }
        self.thread.is_finished()
    }
}

impl Drop for Watcher {
    fn drop(&mut self) {
        if !self.signals.stopping() && !self.stop() {
            tracing::warn!(
                "the watcher of the calibration folder did not end within {STOP_LIMIT:?} and is abandoned"
            );
        }
    }
}

#[cfg(test)]
mod tests;
