//! Writing a recording.

use std::collections::{BTreeMap, HashMap};
use std::fs::File;
use std::io::{self, BufWriter, Seek, Write};
use std::path::{Path, PathBuf};

use mcap::records::MessageHeader;
use mcap::{Compression, McapError, WriteOptions, Writer};

use super::{Attachment, MESSAGE_ENCODING, Metadata, SCHEMA_ENCODING, schema};
use crate::error::Error;
use crate::message::{Message, Topic};

/// Largest sum of messages in one chunk, before compression (bytes).
const CHUNK_BYTES: u64 = 1 << 20;

/// How a recording is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RecordingOptions {
    /// Whether chunks are compressed (zstd).
    pub compress: bool,
    /// A chunk ends when it holds more than this, before compression (bytes).
    pub chunk_bytes: u64,
}

impl Default for RecordingOptions {
    fn default() -> Self {
        Self { compress: true, chunk_bytes: CHUNK_BYTES }
    }
}

/// A channel of the file.
#[derive(Debug)]
struct Channel {
    id: u16,
    /// Messages in it so far.
    messages: u64,
}

/// A recording that is being written.
pub struct RecordingWriter {
    writer: Writer<BufWriter<File>>,
    path: PathBuf,
    // Looked up by topic, never gone through: its order reaches nothing.
    channels: HashMap<Topic, Channel>,
}

impl std::fmt::Debug for RecordingWriter {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("RecordingWriter").field("path", &self.path).finish_non_exhaustive()
    }
}

impl RecordingWriter {
    /// Creates the file; one that is there already is not written over.
    ///
    /// # Errors
    /// [`Error::File`].
    pub fn create(path: &Path, options: RecordingOptions) -> Result<Self, Error> {
        let file =
            File::create_new(path).map_err(|source| Error::file(path, "create the recording", source))?;
        let options = WriteOptions::new()
            .profile("isotherm")
            .library(concat!("isotherm ", env!("CARGO_PKG_VERSION")))
            .compression(options.compress.then_some(Compression::Zstd))
            .chunk_size(Some(options.chunk_bytes));
        let writer = options.create(BufWriter::new(file)).map_err(|source| failed(path, source))?;
        Ok(Self { writer, path: path.to_owned(), channels: HashMap::new() })
    }

    /// Where it is written to.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Messages of a topic so far.
    #[must_use]
    pub fn messages(&self, topic: &Topic) -> u64 {
        self.channels.get(topic).map_or(0, |channel| channel.messages)
    }

    /// Writes one message. Its publish time is the time on the producer's clock, where it has one.
    ///
    /// # Errors
    /// [`Error::File`]; nothing can be written behind it.
    pub fn write(&mut self, message: &Message) -> Result<(), Error> {
        let Message { topic, received_ns, frame } = message;
        let channel = match self.channels.get_mut(topic) {
            Some(channel) => channel,
            None => {
                let id = declare(&mut self.writer, topic).map_err(|source| failed(&self.path, source))?;
                self.channels.entry(topic.clone()).or_insert(Channel { id, messages: 0 })
            }
        };
        let time = message.time().and_then(|time| u64::try_from(time.as_ns()).ok());
        let header = MessageHeader {
            channel_id: channel.id,
            // The format has 32 bits for it; it counts round.
            sequence: u32::try_from(channel.messages & u64::from(u32::MAX)).unwrap_or(0),
            log_time: *received_ns,
            publish_time: time.unwrap_or(*received_ns),
        };
        self.writer.write_to_known_channel(&header, frame).map_err(|source| failed(&self.path, source))?;
        channel.messages += 1;
        Ok(())
    }

    /// Puts a file into the recording.
    ///
    /// # Errors
    /// As [`RecordingWriter::write`].
    pub fn attach(&mut self, attachment: &Attachment) -> Result<(), Error> {
        let Attachment { name, media_type, attached_ns, bytes } = attachment;
        let attachment = mcap::Attachment {
            log_time: *attached_ns,
            create_time: *attached_ns,
            name: name.clone(),
            media_type: media_type.clone(),
            data: bytes.as_slice().into(),
        };
        self.writer.attach(&attachment).map_err(|source| failed(&self.path, source))
    }

    /// Writes a record of names and values.
    ///
    /// # Errors
    /// As [`RecordingWriter::write`].
    pub fn metadata(&mut self, metadata: &Metadata) -> Result<(), Error> {
        let metadata =
            mcap::records::Metadata { name: metadata.name.clone(), metadata: metadata.values.clone() };
        self.writer.write_metadata(&metadata).map_err(|source| failed(&self.path, source))
    }

    /// Ends the chunk and hands everything to the operating system: a kill costs nothing written before it.
    ///
    /// # Errors
    /// As [`RecordingWriter::write`].
    pub fn flush(&mut self) -> Result<(), Error> {
        self.writer.flush().map_err(|source| failed(&self.path, source))
    }

    /// Length of the file so far, the chunk that is being written left out (bytes).
    ///
    /// # Errors
    /// [`Error::File`].
    pub fn length(&self) -> Result<u64, Error> {
        let length = std::fs::metadata(&self.path).map(|metadata| metadata.len());
        length.map_err(|source| Error::file(&self.path, "look at the recording", source))
    }

    /// Ends the file with its summary, on the disk.
    ///
    /// # Errors
    /// As [`RecordingWriter::write`].
    pub fn finish(mut self) -> Result<(), Error> {
        self.writer.finish().map_err(|source| failed(&self.path, source))?;
        let path = self.path;
        let failed = |source| Error::file(&path, "write the recording", source);
        let mut buffered = self.writer.into_inner();
        buffered.flush().map_err(failed)?;
        buffered.seek(io::SeekFrom::End(0)).map_err(failed)?;
        buffered.get_ref().sync_all().map_err(failed)
    }
}

/// Enters a topic with its schema.
fn declare(writer: &mut Writer<BufWriter<File>>, topic: &Topic) -> Result<u16, McapError> {
    let schema = writer.add_schema(schema::name(topic), SCHEMA_ENCODING, schema::words(topic).as_bytes())?;
    let unit = topic.unit().map(|unit| ("unit".to_owned(), unit.to_string()));
    let metadata: BTreeMap<_, _> = unit.into_iter().collect();
    writer.add_channel(schema, &topic.key(), MESSAGE_ENCODING, &metadata)
}

fn failed(path: &Path, source: McapError) -> Error {
    let source = match source {
        McapError::Io(source) => source,
        other => io::Error::other(other),
    };
    Error::file(path, "write the recording", source)
}
