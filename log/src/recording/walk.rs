//! Going from record to record without reading what they hold.

use std::io::{self, BufReader, Read, Seek, SeekFrom};

use super::record::LONGEST_RECORD;

/// Opcode (u8) and length (u64, little-endian) in front of a record.
pub(crate) const HEAD: usize = 9;

/// A file of records.
#[derive(Debug)]
pub(crate) struct RecordFile<F> {
    file: BufReader<F>,
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

impl<F: Read + Seek> RecordFile<F> {
    /// A file, of which so many bytes are read at once.
    ///
    /// # Errors
    /// Those of the file.
    pub(crate) fn new(mut file: F, block: usize) -> io::Result<Self> {
        let here = file.stream_position()?;
        let length = file.seek(SeekFrom::End(0))?;
        file.seek(SeekFrom::Start(here))?;
        Ok(Self { file: BufReader::with_capacity(block, file), length })
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
        let here = self.file.stream_position()?;
        match i64::try_from(i128::from(at) - i128::from(here)) {
            // Keeps what is buffered.
            Ok(distance) => self.file.seek_relative(distance)?,
            Err(_) => self.file.seek(SeekFrom::Start(at)).map(drop)?,
        }
        let mut bytes = Vec::new();
        (&mut self.file).take(length as u64).read_to_end(&mut bytes)?;
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
