//! Reading a recording from front to back, in constant memory.

use std::collections::{HashMap, VecDeque};
use std::fs::File;
use std::io::{self, Read, Seek};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use mcap::McapError;
use mcap::records::{Record, op};
use mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};
use serde::Serialize;

use super::record::{LONGEST_RECORD, chunk_records, parse};
use super::skip::{Front, pass_over};
use super::{Attachment, CHANNELS, MESSAGE_ENCODING, Metadata, view};
use crate::error::Error;
use crate::file::open_log;
use crate::message::{Message, Topic};

/// What reading a recording came to.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize)]
pub struct RecordingReport {
    /// Messages read.
    pub messages: u64,
    /// Messages of channels that are no frames of the wire, passed over.
    pub foreign_messages: u64,
    /// Why reading stopped before the end of a file, if it did; what was whole before it has been read.
    pub cut_short: Option<String>,
}

impl RecordingReport {
    /// Whether anything of the log was lost.
    #[must_use]
    pub fn lost_data(&self) -> bool {
        self.cut_short.is_some()
    }
}

/// Bytes that are read at once.
const BLOCK: usize = 1 << 16;

/// Reads the messages of one or several recordings, one after the other, as they were written.
///
/// A file that ends in the middle, as after a kill, is read to its last whole chunk; the report says so.
pub struct RecordingReader {
    /// Files still to be opened, the next one last.
    waiting: Vec<PathBuf>,
    /// Chunks whose messages were all received before this are passed over where a file begins with them (ns).
    before_ns: u64,
    current: Option<Opened>,
    read: Arc<AtomicU64>,
    report: RecordingReport,
    attachments: Vec<Attachment>,
    metadata: Vec<Metadata>,
}

/// A file that is being read.
struct Opened {
    path: PathBuf,
    file: File,
    reader: LinearReader,
    /// From the part that was passed over, then from the last chunk.
    found: VecDeque<Found>,
    /// What each channel carries.
    topics: HashMap<u16, Carries>,
    /// The last whole file's end has been seen.
    ended: bool,
}

impl std::fmt::Debug for RecordingReader {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("RecordingReader").field("report", &self.report).finish_non_exhaustive()
    }
}

impl RecordingReader {
    /// Opens recordings, to be read in this order; `read` counts their bytes as they are read.
    ///
    /// # Errors
    /// [`Error::File`] where the first cannot be opened or is no MCAP file.
    pub fn open(paths: &[PathBuf], read: Arc<AtomicU64>) -> Result<Self, Error> {
        Self::open_at(paths, 0, read)
    }

    /// Likewise, for who needs no message that was received before a time (ns since 1970-01-01 UTC).
    ///
    /// Whole chunks of such messages at the front of a file are passed over unread: they are in no message, and in no count of
    /// the report. What stands beside the chunks is read all the same, and messages of the first chunk that has a later one
    /// come with it.
    ///
    /// # Errors
    /// As [`RecordingReader::open`].
    pub fn open_at(paths: &[PathBuf], before_ns: u64, read: Arc<AtomicU64>) -> Result<Self, Error> {
        let mut reader = Self {
            waiting: paths.iter().rev().cloned().collect(),
            before_ns,
            current: None,
            read,
            report: RecordingReport::default(),
            attachments: Vec::new(),
            metadata: Vec::new(),
        };
        reader.advance()?;
        Ok(reader)
    }

    /// What reading came to so far.
    #[must_use]
    pub fn report(&self) -> &RecordingReport {
        &self.report
    }

    /// Files inside the recordings that were come across and not taken yet.
    pub fn take_attachments(&mut self) -> Vec<Attachment> {
        std::mem::take(&mut self.attachments)
    }

    /// Records of names and values, likewise.
    pub fn take_metadata(&mut self) -> Vec<Metadata> {
        std::mem::take(&mut self.metadata)
    }

    /// The next message; `None` behind the last.
    ///
    /// # Errors
    /// [`Error::File`] where a file cannot be opened or read. A file that is cut short is no error: see [`RecordingReport::cut_short`].
    pub fn next_message(&mut self) -> Result<Option<Message>, Error> {
        loop {
            let Some(opened) = &mut self.current else { return Ok(None) };
            match opened.next(&self.read) {
                Ok(Some(Found::Message(Some(message)))) => {
                    self.report.messages += 1;
                    return Ok(Some(message));
                }
                Ok(Some(Found::Message(None))) => self.report.foreign_messages += 1,
                Ok(Some(Found::Attachment(attachment))) => self.attachments.push(attachment),
                Ok(Some(Found::Metadata(metadata))) => self.metadata.push(metadata),
                Ok(None) => self.advance()?,
                Err(Stop::Io(source)) => return Err(Error::file(&opened.path, "read the recording", source)),
                Err(Stop::Damaged(words)) => {
                    let words = format!("{}: {words}", opened.path.display());
                    self.report.cut_short.get_or_insert(words);
                    self.advance()?;
                }
            }
        }
    }

    /// Goes on to the next file.
    fn advance(&mut self) -> Result<(), Error> {
        let next = self.waiting.pop();
        self.current = next.map(|path| Opened::open(path, self.before_ns, &self.read)).transpose()?;
        Ok(())
    }
}

/// What a channel carries.
pub(super) enum Carries {
    /// Frames of a topic.
    Frames(Topic),
    /// What stands in frames too.
    View,
    /// Something else.
    Foreign,
}

/// One record that is of use.
pub(super) enum Found {
    /// A message; `None` for one of something else.
    Message(Option<Message>),
    Attachment(Attachment),
    Metadata(Metadata),
}

/// Why a file is read no further.
enum Stop {
    Io(io::Error),
    Damaged(String),
}

impl Opened {
    fn open(path: PathBuf, before_ns: u64, read: &AtomicU64) -> Result<Self, Error> {
        let failed = |source| Error::file(&path, "open the recording", source);
        let mut file = open_log(&path, "open the recording")?;
        let mut magic = [0; 8];
        let length = read_up_to(&mut file, &mut magic).map_err(failed)?;
        if magic.get(..length) != Some(super::MAGIC) {
            return Err(failed(io::Error::other("it does not begin as an MCAP file")));
        }
        let options = LinearReaderOptions::default()
            .with_skip_start_magic(true)
            .with_emit_chunks(true)
            .with_record_length_limit(LONGEST_RECORD);
        let reader = LinearReader::new_with_options(options);
        let mut front = Front { at: length as u64, ..Front::default() };
        if before_ns > 0 {
            front = pass_over(&mut file, before_ns)
                .map_err(|source| Error::file(&path, "read the recording", source))?;
        }
        let Front { found, topics, at } = front;
        read.fetch_add(at, Ordering::Relaxed);
        Ok(Self { path, file, reader, found: found.into(), topics, ended: false })
    }

    /// The next record that is of use; `None` at the end.
    fn next(&mut self, read: &AtomicU64) -> Result<Option<Found>, Stop> {
        if let Some(found) = self.found.pop_front() {
            return Ok(Some(found));
        }
        loop {
            let Some(event) = self.reader.next_event() else {
                // The library is content where a file ends between two records.
                return if self.ended {
                    Ok(None)
                } else {
                    Err(Stop::Damaged("ends without its summary".to_owned()))
                };
            };
            match event.map_err(stop)? {
                LinearReadEvent::ReadRequest(need) => {
                    let room = self.room_for(need).map_err(Stop::Io)?;
                    let count = self.file.read(self.reader.insert(room)).map_err(Stop::Io)?;
                    read.fetch_add(count as u64, Ordering::Relaxed);
                    self.reader.notify_read(count);
                }
                // All of its records or none: the library's own walk through a chunk goes on behind its end.
                LinearReadEvent::Record { opcode: op::CHUNK, data } => {
                    for record in chunk_records(data).map_err(stop)? {
                        self.found.extend(take(record, &mut self.topics, &mut self.ended));
                    }
                    if let Some(found) = self.found.pop_front() {
                        return Ok(Some(found));
                    }
                }
                LinearReadEvent::Record { opcode, data } => {
                    let record = parse(opcode, data).map_err(stop)?;
                    if let Some(found) = take(record, &mut self.topics, &mut self.ended) {
                        return Ok(Some(found));
                    }
                }
            }
        }
    }
}

impl Opened {
    /// Room for what the library wants to read next, no more than the file has: a length in it may be damaged.
    fn room_for(&mut self, need: usize) -> io::Result<usize> {
        if need <= BLOCK {
            return Ok(BLOCK);
        }
        let left = self.file.metadata()?.len().saturating_sub(self.file.stream_position()?);
        Ok(need.min(usize::try_from(left).unwrap_or(usize::MAX)).max(BLOCK))
    }
}

/// Takes what is of use in a record.
pub(super) fn take(
    record: Record<'_>,
    topics: &mut HashMap<u16, Carries>,
    ended: &mut bool,
) -> Option<Found> {
    match record {
        Record::Channel(channel) => {
            let carries = match channel.message_encoding.as_str() {
                MESSAGE_ENCODING => Carries::Frames(Topic::of(&channel.topic)),
                view::ENCODING if view::topic(&channel.topic).is_some() => Carries::View,
                _ => Carries::Foreign,
            };
            topics.insert(channel.id, carries);
            None
        }
        Record::Message { header, data } => {
            let topic = match topics.get(&header.channel_id) {
                Some(Carries::Frames(topic)) => topic.clone(),
                Some(Carries::View) => return None,
                Some(Carries::Foreign) | None => return Some(Found::Message(None)),
            };
            let (received_ns, frame) = (header.log_time, data.into_owned());
            Some(Found::Message(Some(Message { topic, received_ns, frame })))
        }
        Record::Attachment { header, data, .. } => Some(Found::Attachment(Attachment::read(header, data))),
        // These are for a file that is to be recovered.
        Record::Metadata(metadata) if metadata.name == CHANNELS => None,
        Record::Metadata(metadata) => {
            Some(Found::Metadata(Metadata { name: metadata.name, values: metadata.metadata }))
        }
        Record::DataEnd(_) => {
            *ended = true;
            None
        }
        _ => None,
    }
}

fn stop(error: McapError) -> Stop {
    match error {
        McapError::Io(source) => Stop::Io(source),
        McapError::UnexpectedEof => Stop::Damaged("ends in the middle".to_owned()),
        other => Stop::Damaged(format!(
            "is damaged from here on: {other}; `isotherm-replay recover` restores what is intact after it"
        )),
    }
}

/// Reads until the buffer is full or the file is over.
fn read_up_to(file: &mut File, buffer: &mut [u8]) -> io::Result<usize> {
    let mut length = 0;
    while length < buffer.len() {
        match file.read(&mut buffer[length..])? {
            0 => break,
            count => length += count,
        }
    }
    Ok(length)
}
