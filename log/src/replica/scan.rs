//! Going through recordings for their journals alone.
//!
//! An entry may have been received before or behind the frames that it follows. Who corrects must know that one is coming
//! before the frame is given to the unit; hence this look ahead. Chunks that hold no journal are passed over unread, by
//! the indexes that stand behind each chunk, so that it costs little even for a long recording and works for one that was
//! cut short.

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::fs::File;
use std::io::{BufReader, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use isotherm_protocol::codec;
use isotherm_protocol::journal::{Joiner, JournalEntry, JournalPart};
use isotherm_protocol::key::UnitId;
use mcap::records::{Channel, Record, op};

use super::{Mark, Outline, Outlines, UnitOutline};
use crate::error::{Error, few};
use crate::message::Topic;
use crate::recording::{MAGIC, MESSAGE_ENCODING, chunk_records};

/// Longest record that is read whole (bytes): chunks beyond this are not of a recorder.
const LONGEST_RECORD: u64 = 1 << 28;
/// Opcode and length in front of a record.
const RECORD_HEADER: usize = 9;

/// Looks through recordings, in this order, for journals and for the units there are.
///
/// # Errors
/// [`Error::File`] where one cannot be opened or read. What is damaged ends the look at its file, as it ends its reading.
pub fn scan(paths: &[PathBuf]) -> Result<Outlines, Error> {
    Ok(look(paths, true)?.finish())
}

/// Refuses units that none of these recordings has, before they are read for what they do not hold.
///
/// # Errors
/// [`Error::NoSuchUnit`], and as [`scan`].
pub fn check_units(paths: &[PathBuf], units: &BTreeSet<UnitId>) -> Result<(), Error> {
    if units.is_empty() {
        return Ok(());
    }
    let there = look(paths, false)?.units;
    let Some(unit) = units.iter().find(|unit| !there.contains_key(*unit)) else { return Ok(()) };
    let names: Vec<_> = paths.iter().map(|path| path.display().to_string()).collect();
    Err(Error::NoSuchUnit {
        recording: names.join(", "),
        unit: unit.clone(),
        there: few(&there.keys().map(UnitId::as_str).collect::<Vec<_>>()),
    })
}

/// Goes through recordings; without `journals`, for the units alone.
fn look(paths: &[PathBuf], journals: bool) -> Result<Found, Error> {
    let mut found = Found::default();
    for path in paths {
        let failed = |source| Error::file(path, "read the recording", source);
        let mut recording = Recording::open(path, journals).map_err(failed)?;
        while recording.record(&mut found).map_err(failed)? {}
    }
    Ok(found)
}

/// What has been come across.
#[derive(Debug, Default)]
struct Found {
    units: BTreeMap<UnitId, UnitOutline>,
    marks: BTreeMap<UnitId, Vec<Mark>>,
    joiner: Joiner,
    damaged: Vec<String>,
}

impl Found {
    fn topic(&mut self, topic: &Topic) {
        let Some(unit) = topic.unit() else { return };
        let outline = self.units.entry(unit.clone()).or_default();
        outline.has_raw |= matches!(topic, Topic::Raw(..) | Topic::Reference(_));
        outline.has_corrected |= matches!(topic, Topic::Corrected(_));
    }

    fn journal(&mut self, unit: &UnitId, received_ns: u64, frame: &[u8]) {
        match join(&mut self.joiner, frame) {
            Ok(Some(entry)) => {
                self.marks.entry(unit.clone()).or_default().push(Mark::of(&entry, received_ns));
            }
            Ok(None) => {}
            Err(words) => self.damaged.push(format!("unit {unit}: {words}")),
        }
    }

    fn finish(self) -> Outlines {
        let Self { mut units, marks, damaged, .. } = self;
        for (unit, marks) in marks {
            units.entry(unit).or_default().journal = Outline::new(marks);
        }
        Outlines { units, damaged }
    }
}

/// Takes a frame of a journal; the entry where it is the last of its parts.
pub(crate) fn join(joiner: &mut Joiner, frame: &[u8]) -> Result<Option<JournalEntry>, String> {
    let part: JournalPart = codec::decode(frame).map_err(|error| format!("journal: {error}"))?;
    joiner.join(part).map_err(|error| error.to_string())
}

/// A recording, gone through record by record.
struct Recording {
    file: BufReader<File>,
    /// Topic of each channel so far; `None` for channels of something else.
    topics: HashMap<u16, Option<Topic>>,
    /// Whether journals are read.
    journals: bool,
    /// The last chunk, unread until it is known to hold a journal.
    chunk: Option<Chunk>,
}

/// A chunk whose indexes are being gone through.
struct Chunk {
    start: u64,
    length: u64,
    /// Whether it must be read: it has a journal, or a channel that is not known yet.
    wanted: bool,
    /// Whether anything was said of what it holds.
    indexed: bool,
}

impl Recording {
    fn open(path: &Path, journals: bool) -> std::io::Result<Self> {
        let mut file = BufReader::new(File::open(path)?);
        file.seek(SeekFrom::Start(MAGIC.len() as u64))?;
        Ok(Self { file, topics: HashMap::new(), journals, chunk: None })
    }

    /// Goes on by one record; `false` at the end of what can be read.
    fn record(&mut self, found: &mut Found) -> std::io::Result<bool> {
        let mut header = [0; RECORD_HEADER];
        if !fill(&mut self.file, &mut header)? {
            // Some of its indexes may be cut off.
            self.chunk.iter_mut().for_each(|chunk| chunk.wanted = true);
            self.leave_chunk(found)?;
            return Ok(false);
        }
        let [opcode, length @ ..] = header;
        let length = u64::from_le_bytes(length);
        if opcode != op::MESSAGE_INDEX {
            self.leave_chunk(found)?;
        }
        match opcode {
            op::CHUNK => {
                let start = self.file.stream_position()?;
                self.chunk = Some(Chunk { start, length, wanted: false, indexed: false });
                self.skip(length)
            }
            op::MESSAGE_INDEX => {
                let Some(bytes) = self.read(length)? else { return Ok(false) };
                if let Some(chunk) = &mut self.chunk
                    && let Some(id) = bytes.first_chunk()
                {
                    chunk.indexed = true;
                    chunk.wanted |= match self.topics.get(&u16::from_le_bytes(*id)) {
                        Some(topic) => self.journals && matches!(topic, Some(Topic::Journal(_))),
                        None => true,
                    };
                }
                Ok(true)
            }
            op::CHANNEL | op::MESSAGE => {
                let Some(bytes) = self.read(length)? else { return Ok(false) };
                Ok(mcap::parse_record(opcode, &bytes).is_ok_and(|record| {
                    self.take(&record, found);
                    true
                }))
            }
            op::DATA_END | op::FOOTER => Ok(false),
            _ => self.skip(length),
        }
    }

    /// Reads the chunk whose indexes are over, where it is wanted, and comes back to where it was.
    fn leave_chunk(&mut self, found: &mut Found) -> std::io::Result<()> {
        let Some(chunk) = self.chunk.take().filter(|chunk| chunk.wanted || !chunk.indexed) else {
            return Ok(());
        };
        let back = self.file.stream_position()?;
        self.file.seek(SeekFrom::Start(chunk.start))?;
        let bytes = self.read(chunk.length)?;
        self.file.seek(SeekFrom::Start(back))?;
        // What is damaged will be told by who reads it for its messages.
        let records = bytes.and_then(|bytes| chunk_records(&bytes).ok());
        records.iter().flatten().for_each(|record| self.take(record, found));
        Ok(())
    }

    fn take(&mut self, record: &Record<'_>, found: &mut Found) {
        match record {
            Record::Channel(Channel { id, topic, message_encoding, .. }) => {
                let topic = (message_encoding == MESSAGE_ENCODING).then(|| Topic::of(topic));
                if let Some(topic) = &topic {
                    found.topic(topic);
                }
                self.topics.insert(*id, topic);
            }
            Record::Message { header, data } => {
                if let Some(Some(Topic::Journal(unit))) = self.topics.get(&header.channel_id)
                    && self.journals
                {
                    found.journal(unit, header.log_time, data);
                }
            }
            _ => {}
        }
    }

    /// Passes over what a record holds; `false` where the file ends in it.
    fn skip(&mut self, length: u64) -> std::io::Result<bool> {
        let Ok(offset) = i64::try_from(length) else { return Ok(false) };
        self.file.seek_relative(offset)?;
        Ok(true)
    }

    /// What a record holds; `None` where the file ends in it.
    fn read(&mut self, length: u64) -> std::io::Result<Option<Vec<u8>>> {
        if length > LONGEST_RECORD {
            return Ok(None);
        }
        let mut bytes = Vec::new();
        let read = self.file.by_ref().take(length).read_to_end(&mut bytes)?;
        Ok((read as u64 == length).then_some(bytes))
    }
}

/// Fills a buffer; `false` where the file ends before.
fn fill(file: &mut impl Read, buffer: &mut [u8]) -> std::io::Result<bool> {
    match file.read_exact(buffer) {
        Err(error) if error.kind() == std::io::ErrorKind::UnexpectedEof => Ok(false),
        other => other.map(|()| true),
    }
}
