//! Reading a recording from front to back, in constant memory.

use std::collections::{HashMap, VecDeque};
use std::io;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use mcap::McapError;
use mcap::records::{Record, op};
use serde::Serialize;

use super::record::{LONGEST_RECORD, chunk_records, parse};
use super::walk::{HEAD, Head, RecordFile, head_of, number};
use super::{Attachment, CHANNELS, MAGIC, MESSAGE_ENCODING, Metadata, view};
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
/// A chunk's head up to the time of its last message.
const CHUNK_TIMES: usize = 16;

/// Reads the messages of one or several recordings, one after the other, as they were written.
///
/// A file that ends in the middle, as after a kill, is read to its last whole chunk; the report says so.
#[derive(Debug)]
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
#[derive(Debug)]
struct Opened {
    path: PathBuf,
    records: RecordFile,
    /// Where the next record begins (bytes).
    at: u64,
    /// Chunks whose messages were all received before this are passed over (ns); 0 behind the first other one.
    before_ns: u64,
    /// From the last record or chunk.
    found: VecDeque<Found>,
    /// What each channel carries.
    topics: HashMap<u16, Carries>,
    /// The end of the messages has been seen.
    ended: bool,
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
            let before = opened.at;
            let next = opened.next();
            if opened.at > before {
                self.read.fetch_add(opened.at - before, Ordering::Relaxed);
            }
            match next {
                Ok(Some(Found::Message(Some(message)))) => {
                    self.report.messages += 1;
                    return Ok(Some(message));
                }
                Ok(Some(Found::Message(None))) => self.report.foreign_messages += 1,
                Ok(Some(Found::Attachment(attachment))) => self.attachments.push(attachment),
                Ok(Some(Found::Metadata(metadata))) => self.metadata.push(metadata),
                Ok(None) => self.advance()?,
                Err(McapError::Io(source)) => {
                    return Err(Error::file(&opened.path, "read the recording", source));
                }
                Err(error) => {
                    let words = match error {
                        McapError::UnexpectedEof => "ends in the middle".to_owned(),
                        other => format!(
                            "is damaged from here on: {other}; `isotherm-replay recover` restores what is intact after it"
                        ),
                    };
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
#[derive(Debug)]
enum Carries {
    /// Frames of a topic.
    Frames(Topic),
    /// What stands in frames too.
    View,
    /// Something else.
    Foreign,
}

/// One record that is of use.
#[derive(Debug)]
enum Found {
    /// A message; `None` for one of something else.
    Message(Option<Message>),
    Attachment(Attachment),
    Metadata(Metadata),
}

impl Opened {
    fn open(path: PathBuf, before_ns: u64, read: &AtomicU64) -> Result<Self, Error> {
        let failed = |source| Error::file(&path, "open the recording", source);
        let file = open_log(&path, "open the recording")?;
        let mut records = RecordFile::new(file, BLOCK).map_err(failed)?;
        if records.load(0, MAGIC.len()).map_err(failed)? != MAGIC {
            return Err(failed(io::Error::other("it does not begin as an MCAP file")));
        }
        let at = MAGIC.len() as u64;
        read.fetch_add(at, Ordering::Relaxed);
        let (found, topics) = (VecDeque::new(), HashMap::new());
        Ok(Self { path, records, at, before_ns, found, topics, ended: false })
    }

    /// The next record that is of use; `None` at the end.
    fn next(&mut self) -> Result<Option<Found>, McapError> {
        loop {
            if let Some(found) = self.found.pop_front() {
                return Ok(Some(found));
            }
            let head = self.records.load(self.at, HEAD)?;
            let (opcode, length) = head_of(&head).ok_or(McapError::UnexpectedEof)?;
            let short = usize::try_from(length).ok().filter(|length| *length <= LONGEST_RECORD);
            let short = short.ok_or(McapError::RecordTooLarge { opcode, len: length })?;
            let head = Head { opcode, begin: self.at + HEAD as u64, length };
            if opcode == op::CHUNK && self.before_ns > 0 && self.passes_over(&head)? {
                continue;
            }
            let data = self.records.load(head.begin, short)?;
            if data.len() < short {
                return Err(McapError::UnexpectedEof);
            }
            if opcode == op::CHUNK {
                // All of its records or none.
                for record in chunk_records(&data)? {
                    self.found.extend(take(record, &mut self.topics, &mut self.ended));
                }
            } else {
                let record = parse(opcode, &data)?;
                self.found.extend(take(record, &mut self.topics, &mut self.ended));
            }
            self.at = head.end();
            match opcode {
                op::FOOTER => return self.end(),
                op::CHUNK | op::MESSAGE | op::DATA_END => self.before_ns = 0,
                _ => {}
            }
        }
    }

    /// The end of the file, behind its footer.
    fn end(&mut self) -> Result<Option<Found>, McapError> {
        let magic = self.records.load(self.at, MAGIC.len())?;
        self.at += magic.len() as u64;
        match magic == MAGIC {
            true if self.ended => Ok(None),
            false if magic.len() == MAGIC.len() => Err(McapError::BadMagic),
            _ => Err(McapError::UnexpectedEof),
        }
    }

    /// Passes over a chunk of which every message was received before the time from which on they are wanted.
    ///
    /// Its head says when its last message was received, and the indexes behind it of which channels it has messages. So it
    /// takes a few reads, and no summary: a recording that was cut short is passed over as well.
    fn passes_over(&mut self, chunk: &Head) -> io::Result<bool> {
        let times = self.records.load(chunk.begin, CHUNK_TIMES)?;
        let is_before = number(&times, 8).is_some_and(|last_ns| last_ns < self.before_ns);
        if chunk.length < CHUNK_TIMES as u64 || !is_before || chunk.end() > self.records.length() {
            return Ok(false);
        }
        let (indexed, behind) = self.records.indexed(chunk)?;
        let known = !indexed.is_empty() && indexed.iter().all(|id| self.topics.contains_key(id));
        if !known {
            // It is read for its channels alone; what is damaged, for whatever there is.
            let Some(bytes) = self.records.body(chunk)? else { return Ok(false) };
            let Ok(records) = chunk_records(&bytes) else { return Ok(false) };
            for record in records.into_iter().filter(|record| matches!(record, Record::Channel(_))) {
                let _ = take(record, &mut self.topics, &mut self.ended);
            }
        }
        self.at = behind;
        Ok(true)
    }
}

/// Takes what is of use in a record.
fn take(record: Record<'_>, topics: &mut HashMap<u16, Carries>, ended: &mut bool) -> Option<Found> {
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
