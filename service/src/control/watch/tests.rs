//! On real folders. Every wait is for an event; that nothing is told is shown by the event after it.

mod documents;
mod end;
mod lost;
mod whole;

use std::fs;
use std::sync::mpsc::{Receiver, channel};

use tempfile::TempDir;

use super::*;

/// How the watcher is to find out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum By {
    /// By events alone: no poll in a test's time.
    Events,
    /// By the poll alone.
    Poll,
    /// By either.
    Both,
}

impl By {
    fn settings(self) -> FolderSettings {
        let poll = Duration::from_millis(if self == Self::Events { 3_600_000 } else { 50 });
        FolderSettings { poll, ..FolderSettings::default() }
    }

    fn listener(self) -> events::MakeListener {
        if self == Self::Poll { |_, _| Err(notify::Error::generic("none")) } else { events::listener }
    }
}

/// A watched folder and what was told of it.
struct Scene {
    temporary: TempDir,
    folder: PathBuf,
    told: Receiver<FolderEvent>,
    watcher: Watcher,
}

impl Scene {
    /// A folder `calibration` with these files, watched, the files told.
    fn new(by: By, files: &[(&str, &str)]) -> Self {
        Self::with(by.settings(), by.listener(), |folder| {
            for (name, text) in files {
                fs::write(folder.join(name), text).unwrap();
            }
        })
        .told_first(files)
    }

    /// A folder as `prepare` leaves it, watched.
    fn with(settings: FolderSettings, listener: events::MakeListener, prepare: impl FnOnce(&Path)) -> Self {
        let temporary = TempDir::new().unwrap();
        let folder = temporary.path().join("calibration");
        fs::create_dir(&folder).unwrap();
        prepare(&folder);
        let (sink, told) = channel();
        let watcher = Watcher::start_with(
            &folder,
            settings,
            BTreeMap::new(),
            move |event| sink.send(event).unwrap(),
            listener,
        )
        .unwrap();
        Self { temporary, folder, told, watcher }
    }

    /// Waits for the first tellings, after which the watch stands.
    fn told_first(self, files: &[(&str, &str)]) -> Self {
        self.write("z-first.toml", "first");
        for (name, text) in files {
            self.expect(&self.changed(name, text));
        }
        self.expect(&self.changed("z-first.toml", "first"));
        self
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.join(name)
    }

    fn write(&self, name: &str, text: &str) {
        fs::write(self.path(name), text).unwrap();
    }

    fn changed(&self, name: &str, text: &str) -> FolderEvent {
        FolderEvent::Changed { file: self.path(name), bytes: text.as_bytes().to_owned() }
    }

    fn removed(&self, name: &str) -> FolderEvent {
        FolderEvent::Removed { file: self.path(name) }
    }

    /// What is told of files and folder next.
    fn next(&self) -> FolderEvent {
        loop {
            match self.next_of_all() {
                FolderEvent::Deaf(_) => {}
                told => return told,
            }
        }
    }

    fn next_of_all(&self) -> FolderEvent {
        self.told.recv_timeout(Duration::from_secs(10)).expect("an event within its time")
    }

    #[track_caller]
    fn expect(&self, event: &FolderEvent) {
        assert_eq!(self.next(), *event);
    }

    #[track_caller]
    fn expect_unreadable(&self, name: &str, words: &str) {
        match self.next() {
            FolderEvent::Unreadable { file, reason } if file == self.path(name) => {
                assert!(reason.contains(words), "{reason}");
            }
            other => panic!("{other:?}"),
        }
    }

    /// Nothing is told of what happened before. A file that comes and goes is told in time after it, be it a change or
    /// a removal that was on its way.
    #[track_caller]
    fn expect_nothing(&self) {
        self.write("zz-marker.toml", "here");
        self.expect(&self.changed("zz-marker.toml", "here"));
        fs::remove_file(self.path("zz-marker.toml")).unwrap();
        self.expect(&self.removed("zz-marker.toml"));
    }
}

/// Runs a test by events alone and by the poll alone.
fn either_way(test: impl Fn(By)) {
    for by in [By::Events, By::Poll] {
        println!("{by:?}");
        test(by);
    }
}
