//! Events of the file system, as far as they are granted.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use notify::event::{AccessKind, AccessMode, EventKind, ModifyKind};
use notify::{Config, Event, RecommendedWatcher, RecursiveMode, Watcher};

use super::folder::identity;
use super::signals::Signals;

/// Linux: too many open files, or as many listeners as a user may have.
const EMFILE: i32 = 24;

/// Makes the source of events of a folder; the path is absolute.
pub(super) type MakeListener = fn(PathBuf, Arc<Signals>) -> notify::Result<RecommendedWatcher>;

/// Listens to a folder for as long as it can, and begins anew where it had to end.
#[derive(Debug)]
pub(super) struct FsEvents {
    folder: PathBuf,
    poll: Duration,
    signals: Arc<Signals>,
    make: MakeListener,
    listener: Option<Listener>,
    /// Why there are no events, as it was logged.
    pub(super) complaint: Option<String>,
}

impl FsEvents {
    /// Deaf until [`FsEvents::tend`].
    pub(super) fn new(folder: &Path, poll: Duration, signals: Arc<Signals>, make: MakeListener) -> Self {
        // Events name files by absolute paths. Only an empty path has none, and leads nowhere.
        let folder = std::path::absolute(folder).unwrap_or_else(|_| folder.to_owned());
        Self { folder, poll, signals, make, listener: None, complaint: None }
    }

    /// Whether no event can come.
    pub(super) fn are_deaf(&self) -> bool {
        self.listener.is_none()
    }

    /// The watch has ended.
    pub(super) fn deafen(&mut self) {
        self.listener = None;
    }

    /// Sees to it that events come, and come from the folder that the path leads to now; whether there is another complaint than before.
    pub(super) fn tend(&mut self) -> bool {
        let Ok(identity) = identity(&self.folder) else {
            // What keeps the folder from being looked at is told by the look itself.
            self.deafen();
            return false;
        };
        if self.listener.as_ref().is_some_and(|listener| listener.identity != identity) {
            self.deafen();
        }
        let complaint = self.listen(identity).err().map(|error| reason(&error));
        if complaint.is_some() {
            self.deafen();
        }
        if complaint == self.complaint {
            return false;
        }
        let (folder, poll) = (self.folder.display(), self.poll);
        if let Some(reason) = &complaint {
            tracing::warn!(%folder, "the folder sends no events, it is polled every {poll:?}: {reason}");
        } else {
            tracing::info!(%folder, "the folder sends events again");
        }
        self.complaint = complaint;
        true
    }

    fn listen(&mut self, identity: (u64, u64)) -> notify::Result<()> {
        if self.listener.is_none() {
            let watcher = (self.make)(self.folder.clone(), Arc::clone(&self.signals))?;
            self.listener = Some(Listener { watcher: Some(watcher), identity });
        }
        let listener = self.listener.as_mut();
        let Some(watcher) = listener.and_then(|listener| listener.watcher.as_mut()) else { return Ok(()) };
        // Where the library's thread is gone everything but this panics.
        watcher.configure(Config::default())?;
        // Also where there is a watch: for one that is alive this changes nothing, and a folder that was unmounted and
        // mounted again looks the same while its watch is gone.
        watcher.watch(&self.folder, RecursiveMode::NonRecursive)
    }
}

/// Why there are no events, and what to do about it where something can be done.
fn reason(error: &notify::Error) -> String {
    match &error.kind {
        notify::ErrorKind::MaxFilesWatch => {
            "no more watches are available: raise fs.inotify.max_user_watches".to_owned()
        }
        notify::ErrorKind::Io(io) if io.raw_os_error() == Some(EMFILE) => {
            format!("{io}: raise fs.inotify.max_user_instances or the limit of open files")
        }
        _ => error.to_string(),
    }
}

/// A source of events at work.
#[derive(Debug)]
struct Listener {
    /// `None` only while it is dropped.
    watcher: Option<RecommendedWatcher>,
    identity: (u64, u64),
}

impl Drop for Listener {
    fn drop(&mut self) {
        let Some(mut watcher) = self.watcher.take() else { return };
        if watcher.configure(Config::default()).is_err() {
            // Its thread is gone, and it would panic over that when it is dropped. It holds no more than a pipe's end.
            std::mem::forget(watcher);
        }
    }
}

/// The operating system's events.
pub(super) fn listener(folder: PathBuf, signals: Arc<Signals>) -> notify::Result<RecommendedWatcher> {
    let hear = move |event: notify::Result<Event>| match event {
        Ok(event) if is_own_end(&event, &folder) => signals.give(|heard| heard.deaf = true),
        Ok(event) if is_news(event.kind) => signals.give(|heard| heard.stirred = true),
        Ok(_) => {}
        Err(_) => signals.give(|heard| heard.deaf = true),
    };
    RecommendedWatcher::new(hear, Config::default())
}

/// Whether the folder itself has gone elsewhere.
fn is_own_end(event: &Event, folder: &Path) -> bool {
    let gone = matches!(event.kind, EventKind::Remove(_) | EventKind::Modify(ModifyKind::Name(_)));
    gone && event.paths.iter().any(|path| path == folder)
}

/// Whether something may have changed. Opening and reading is what every look does itself.
fn is_news(kind: EventKind) -> bool {
    !matches!(kind, EventKind::Access(access) if access != AccessKind::Close(AccessMode::Write))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_limit_is_named_with_the_setting_that_raises_it() {
        let words = |kind| reason(&notify::Error::new(kind));
        assert!(words(notify::ErrorKind::MaxFilesWatch).contains("fs.inotify.max_user_watches"));
        let io = |code| words(notify::ErrorKind::Io(std::io::Error::from_raw_os_error(code)));
        assert!(io(EMFILE).contains("fs.inotify.max_user_instances"));
        assert!(!io(5).contains("fs.inotify"));
    }
}
