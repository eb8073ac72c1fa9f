//! Passing over the front of a recording unread: chunks whose messages were all received before a time.
//!
//! The head of a chunk says when its first and last message were received, and the indexes behind it of which channels it has
//! messages. So it takes a few reads for each chunk, and no summary: a recording that was cut short is passed over as well.

use std::collections::HashMap;
use std::fs::File;
use std::io::{self, BufReader, ErrorKind, Read, Seek, SeekFrom};

use mcap::records::{Record, op};

use super::reader::{Carries, Found, take};
use super::record::{LONGEST_RECORD, chunk_records, parse};

/// Opcode and length in front of a record.
const RECORD_HEADER: usize = 9;
/// A chunk's head up to the time of its last message.
const CHUNK_TIMES: usize = 16;
/// What is read at once (bytes): heads and indexes.
const BLOCK: usize = 1 << 12;

/// The front of a recording.
#[derive(Default)]
pub(super) struct Front {
    /// What stands beside the chunks.
    pub(super) found: Vec<Found>,
    /// What each channel carries.
    pub(super) topics: HashMap<u16, Carries>,
    /// Where reading goes on (bytes from the beginning of the file).
    pub(super) at: u64,
}

/// Passes over chunks of which every message was received before `before_ns`, up to the first other chunk, and leaves the
/// file there.
///
/// What cannot be understood ends it: who reads on from there says what is wrong with it.
///
/// # Errors
/// Those of reading the file.
pub(super) fn pass_over(file: &mut File, before_ns: u64) -> io::Result<Front> {
    let (at, length) = (file.stream_position()?, file.metadata()?.len());
    let mut walk = Walk {
        file: BufReader::with_capacity(BLOCK, &mut *file),
        length,
        before_ns,
        front: Front { at, ..Front::default() },
        ended: false,
    };
    while walk.step()?.is_some() {}
    let Walk { front, .. } = walk;
    file.seek(SeekFrom::Start(front.at))?;
    Ok(front)
}

struct Walk<'f> {
    file: BufReader<&'f mut File>,
    /// Of the whole file (bytes).
    length: u64,
    before_ns: u64,
    front: Front,
    ended: bool,
}

impl Walk<'_> {
    /// Goes on by one record, or by a chunk with its indexes; `None` where that must be read.
    fn step(&mut self) -> io::Result<Option<()>> {
        let Some((opcode, length)) = self.head(self.front.at)? else { return Ok(None) };
        match opcode {
            op::CHUNK => self.chunk(length),
            op::HEADER | op::SCHEMA | op::CHANNEL | op::ATTACHMENT | op::METADATA => {
                let Some(bytes) = self.body(length)? else { return Ok(None) };
                let Ok(record) = parse(opcode, &bytes) else { return Ok(None) };
                let found = take(record, &mut self.front.topics, &mut self.ended);
                self.front.found.extend(found);
                self.front.at += RECORD_HEADER as u64 + length;
                Ok(Some(()))
            }
            // Of a chunk that was read for its channels; on their own they say nothing.
            op::MESSAGE_INDEX => {
                self.front.at += RECORD_HEADER as u64 + length;
                Ok(Some(()))
            }
            _ => Ok(None),
        }
    }

    fn chunk(&mut self, length: u64) -> io::Result<Option<()>> {
        let mut times = [0; CHUNK_TIMES];
        if length < CHUNK_TIMES as u64 || !self.fill(&mut times)? {
            return Ok(None);
        }
        let last_ns = times.last_chunk().map_or(u64::MAX, |bytes| u64::from_le_bytes(*bytes));
        if last_ns >= self.before_ns {
            return Ok(None);
        }
        let (mut behind, mut indexed, mut known) =
            (self.front.at + RECORD_HEADER as u64 + length, false, true);
        while let Some((op::MESSAGE_INDEX, length)) = self.head(behind)? {
            let mut id = [0; 2];
            if length < 2 || !self.fill(&mut id)? {
                return Ok(None);
            }
            indexed = true;
            known &= self.front.topics.contains_key(&u16::from_le_bytes(id));
            behind += RECORD_HEADER as u64 + length;
        }
        if !(indexed && known) && self.channels(length)?.is_none() {
            return Ok(None);
        }
        self.front.at = behind;
        Ok(Some(()))
    }

    /// Reads a chunk for its channels alone; `None` where it is damaged.
    fn channels(&mut self, length: u64) -> io::Result<Option<()>> {
        self.go_to(self.front.at + RECORD_HEADER as u64)?;
        let Some(bytes) = self.body(length)? else { return Ok(None) };
        let Ok(records) = chunk_records(&bytes) else { return Ok(None) };
        for record in records.into_iter().filter(|record| matches!(record, Record::Channel(_))) {
            let _ = take(record, &mut self.front.topics, &mut self.ended);
        }
        Ok(Some(()))
    }

    /// Opcode and length of the record at a place; `None` where the file ends before it does.
    fn head(&mut self, at: u64) -> io::Result<Option<(u8, u64)>> {
        self.go_to(at)?;
        let mut head = [0; RECORD_HEADER];
        if !self.fill(&mut head)? {
            return Ok(None);
        }
        let [opcode, length @ ..] = head;
        let length = u64::from_le_bytes(length);
        let end = at.checked_add(RECORD_HEADER as u64).and_then(|start| start.checked_add(length));
        Ok(end.is_some_and(|end| end <= self.length).then_some((opcode, length)))
    }

    /// The bytes of a record that is to be read; `None` where it is too long for one.
    fn body(&mut self, length: u64) -> io::Result<Option<Vec<u8>>> {
        let Some(length) = usize::try_from(length).ok().filter(|length| *length <= LONGEST_RECORD) else {
            return Ok(None);
        };
        let mut bytes = vec![0; length];
        Ok(self.fill(&mut bytes)?.then_some(bytes))
    }

    /// Goes to a place; within what is in memory without a call.
    fn go_to(&mut self, at: u64) -> io::Result<()> {
        let here = self.file.stream_position()?;
        match i64::try_from(i128::from(at) - i128::from(here)) {
            Ok(distance) => self.file.seek_relative(distance),
            Err(_) => self.file.seek(SeekFrom::Start(at)).map(drop),
        }
    }

    /// Whether there was enough to fill it.
    fn fill(&mut self, bytes: &mut [u8]) -> io::Result<bool> {
        match self.file.read_exact(bytes) {
            Ok(()) => Ok(true),
            Err(error) if error.kind() == ErrorKind::UnexpectedEof => Ok(false),
            Err(error) => Err(error),
        }
    }
}
