//! The thread that writes.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;
use std::time::{Duration, Instant};

use isotherm_log::message::{Message, Topic};
use isotherm_log::recording::{Attachment, Documents, RecordingOptions, RecordingWriter};
use isotherm_protocol::codec;
use isotherm_protocol::journal::JournalPart;
use tokio::sync::mpsc::UnboundedSender;

use super::files::Files;
use super::queue::{Item, Queue, Taken};
use super::report::Done;
use super::told::{beginning, end};
use crate::error::Error;

/// How long the thread waits where nothing is due.
const IDLE: Duration = Duration::from_millis(200);

/// When files and chunks end.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Bounds {
    /// A chunk ends after this long at the latest: what a kill can cost.
    pub(crate) chunk: Duration,
    /// A file ends with the chunk that makes it this long (bytes).
    pub(crate) file_bytes: Option<u64>,
    /// A file ends with the first message this long after its beginning.
    pub(crate) file_time: Option<Duration>,
}

/// What the thread tells.
#[derive(Debug)]
pub(super) enum Told {
    /// A file has begun.
    Begun,
    /// Something that somebody should know.
    Warning(String),
    /// Nothing more can be written.
    Failed,
}

/// The thread's work.
pub(super) struct FileWriter {
    queue: Arc<Queue>,
    files: Files,
    writing: RecordingOptions,
    bounds: Bounds,
    /// What the beginning of every file says of how it was recorded.
    described: Vec<(&'static str, String)>,
    told: UnboundedSender<Told>,
    current: Current,
    /// By number.
    topics: Vec<Topic>,
    /// Messages of the chunk that is being written, by number of their topic.
    pending: Vec<u64>,
    journal: Documents,
    /// Keys of journals in the middle of an entry, and the answers that wait for its end.
    open: BTreeMap<String, Vec<Item>>,
    attachments: u64,
    /// Length of the files before the current one (bytes).
    before_bytes: u64,
}

/// The file that is being written.
struct Current {
    writer: RecordingWriter,
    begun: Instant,
    /// When the chunk's first message was written.
    chunk_begun: Option<Instant>,
    /// Names of what is attached.
    attached: BTreeSet<String>,
    /// Messages by number of their topic.
    written: Vec<u64>,
    /// Lost before it began, likewise.
    lost_before: Vec<u64>,
}

impl FileWriter {
    /// Begins the first file.
    ///
    /// # Errors
    /// [`Error::Log`] where it cannot be created.
    pub(super) fn begin(
        queue: Arc<Queue>,
        mut files: Files,
        writing: RecordingOptions,
        bounds: Bounds,
        described: Vec<(&'static str, String)>,
        told: UnboundedSender<Told>,
    ) -> Result<Self, Error> {
        let current = Current::begin(&mut files, writing, &described, Vec::new())?;
        let _ = told.send(Told::Begun);
        Ok(Self {
            queue,
            files,
            writing,
            bounds,
            described,
            told,
            current,
            topics: Vec::new(),
            pending: Vec::new(),
            journal: Documents::default(),
            open: BTreeMap::new(),
            attachments: 0,
            before_bytes: 0,
        })
    }

    /// Writes until the queue is closed and empty, or nothing can be written any more.
    pub(super) fn run(mut self) -> Done {
        let written = self.write_all();
        let Self { queue, current, files, told, journal, topics, attachments, pending, .. } = self;
        let finished = match written {
            Ok(()) => current.finish("end of the recording", &topics, &queue.lost()),
            Err(error) => {
                current.give_up(&error, &topics, &pending);
                Err(error)
            }
        };
        let failure = finished.err();
        if failure.is_some() {
            queue.fail();
            let _ = told.send(Told::Failed);
        }
        let (mut raw, mut corrected) = (BTreeSet::new(), BTreeSet::new());
        for topic in &topics {
            match topic {
                Topic::Raw(unit, _) => raw.insert(unit.to_string()),
                Topic::Corrected(unit) => corrected.insert(unit.to_string()),
                _ => false,
            };
        }
        let units_without_raw = corrected.difference(&raw).cloned().collect();
        raw.retain(|unit| !journal.knows(unit));
        Done {
            // The last may not have come into being.
            files: files.kept.iter().filter(|path| path.exists()).cloned().collect(),
            files_deleted: files.deleted,
            attachments,
            journal: journal.account().clone(),
            units_without_memory: raw.into_iter().collect(),
            units_without_raw,
            failure: failure.map(|error| error.to_string()),
        }
    }

    fn write_all(&mut self) -> Result<(), Error> {
        loop {
            let Taken { items, bytes, over } = self.queue.take(self.patience());
            for item in items {
                self.take(item)?;
            }
            self.queue.done(bytes);
            if over {
                let waiting: Vec<_> = std::mem::take(&mut self.open).into_values().flatten().collect();
                waiting.into_iter().try_for_each(|item| self.write(item))?;
                let flushed = self.current.writer.flush();
                return self.note(flushed);
            }
            if self.current.chunk_begun.is_some_and(|begun| begun.elapsed() >= self.bounds.chunk) {
                let flushed = self.current.writer.flush();
                self.note(flushed)?;
            }
        }
    }

    /// How long to wait for something to write.
    fn patience(&self) -> Duration {
        let chunk = self.current.chunk_begun.map(|begun| self.bounds.chunk.saturating_sub(begun.elapsed()));
        chunk.unwrap_or(IDLE).min(IDLE)
    }

    /// Writes what was taken, in an order that keeps the parts of an entry together.
    fn take(&mut self, item: Item) -> Result<(), Error> {
        if self.is_file_over() {
            self.rotate()?;
        }
        let (number, part) = match &item {
            Item::Message { topic, frame, .. } => (*topic, Some(frame)),
            Item::Memory { topic, .. } => (*topic, None),
            Item::Attachment(_) => return self.write(item),
        };
        let Topic::Journal(_) = self.topic(number) else { return self.write(item) };
        let key = self.topic(number).key();
        let Some(frame) = part else {
            if let Some(waiting) = self.open.get_mut(&key) {
                waiting.push(item);
                return Ok(());
            }
            return self.write(item);
        };
        let part = codec::decode::<JournalPart>(frame).ok();
        let goes_on = part.is_some_and(|part| part.part + 1 < part.parts);
        self.write(item)?;
        if goes_on {
            self.open.entry(key).or_default();
        } else if let Some(waiting) = self.open.remove(&key) {
            waiting.into_iter().try_for_each(|item| self.write(item))?;
        }
        Ok(())
    }

    fn write(&mut self, item: Item) -> Result<(), Error> {
        match item {
            Item::Message { topic, received_ns, frame } => self.write_frame(topic, received_ns, frame),
            Item::Memory { topic, received_ns, frames } => {
                frames.into_iter().try_for_each(|frame| self.write_frame(topic, received_ns, frame))
            }
            Item::Attachment(attachment) => self.attach(&attachment),
        }
    }

    fn write_frame(&mut self, number: usize, received_ns: u64, frame: Vec<u8>) -> Result<(), Error> {
        let message = Message { topic: self.topic(number).clone(), received_ns, frame };
        let written = self.current.writer.write(&message);
        if written.is_ok() {
            for counts in [&mut self.pending, &mut self.current.written] {
                counts.resize(counts.len().max(number + 1), 0);
                if let Some(count) = counts.get_mut(number) {
                    *count += 1;
                }
            }
            self.current.chunk_begun.get_or_insert_with(Instant::now);
        }
        self.note(written)?;
        if let Topic::Journal(_) = message.topic {
            for document in self.journal.take(&message.frame, received_ns) {
                self.attach(&document)?;
            }
        }
        Ok(())
    }

    /// Attaches a file, once to each recording file.
    fn attach(&mut self, attachment: &Attachment) -> Result<(), Error> {
        if !self.current.attached.insert(attachment.name.clone()) {
            return Ok(());
        }
        self.attachments += 1;
        let attached = self.current.writer.attach(attachment);
        self.note(attached)
    }

    /// Enters what is in the file now.
    fn note(&mut self, result: Result<(), isotherm_log::error::Error>) -> Result<(), Error> {
        if self.current.writer.waiting() == 0 {
            self.current.chunk_begun = None;
            self.queue.written(&mut self.pending, self.before_bytes + self.current.writer.length());
        }
        Ok(result?)
    }

    fn is_file_over(&self) -> bool {
        let Bounds { file_bytes, file_time, .. } = self.bounds;
        file_bytes.is_some_and(|limit| self.current.writer.length() >= limit)
            || file_time.is_some_and(|limit| self.current.begun.elapsed() >= limit)
    }

    /// Ends the file and begins the next one: between two messages.
    fn rotate(&mut self) -> Result<(), Error> {
        let flushed = self.current.writer.flush();
        self.note(flushed)?;
        let lost = self.queue.lost();
        let next = Current::begin(&mut self.files, self.writing, &self.described, lost.clone())?;
        let full = std::mem::replace(&mut self.current, next);
        let path = full.writer.path().to_owned();
        full.finish("next file", &self.topics, &lost)?;
        let length = std::fs::metadata(&path).map(|metadata| metadata.len());
        self.before_bytes += length.map_err(|source| Error::file(&path, "look at the recording", source))?;
        if let Some(words) = self.files.prune() {
            let _ = self.told.send(Told::Warning(words));
        }
        let _ = self.told.send(Told::Begun);
        Ok(())
    }

    /// A topic by its number.
    fn topic(&mut self, number: usize) -> &Topic {
        /// Stands for a number that the queue never gave.
        static NOWHERE: Topic = Topic::Other(String::new());
        if number >= self.topics.len() {
            self.topics.extend(self.queue.topics(self.topics.len()));
        }
        self.topics.get(number).unwrap_or(&NOWHERE)
    }
}

impl Current {
    fn begin(
        files: &mut Files,
        writing: RecordingOptions,
        described: &[(&'static str, String)],
        lost_before: Vec<u64>,
    ) -> Result<Self, Error> {
        let path = files.advance()?;
        let mut writer = RecordingWriter::create(&path, writing)?;
        writer.metadata(&beginning(described, files.number))?;
        Ok(Self {
            writer,
            begun: Instant::now(),
            chunk_begun: None,
            attached: BTreeSet::new(),
            written: Vec::new(),
            lost_before,
        })
    }

    /// Ends the file where nothing more can be written; `pending` are in no whole chunk.
    fn give_up(self, error: &Error, topics: &[Topic], pending: &[u64]) {
        let mut written = self.written;
        for (written, pending) in written.iter_mut().zip(pending) {
            *written -= *pending;
        }
        // A record of why stands in the file, where there is room for it.
        self.writer.abandon(&end(&format!("writing failed: {error}"), topics, &written, pending));
    }

    /// Ends the file with its counts; `lost` is of the whole recording.
    fn finish(mut self, why: &str, topics: &[Topic], lost: &[u64]) -> Result<(), Error> {
        let lost: Vec<_> = lost
            .iter()
            .enumerate()
            .map(|(number, lost)| lost - self.lost_before.get(number).copied().unwrap_or(0))
            .collect();
        let said = self.writer.metadata(&end(why, topics, &self.written, &lost));
        match said {
            Ok(()) => Ok(self.writer.finish()?),
            Err(error) => {
                self.writer.abandon(&end(why, topics, &self.written, &lost));
                Err(error.into())
            }
        }
    }
}
