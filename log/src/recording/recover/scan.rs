//! Whole records of a file, found again behind what is damaged.

use std::io;
use std::path::Path;

use mcap::McapError;
use mcap::records::{Record, op};
use serde::Serialize;

use crate::error::Error;
use crate::file::open_log;
use crate::recording::record::{LONGEST_RECORD, chunk_records, metadata_length, parse};
use crate::recording::walk::{HEAD, RecordFile, head_of, number};
use crate::recording::{MAGIC, METADATA};

/// The shortest head of a chunk's own: times, lengths, CRC, no compression.
const CHUNK_HEAD: usize = 40;
/// Bytes that are looked through at once for a record.
const WINDOW: usize = 1 << 20;

/// A place that was passed over.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Damage {
    /// Where it begins (bytes from the file's beginning).
    pub offset: u64,
    /// How long it is (bytes).
    pub length: u64,
    /// What is wrong.
    pub words: String,
}

/// What stands in the file next.
#[derive(Debug)]
pub(super) enum Piece {
    /// A record beside the chunks.
    Record(Record<'static>),
    /// A chunk's records.
    Chunk(Vec<Record<'static>>),
    /// Something that is none of these.
    Damage(Damage),
}

/// The profile that a file's first piece names.
pub(super) fn profile(piece: Option<&Piece>) -> Option<&str> {
    match piece {
        Some(Piece::Record(Record::Header(header))) => Some(&header.profile),
        _ => None,
    }
}

/// Goes through a file.
#[derive(Debug)]
pub(super) struct Scanner {
    records: RecordFile,
    /// Where the next piece begins.
    offset: u64,
    /// Behind the footer only the magic follows.
    footer: bool,
}

impl Scanner {
    /// At the beginning of a file.
    ///
    /// # Errors
    /// [`Error::File`].
    pub(super) fn open(path: &Path) -> Result<Self, Error> {
        let failed = |source| Error::file(path, "open the recording", source);
        let file = open_log(path, "open the recording")?;
        let mut records = RecordFile::new(file, WINDOW).map_err(failed)?;
        let magic = records.load(0, MAGIC.len()).map_err(failed)?;
        let offset = if magic == MAGIC { MAGIC.len() as u64 } else { 0 };
        Ok(Self { records, offset, footer: false })
    }

    /// Whether it begins as a recording does. Called before the first piece is taken.
    pub(super) fn begins_well(&self) -> bool {
        self.offset > 0
    }

    /// Length of the file (bytes).
    pub(super) fn length(&self) -> u64 {
        self.records.length()
    }

    /// Where the next piece begins (bytes).
    pub(super) fn offset(&self) -> u64 {
        self.offset
    }

    /// The next piece; `None` behind the last.
    ///
    /// # Errors
    /// Where the file cannot be read.
    pub(super) fn next_piece(&mut self) -> io::Result<Option<Piece>> {
        let begin = self.offset;
        if self.footer && self.records.load(begin, MAGIC.len())? == MAGIC {
            self.offset = self.length();
        }
        if self.offset >= self.length() {
            return Ok(None);
        }
        match self.piece_at(begin)? {
            Ok((piece, length)) => {
                self.offset += length;
                self.footer = matches!(piece, Piece::Record(Record::Footer(_)));
                Ok(Some(piece))
            }
            Err(words) => {
                self.offset = self.next_whole(begin + 1)?;
                self.footer = false;
                Ok(Some(Piece::Damage(Damage { offset: begin, length: self.offset - begin, words })))
            }
        }
    }

    /// The whole piece at a place and its length, or why there is none.
    fn piece_at(&mut self, at: u64) -> io::Result<Result<(Piece, u64), String>> {
        let head = self.records.load(at, HEAD)?;
        let Some((opcode, length)) = head_of(&head) else {
            return Ok(Err("ends in the middle of a record".to_owned()));
        };
        if !is_opcode(opcode) {
            return Ok(Err(format!("no record begins with {opcode:#04x}")));
        }
        let rest = self.length() - at - HEAD as u64;
        if length > rest {
            let what = name(opcode);
            return Ok(Err(format!("{what} of {length} bytes has only {rest} before the file ends")));
        }
        let Some(short) = usize::try_from(length).ok().filter(|length| *length <= LONGEST_RECORD) else {
            return Ok(Err(format!("{} of {length} bytes is longer than {LONGEST_RECORD}", name(opcode))));
        };
        let data = self.records.load(at + HEAD as u64, short)?;
        Ok(whole(opcode, &data).map(|piece| (piece, length + HEAD as u64)))
    }

    /// Where the next record begins that is sure to be one; the file's end where there is none.
    fn next_whole(&mut self, from: u64) -> io::Result<u64> {
        let mut begin = from;
        while begin < self.length() {
            let window = self.records.load(begin, WINDOW + HEAD + CHUNK_HEAD)?;
            let last = window.len().min(WINDOW);
            for index in 0..last {
                let at = begin + index as u64;
                let plausible = window.get(index..).is_some_and(|here| self.may_be(here, at));
                if plausible && self.piece_at(at)?.is_ok() {
                    return Ok(at);
                }
            }
            begin += last as u64;
        }
        Ok(self.length())
    }

    /// Whether a record of a kind that can be told from chance may begin here.
    fn may_be(&self, here: &[u8], at: u64) -> bool {
        let Some((opcode, length)) = head_of(here) else { return false };
        let rest = self.length() - at - HEAD as u64;
        let fits = length <= rest && length <= LONGEST_RECORD as u64;
        let body = here.get(HEAD..).unwrap_or_default();
        match opcode {
            // The compression's name, and lengths that go together.
            op::CHUNK if fits && length >= CHUNK_HEAD as u64 => {
                let name = body.get(28..).unwrap_or_default();
                let compressions: [(&[u8], usize); 3] =
                    [(b"\x04\0\0\0zstd", 4), (b"\x03\0\0\0lz4", 3), (b"\0\0\0\0", 0)];
                let found = compressions.iter().find(|(start, _)| name.starts_with(start));
                found.is_some_and(|(_, letters)| {
                    let compressed = number(body, 32 + letters).unwrap_or(u64::MAX);
                    compressed.checked_add((CHUNK_HEAD + letters) as u64) == Some(length)
                })
            }
            // Its CRC says whether it is one.
            op::ATTACHMENT => fits && length > 40,
            op::METADATA => fits && body.get(4..).is_some_and(|name| name.starts_with(METADATA.as_bytes())),
            // What follows is the summary, or the footer.
            op::DATA_END => length == 4 && body.get(4).copied().is_some_and(is_behind_data),
            _ => false,
        }
    }
}

/// The piece that these bytes are, with everything checked that can be.
fn whole(opcode: u8, data: &[u8]) -> Result<Piece, String> {
    let damaged = |error: McapError| format!("{} is damaged: {error}", name(opcode));
    if opcode == op::METADATA && metadata_length(data) != Some(data.len()) {
        return Err("a metadata record is damaged: its lengths contradict each other".to_owned());
    }
    if opcode == op::CHUNK {
        return chunk_records(data).map(Piece::Chunk).map_err(damaged);
    }
    Ok(Piece::Record(parse(opcode, data).map_err(damaged)?.into_owned()))
}

/// Whether the format knows it, or leaves it to others.
fn is_opcode(opcode: u8) -> bool {
    (op::HEADER..=op::DATA_END).contains(&opcode) || opcode >= 0x80
}

/// Whether it stands behind the end of the data.
fn is_behind_data(opcode: u8) -> bool {
    let summary = [
        op::SCHEMA,
        op::CHANNEL,
        op::CHUNK_INDEX,
        op::ATTACHMENT_INDEX,
        op::STATISTICS,
        op::METADATA_INDEX,
        op::SUMMARY_OFFSET,
        op::FOOTER,
    ];
    summary.contains(&opcode)
}

/// What a record is, for people.
fn name(opcode: u8) -> &'static str {
    match opcode {
        op::CHUNK => "a chunk",
        op::MESSAGE_INDEX => "an index of messages",
        op::ATTACHMENT => "an attachment",
        op::METADATA => "a metadata record",
        op::HEADER | op::DATA_END | op::FOOTER => "the file's frame",
        _ => "a record",
    }
}
