//! Going through recordings for their journals alone.
//!
//! An entry may have been received before or behind the frames that it follows. Who corrects must know that one is coming
//! before the frame is given to the unit; hence this look ahead. Chunks that hold no journal are passed over unread, by
//! the indexes that stand behind each chunk, so that it costs little even for a long recording and works for one that was
//! cut short.

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};

use isotherm_document::few;
use isotherm_protocol::codec;
use isotherm_protocol::journal::{Joiner, JournalEntry, JournalPart};
use isotherm_protocol::key::UnitId;
use mcap::records::{Channel, Record, op};

use super::{Mark, Outline, Outlines, UnitOutline};
use crate::error::Error;
use crate::message::Topic;
use crate::recording::walk::{Head, RecordFile};
use crate::recording::{MAGIC, MESSAGE_ENCODING, chunk_records};

/// What is read of a recording at once (bytes): heads and indexes.
const BLOCK: usize = 1 << 13;

/// Looks through recordings, in this order, for journals and for the units there are; entries that were received after `end_ns`, where
/// that is given, are passed over.
///
/// # Errors
/// [`Error::File`] where one cannot be opened or read. What is damaged ends the look at its file, as it ends its reading.
pub fn scan(paths: &[PathBuf], end_ns: Option<u64>) -> Result<Outlines, Error> {
    Ok(look(paths, Some(end_ns.unwrap_or(u64::MAX)))?.finish())
}

/// Refuses units that none of these recordings has, before they are read for what they do not hold.
///
/// # Errors
/// [`Error::NoSuchUnit`], and as [`scan`].
pub fn check_units(paths: &[PathBuf], units: &BTreeSet<UnitId>) -> Result<(), Error> {
    if units.is_empty() {
        return Ok(());
    }
    let there = look(paths, None)?.units;
    let Some(unit) = units.iter().find(|unit| !there.contains_key(*unit)) else { return Ok(()) };
    let names: Vec<_> = paths.iter().map(|path| path.display().to_string()).collect();
    Err(Error::NoSuchUnit {
        recording: names.join(", "),
        unit: unit.clone(),
        there: few(there.keys().map(UnitId::as_str)),
    })
}

/// Goes through recordings, for the journals up to a time of reception; without one, for the units alone.
fn look(paths: &[PathBuf], journals: Option<u64>) -> Result<Found, Error> {
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
    records: RecordFile,
    /// Where the next record begins.
    at: u64,
    /// Topic of each channel so far; `None` for channels of something else.
    topics: HashMap<u16, Option<Topic>>,
    /// Up to which time of reception journals are read, if at all (ns).
    journals: Option<u64>,
}

impl Recording {
    fn open(path: &Path, journals: Option<u64>) -> io::Result<Self> {
        let records = RecordFile::new(File::open(path)?, BLOCK)?;
        Ok(Self { records, at: MAGIC.len() as u64, topics: HashMap::new(), journals })
    }

    /// Goes on by one record; `false` at the end of what can be read.
    fn record(&mut self, found: &mut Found) -> io::Result<bool> {
        let Some(head) = self.records.head(self.at)? else { return Ok(false) };
        self.at = head.end();
        match head.opcode {
            op::CHUNK => self.chunk(&head, found)?,
            op::CHANNEL | op::MESSAGE => {
                let Some(bytes) = self.records.body(&head)? else { return Ok(false) };
                let Ok(record) = mcap::parse_record(head.opcode, &bytes) else { return Ok(false) };
                self.take(&record, found);
            }
            op::DATA_END | op::FOOTER => return Ok(false),
            _ => {}
        }
        Ok(true)
    }

    /// Reads a chunk where it must be: it has a journal or a channel that is not known yet, or nothing says what it has.
    fn chunk(&mut self, chunk: &Head, found: &mut Found) -> io::Result<()> {
        let (channels, behind) = self.records.indexed(chunk)?;
        self.at = behind;
        let wanted = channels.iter().any(|id| match self.topics.get(id) {
            Some(topic) => self.journals.is_some() && matches!(topic, Some(Topic::Journal(_))),
            None => true,
        });
        // At the file's end some of its indexes may be cut off.
        if wanted || channels.is_empty() || self.records.head(behind)?.is_none() {
            let bytes = self.records.body(chunk)?;
            // What is damaged will be told by who reads it for its messages.
            let records = bytes.and_then(|bytes| chunk_records(&bytes).ok());
            records.iter().flatten().for_each(|record| self.take(record, found));
        }
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
                    && self.journals.is_some_and(|end_ns| header.log_time <= end_ns)
                {
                    found.journal(unit, header.log_time, data);
                }
            }
            _ => {}
        }
    }
}
