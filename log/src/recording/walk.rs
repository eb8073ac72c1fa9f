//! Going from record to record without reading what they hold.

use std::fs::File;
use std::io::{self, BufReader, Read, Seek, SeekFrom};

use mcap::records::op;

use super::record::LONGEST_RECORD;

/// Opcode (u8) and length (u64, little-endian) in front of a record.
pub(crate) const HEAD: usize = 9;

/// A file of records.
#[derive(Debug)]
pub(crate) struct RecordFile {
    file: BufReader<File>,
    /// Where the file is read on (bytes from its beginning).
    here: u64,
    length: u64,
}

/// The head of a record that the file holds to its end.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Head {
    pub(crate) opcode: u8,
    /// What it holds: where that begins, and of how many bytes it is.
    pub(crate) begin: u64,
    pub(crate) length: u64,
}

impl Head {
    /// Where the next record begins.
    pub(crate) fn end(&self) -> u64 {
        self.begin + self.length
    }
}

impl RecordFile {
    /// A file, of which so many bytes are read at once.
    ///
    /// # Errors
    /// Those of the file.
    pub(crate) fn new(file: File, block: usize) -> io::Result<Self> {
        let length = file.metadata()?.len();
        Ok(Self { file: BufReader::with_capacity(block, file), here: 0, length })
    }

    /// Of the whole file (bytes).
    pub(crate) fn length(&self) -> u64 {
        self.length
    }

    /// Bytes of the file, fewer at its end.
    ///
    /// # Errors
    /// Those of reading it.
    pub(crate) fn load(&mut self, at: u64, length: usize) -> io::Result<Vec<u8>> {
        match i64::try_from(i128::from(at) - i128::from(self.here)) {
            // Keeps what is buffered.
            Ok(distance) => self.file.seek_relative(distance)?,
            Err(_) => self.file.seek(SeekFrom::Start(at)).map(drop)?,
        }
        // No more than the file has: a length in it may be damaged.
        let room = usize::try_from(self.length.saturating_sub(at)).unwrap_or(usize::MAX);
        let mut bytes = Vec::with_capacity(length.min(room));
        (&mut self.file).take(length as u64).read_to_end(&mut bytes)?;
        self.here = at + bytes.len() as u64;
        Ok(bytes)
    }

    /// The head of the record at a place; `None` where the file ends before it does.
    ///
    /// # Errors
    /// Those of reading the file.
    pub(crate) fn head(&mut self, at: u64) -> io::Result<Option<Head>> {
        let Some((opcode, length)) = head_of(&self.load(at, HEAD)?) else { return Ok(None) };
        let head = Head { opcode, begin: at + HEAD as u64, length };
        let end = head.begin.checked_add(length);
        Ok(end.is_some_and(|end| end <= self.length).then_some(head))
    }

    /// What a record holds; `None` where it is too long for one.
    ///
    /// # Errors
    /// Those of reading the file.
    pub(crate) fn body(&mut self, head: &Head) -> io::Result<Option<Vec<u8>>> {
        let length = usize::try_from(head.length).ok().filter(|length| *length <= LONGEST_RECORD);
        length.map(|length| self.load(head.begin, length)).transpose()
    }

    /// Channels of the indexes behind a chunk, and where what follows these begins.
    ///
    /// # Errors
    /// Those of reading the file.
    pub(crate) fn indexed(&mut self, chunk: &Head) -> io::Result<(Vec<u16>, u64)> {
        let (mut channels, mut at) = (Vec::new(), chunk.end());
        while let Some(index) = self.head(at)?.filter(|head| head.opcode == op::MESSAGE_INDEX) {
            channels.extend(self.load(index.begin, 2)?.first_chunk().copied().map(u16::from_le_bytes));
            at = index.end();
        }
        Ok((channels, at))
    }
}

/// Opcode and length of a record.
pub(crate) fn head_of(bytes: &[u8]) -> Option<(u8, u64)> {
    let opcode = *bytes.first()?;
    Some((opcode, number(bytes, 1)?))
}

/// The number (u64, little-endian) at a place.
pub(crate) fn number(bytes: &[u8], at: usize) -> Option<u64> {
    Some(u64::from_le_bytes(*bytes.get(at..)?.first_chunk()?))
}
