//! The watcher's thread: looks, reads, tells.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

use super::events::FsEvents;
use super::folder::{self, Content, Sight, files_in};
use super::signals::Signals;
use super::states::FileStates;
use super::{FolderEvent, grace};
use crate::config::FolderSettings;

/// How many settled files are read and compared at each poll.
const COMPARED: usize = 64;
/// Longest distance of looks while the folder is away: one that is replaced should not be missed for a whole poll.
const AWAY: Duration = Duration::from_secs(1);

/// What the thread works with.
pub(super) struct Worker<S> {
    folder: PathBuf,
    settings: FolderSettings,
    signals: Arc<Signals>,
    events: FsEvents,
    states: FileStates,
    sink: S,
    outage: Option<Outage>,
    /// A look that an event, or the start, asked for.
    asked: Option<Instant>,
    /// The next look compares every file.
    reread: bool,
    last_look: Instant,
    next_poll: Instant,
}

/// The folder cannot be read.
struct Outage {
    since: Instant,
    told: Option<String>,
}

impl<S: Fn(FolderEvent)> Worker<S> {
    pub(super) fn new(
        folder: &Path,
        settings: FolderSettings,
        (signals, events): (Arc<Signals>, FsEvents),
        states: FileStates,
        sink: S,
    ) -> Self {
        let now = Instant::now();
        Self {
            folder: folder.to_owned(),
            settings,
            signals,
            events,
            states,
            sink,
            outage: None,
            asked: Some(now),
            reread: false,
            last_look: now,
            next_poll: now + settings.poll,
        }
    }

    /// Works until it is told to end.
    pub(super) fn run(mut self) {
        loop {
            let heard = self.signals.wait(self.next_look());
            if heard.stop {
                break;
            }
            if heard.deaf {
                self.events.deafen();
            }
            if heard.reread {
                self.reread = true;
                self.asked = Some(Instant::now());
            }
            if heard.deaf || heard.stirred {
                // Somebody who writes without a pause makes events without number: a few looks see as much.
                let soon = self.last_look + self.settings.settle / 4;
                self.asked.get_or_insert(soon.max(Instant::now()));
            }
            if self.next_look() <= Instant::now() {
                self.look();
            }
        }
    }

    /// When the folder is looked at next.
    fn next_look(&self) -> Instant {
        let own = match &self.outage {
            None => self.states.next_due(),
            Some(Outage { since, told: None }) => Some(*since + grace(&self.settings)),
            Some(Outage { told: Some(_), .. }) => Some(self.last_look + AWAY),
        };
        [own, self.asked].into_iter().flatten().fold(self.next_poll, Instant::min)
    }

    fn look(&mut self) {
        let now = Instant::now();
        let polling = now >= self.next_poll;
        // Before the look, so that what happens after it is heard.
        if (polling || self.events.are_deaf()) && self.events.tend() {
            (self.sink)(FolderEvent::Deaf(self.events.complaint.clone()));
        }
        self.asked = None;
        match files_in(&self.folder, "toml") {
            Ok(files) => {
                self.back();
                self.see(now, files);
                self.read_settled(now);
                if std::mem::take(&mut self.reread) {
                    self.compare(usize::MAX);
                } else if polling {
                    self.compare(COMPARED);
                }
            }
            Err(error) => self.away(now, error.to_string()),
        }
        self.last_look = Instant::now();
        if polling {
            self.next_poll = self.last_look + self.settings.poll;
        }
    }

    /// The folder cannot be read.
    fn away(&mut self, now: Instant, reason: String) {
        let grace = grace(&self.settings);
        let outage = self.outage.get_or_insert(Outage { since: now, told: None });
        if now >= outage.since + grace && outage.told.as_ref() != Some(&reason) {
            outage.told = Some(reason.clone());
            (self.sink)(FolderEvent::Away(Some(reason)));
        }
    }

    /// The folder can be read.
    fn back(&mut self) {
        if self.outage.take().is_some_and(|outage| outage.told.is_some()) {
            (self.sink)(FolderEvent::Away(None));
        }
    }

    /// Looks at every file, listed or known.
    fn see(&mut self, now: Instant, mut files: Vec<PathBuf>) {
        files.extend(self.states.files().cloned());
        files.sort();
        files.dedup();
        for file in files {
            self.states.see(now, &file, folder::look(&file));
        }
    }

    /// Tells what the settled files have become.
    fn read_settled(&mut self, now: Instant) {
        for file in self.states.due(now) {
            if self.signals.stopping() {
                return;
            }
            let event = match self.states.sight(&file) {
                None => None,
                Some(Sight::Absent) => self.states.removed(&file),
                Some(Sight::Odd(reason)) => {
                    let reason = reason.clone();
                    self.states.read(now, &file, Err(reason))
                }
                Some(Sight::File(_)) => {
                    let reading = self.read(&file);
                    reading.and_then(|reading| self.states.read(Instant::now(), &file, reading))
                }
            };
            if let Some(event) = event {
                (self.sink)(event);
            }
        }
    }

    /// Looks for changes that no stamp shows, a part of the files at a time. What is found is read again when it has
    /// settled.
    fn compare(&mut self, count: usize) {
        for file in self.states.next_to_compare(count) {
            if self.signals.stopping() {
                return;
            }
            if self.read(&file).is_some_and(|reading| !self.states.is_told(&file, &reading)) {
                self.states.stir(Instant::now(), &file);
            }
        }
    }

    /// Reads a file, or why it cannot be; `None` where it is a file no more, which is noted.
    fn read(&mut self, file: &Path) -> Option<Result<Content, String>> {
        let reading = folder::read(file);
        let seen = folder::look(file);
        if reading.is_err() && !matches!(seen, Sight::File(_)) {
            self.states.see(Instant::now(), file, seen);
            return None;
        }
        Some(reading.map_err(|error| error.to_string()))
    }
}
