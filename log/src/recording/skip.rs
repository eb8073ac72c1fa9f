//! Passing over the front of a recording unread: chunks whose messages were all received before a time.
//!
//! The head of a chunk says when its first and last message were received, and the indexes behind it of which channels it has
//! messages. So it takes a few reads for each chunk, and no summary: a recording that was cut short is passed over as well.

use std::collections::HashMap;
use std::fs::File;
use std::io::{self, Seek, SeekFrom};

use mcap::records::{Record, op};

use super::reader::{Carries, Found, take};
use super::record::{chunk_records, parse};
use super::walk::{Head, RecordFile, number};

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
    let at = file.stream_position()?;
    let records = RecordFile::new(&mut *file, BLOCK)?;
    let mut walk = Walk { records, before_ns, front: Front { at, ..Front::default() }, ended: false };
    while walk.step()?.is_some() {}
    let Walk { front, .. } = walk;
    file.seek(SeekFrom::Start(front.at))?;
    Ok(front)
}

struct Walk<'f> {
    records: RecordFile<&'f mut File>,
    before_ns: u64,
    front: Front,
    ended: bool,
}

impl Walk<'_> {
    /// Goes on by one record, or by a chunk with its indexes; `None` where that must be read.
    fn step(&mut self) -> io::Result<Option<()>> {
        let Some(head) = self.records.head(self.front.at)? else { return Ok(None) };
        match head.opcode {
            op::CHUNK => return self.chunk(&head),
            op::HEADER | op::SCHEMA | op::CHANNEL | op::ATTACHMENT | op::METADATA => {
                let Some(bytes) = self.records.body(&head)? else { return Ok(None) };
                let Ok(record) = parse(head.opcode, &bytes) else { return Ok(None) };
                let found = take(record, &mut self.front.topics, &mut self.ended);
                self.front.found.extend(found);
            }
            // Of a chunk that was read for its channels; on their own they say nothing.
            op::MESSAGE_INDEX => {}
            _ => return Ok(None),
        }
        self.front.at = head.end();
        Ok(Some(()))
    }

    fn chunk(&mut self, chunk: &Head) -> io::Result<Option<()>> {
        let times = self.records.load(chunk.begin, CHUNK_TIMES)?;
        let is_before = number(&times, 8).is_some_and(|last_ns| last_ns < self.before_ns);
        if chunk.length < CHUNK_TIMES as u64 || !is_before {
            return Ok(None);
        }
        let (mut behind, mut indexed, mut known) = (chunk.end(), false, true);
        while let Some(index) = self.records.head(behind)?.filter(|head| head.opcode == op::MESSAGE_INDEX) {
            let id = self.records.load(index.begin, 2)?;
            let Some(id) = id.first_chunk().filter(|_| index.length >= 2) else { return Ok(None) };
            indexed = true;
            known &= self.front.topics.contains_key(&u16::from_le_bytes(*id));
            behind = index.end();
        }
        if !(indexed && known) && self.channels(chunk)?.is_none() {
            return Ok(None);
        }
        self.front.at = behind;
        Ok(Some(()))
    }

    /// Reads a chunk for its channels alone; `None` where it is damaged.
    fn channels(&mut self, chunk: &Head) -> io::Result<Option<()>> {
        let Some(bytes) = self.records.body(chunk)? else { return Ok(None) };
        let Ok(records) = chunk_records(&bytes) else { return Ok(None) };
        for record in records.into_iter().filter(|record| matches!(record, Record::Channel(_))) {
            let _ = take(record, &mut self.front.topics, &mut self.ended);
        }
        Ok(Some(()))
    }
}
