//! Writing a recording.

use std::collections::{BTreeMap, HashMap};
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use mcap::records::MessageHeader;
use mcap::{Compression, McapError, WriteOptions, Writer};

use super::{Attachment, CHANNELS, MESSAGE_ENCODING, Metadata, SCHEMA_ENCODING, ending, schema, view};
use crate::error::Error;
use crate::file::create_alone;
use crate::message::{Message, Topic};

/// Largest sum of messages in one chunk, before compression (bytes).
const CHUNK_BYTES: u64 = 1 << 20;
/// What a message takes in a chunk beside its frame (bytes).
const MESSAGE_BYTES: u64 = 31;

/// How a recording is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RecordingOptions {
    /// Whether chunks are compressed (zstd).
    pub compress: bool,
    /// A chunk ends when it holds more than this, before compression (bytes).
    pub chunk_bytes: u64,
    /// Whether a file that is there already is written over; one that is being written never is.
    pub overwrite: bool,
    /// Whether ticks and readings are written once more as JSON, for viewers.
    pub json: bool,
}

impl Default for RecordingOptions {
    fn default() -> Self {
        Self { compress: true, chunk_bytes: CHUNK_BYTES, overwrite: false, json: false }
    }
}

impl RecordingOptions {
    /// The same for the library that writes.
    pub(super) fn to_library(self) -> WriteOptions {
        WriteOptions::new()
            .profile("isotherm")
            .library(concat!("isotherm ", env!("CARGO_PKG_VERSION")))
            .compression(self.compress.then_some(Compression::Zstd))
            // A recorder has one thread to write with; the others are for the work that it records.
            .compression_threads(0)
            // Chunks end where this writer says, so that it knows what is whole; they are written in one go, so that a kill
            // leaves a shorter file, and no half chunk with a header that was to be filled in later.
            .chunk_size(None)
            .disable_seeking(true)
    }
}

/// A channel of the file.
#[derive(Debug)]
struct Channel {
    id: u16,
    /// Messages in it so far.
    messages: u64,
    /// The channel of the same as JSON: its number, and messages in it so far.
    view: Option<(u16, u64)>,
}

/// A recording that is being written.
///
/// It holds a lock on its file as long as it lives.
pub struct RecordingWriter {
    writer: Writer<BufWriter<Arc<File>>>,
    file: Arc<File>,
    path: PathBuf,
    chunk_bytes: u64,
    json: bool,
    // Looked up by topic, never gone through: its order reaches nothing.
    channels: HashMap<Topic, Channel>,
    /// Channels that no record beside the chunks names yet, by number.
    unnamed: BTreeMap<String, String>,
    /// Messages of the chunk that is being written.
    waiting: u64,
    /// Their bytes.
    waiting_bytes: u64,
    /// Up to here everything is whole and with the operating system (bytes).
    whole: u64,
}

impl std::fmt::Debug for RecordingWriter {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("RecordingWriter").field("path", &self.path).finish_non_exhaustive()
    }
}

impl RecordingWriter {
    /// Creates the file.
    ///
    /// # Errors
    /// [`Error::File`], also where it is there already, or is being written by somebody else.
    pub fn create(path: &Path, options: RecordingOptions) -> Result<Self, Error> {
        let file = Arc::new(create_alone(path, options.overwrite)?);
        let mut writer = options
            .to_library()
            .create(BufWriter::new(Arc::clone(&file)))
            .map_err(|source| failed(path, source))?;
        writer.flush().map_err(|source| failed(path, source))?;
        let mut writer = Self {
            writer,
            file,
            path: path.to_owned(),
            chunk_bytes: options.chunk_bytes,
            json: options.json,
            channels: HashMap::new(),
            unnamed: BTreeMap::new(),
            waiting: 0,
            waiting_bytes: 0,
            whole: 0,
        };
        writer.note_whole()?;
        Ok(writer)
    }

    /// Where it is written to.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Messages of the chunk that is being written: what a kill would cost now.
    #[must_use]
    pub fn waiting(&self) -> u64 {
        self.waiting
    }

    /// Length of the file so far, the chunk that is being written left out (bytes).
    #[must_use]
    pub fn length(&self) -> u64 {
        self.whole
    }

    /// Writes one message. Its publish time is the time on the producer's clock, where it has one.
    ///
    /// # Errors
    /// [`Error::File`]; nothing can be written behind it: see [`RecordingWriter::abandon`].
    pub fn write(&mut self, message: &Message) -> Result<(), Error> {
        let Message { topic, received_ns, frame } = message;
        let channel = if let Some(channel) = self.channels.get_mut(topic) {
            channel
        } else {
            let id = declare(&mut self.writer, topic).map_err(|source| failed(&self.path, source))?;
            self.unnamed.insert(id.to_string(), topic.key());
            let mut view = None;
            if self.json && view::schema(topic).is_some() {
                let key = view::key(topic);
                let id =
                    declare_view(&mut self.writer, topic).map_err(|source| failed(&self.path, source))?;
                self.unnamed.insert(id.to_string(), key);
                view = Some((id, 0));
            }
            self.channels.entry(topic.clone()).or_insert(Channel { id, messages: 0, view })
        };
        let time = message.time().and_then(|time| u64::try_from(time.as_ns()).ok());
        let header = MessageHeader {
            channel_id: channel.id,
            sequence: round(channel.messages),
            log_time: *received_ns,
            publish_time: time.unwrap_or(*received_ns),
        };
        self.writer.write_to_known_channel(&header, frame).map_err(|source| failed(&self.path, source))?;
        channel.messages += 1;
        self.waiting += 1;
        self.waiting_bytes += frame.len() as u64 + MESSAGE_BYTES;
        if let Some((id, messages)) = &mut channel.view {
            for point in view::points(message) {
                let (log_time, publish_time) = (point.log_ns, point.time_ns);
                let header =
                    MessageHeader { channel_id: *id, sequence: round(*messages), log_time, publish_time };
                let written = self.writer.write_to_known_channel(&header, &point.json);
                written.map_err(|source| failed(&self.path, source))?;
                *messages += 1;
                self.waiting_bytes += point.json.len() as u64 + MESSAGE_BYTES;
            }
        }
        if self.waiting_bytes > self.chunk_bytes { self.flush() } else { Ok(()) }
    }

    /// Puts a file into the recording; ends the chunk.
    ///
    /// # Errors
    /// As [`RecordingWriter::write`].
    pub fn attach(&mut self, attachment: &Attachment) -> Result<(), Error> {
        self.flush()?;
        let attached = self.writer.attach(&attachment.as_written()).and_then(|()| self.writer.flush());
        attached.map_err(|source| failed(&self.path, source))?;
        self.note_whole()
    }

    /// Writes a record of names and values; ends the chunk.
    ///
    /// # Errors
    /// As [`RecordingWriter::write`].
    pub fn metadata(&mut self, metadata: &Metadata) -> Result<(), Error> {
        self.flush()?;
        self.put_metadata(metadata.name.clone(), metadata.values.clone())?;
        self.note_whole()
    }

    /// Ends the chunk and hands everything to the operating system: a kill costs nothing written before it.
    ///
    /// # Errors
    /// As [`RecordingWriter::write`].
    pub fn flush(&mut self) -> Result<(), Error> {
        if self.waiting == 0 {
            return Ok(());
        }
        self.writer.flush().map_err(|source| failed(&self.path, source))?;
        (self.waiting, self.waiting_bytes) = (0, 0);
        self.note_whole()?;
        if !self.unnamed.is_empty() {
            // A channel stands in its first chunk and in the summary: with these records, a recording that was cut short
            // and lost that chunk is still to be read.
            let channels = std::mem::take(&mut self.unnamed);
            self.put_metadata(CHANNELS.to_owned(), channels)?;
            self.note_whole()?;
        }
        Ok(())
    }

    /// Ends the file with its summary, on the disk.
    ///
    /// # Errors
    /// As [`RecordingWriter::write`]; what was whole before is kept.
    pub fn finish(mut self) -> Result<(), Error> {
        let path = self.path.clone();
        let finished = self.flush().and_then(|()| {
            let finished = self.writer.finish().map_err(|source| failed(&path, source));
            finished.map(|_summary| ())
        });
        let Self { writer, file, whole, .. } = self;
        let mut buffered = writer.into_inner();
        let finished = finished.and_then(|()| {
            let synced = buffered.flush().and_then(|()| file.sync_all());
            synced.map_err(|source| Error::file(&path, "write the recording", source))
        });
        if finished.is_err() {
            // Nothing more of what waits in memory: it would land behind the cut.
            let _ = buffered.into_parts();
            let _ = ending::write(&file, whole, None);
        }
        finished
    }

    /// Gives the file up after an error: cuts it behind the last thing that was whole and ends it there, with a record of why
    /// where there is room for it. Without room it has no end, and is read all the same.
    pub fn abandon(self, why: &Metadata) {
        let Self { writer, file, whole, .. } = self;
        let _ = writer.into_inner().into_parts();
        let _ = ending::write(&file, whole, Some(why));
    }

    fn put_metadata(&mut self, name: String, values: BTreeMap<String, String>) -> Result<(), Error> {
        let metadata = mcap::records::Metadata { name, metadata: values };
        let put = self.writer.write_metadata(&metadata).and_then(|()| self.writer.flush());
        put.map_err(|source| failed(&self.path, source))
    }

    fn note_whole(&mut self) -> Result<(), Error> {
        let metadata = self.file.metadata();
        let failed = |source| Error::file(&self.path, "look at the recording", source);
        self.whole = metadata.map_err(failed)?.len();
        Ok(())
    }
}

/// A message's number in its channel: the format has 32 bits for it; it counts round.
fn round(messages: u64) -> u32 {
    u32::try_from(messages & u64::from(u32::MAX)).unwrap_or(0)
}

/// Enters a topic with its schema.
pub(super) fn declare(writer: &mut Writer<BufWriter<Arc<File>>>, topic: &Topic) -> Result<u16, McapError> {
    let schema = writer.add_schema(schema::name(topic), SCHEMA_ENCODING, schema::words(topic).as_bytes())?;
    enter(writer, schema, topic, &topic.key(), MESSAGE_ENCODING)
}

/// Enters the channel of the same as JSON, with its schema.
pub(super) fn declare_view(
    writer: &mut Writer<BufWriter<Arc<File>>>,
    topic: &Topic,
) -> Result<u16, McapError> {
    let (name, text) = view::schema(topic).unwrap_or_default();
    let schema = writer.add_schema(name, view::SCHEMA_ENCODING, text.as_bytes())?;
    enter(writer, schema, topic, &view::key(topic), view::ENCODING)
}

fn enter(
    writer: &mut Writer<BufWriter<Arc<File>>>,
    schema: u16,
    topic: &Topic,
    key: &str,
    encoding: &str,
) -> Result<u16, McapError> {
    let unit = topic.unit().map(|unit| ("unit".to_owned(), unit.to_string()));
    let metadata: BTreeMap<_, _> = unit.into_iter().collect();
    writer.add_channel(schema, key, encoding, &metadata)
}

/// An error of the library as one of this crate.
pub(super) fn failed(path: &Path, source: McapError) -> Error {
    Error::file(path, "write the recording", io_error(source))
}

/// An error of the library as one of the system.
#[must_use]
pub fn io_error(source: McapError) -> io::Error {
    match source {
        McapError::Io(source) => source,
        other => io::Error::other(other),
    }
}
