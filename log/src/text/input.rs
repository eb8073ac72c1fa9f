//! Bytes of a log: decompressed, counted, cut into lines.

use std::io::{self, BufRead, BufReader, Read};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use encoding_rs_io::DecodeReaderBytesBuilder;
use flate2::bufread::MultiGzDecoder;

use crate::error::Error;
use crate::file::open_log;
use crate::mapping::Encoding;

/// Longest line (bytes).
pub(super) const LONGEST_LINE: usize = 1 << 20;
/// Bytes read at a time.
const BLOCK: usize = 1 << 16;
/// What gzip begins with.
const GZIP_MAGIC: [u8; 2] = [0x1f, 0x8b];
/// Byte-order mark of UTF-8.
const UTF8_MARK: &[u8] = b"\xef\xbb\xbf";

/// Bytes of a log, decompressed.
pub(crate) type Source = Box<dyn Read + Send>;

/// Counts the bytes that pass.
#[derive(Debug)]
struct Counted<R> {
    /// Where they come from.
    inner: R,
    /// Where they are counted.
    count: Arc<AtomicU64>,
}

impl<R: Read> Read for Counted<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let length = self.inner.read(buffer)?;
        self.count.fetch_add(length as u64, Ordering::Relaxed);
        Ok(length)
    }
}

/// Opens a file, decompressing it where it begins like gzip, and tells its size.
pub(crate) fn open(path: &Path, count: &Arc<AtomicU64>) -> Result<(Source, u64), Error> {
    let failed = |source| Error::file(path, "open the log", source);
    let file = open_log(path, "open the log")?;
    let size = file.metadata().map_err(failed)?.len();
    let mut bytes = BufReader::with_capacity(BLOCK, Counted { inner: file, count: Arc::clone(count) });
    let start = bytes.fill_buf().map_err(failed)?;
    let source: Source =
        if start.starts_with(&GZIP_MAGIC) { Box::new(MultiGzDecoder::new(bytes)) } else { Box::new(bytes) };
    Ok((source, size))
}

/// The text of a source as UTF-8.
pub(super) fn decoded(source: Source, encoding: Encoding) -> Source {
    let from = match encoding {
        Encoding::Utf8 => return source,
        Encoding::Utf16Le => encoding_rs::UTF_16LE,
        Encoding::Utf16Be => encoding_rs::UTF_16BE,
        Encoding::Latin1 => encoding_rs::WINDOWS_1252,
    };
    Box::new(DecodeReaderBytesBuilder::new().encoding(Some(from)).bom_override(true).build(source))
}

/// What came of asking for a line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Line {
    /// It is there.
    Read,
    /// It is longer than [`LONGEST_LINE`]; the rest of it was passed over.
    TooLong,
    /// There is none.
    End,
}

/// Lines of a log.
pub(crate) struct Lines {
    /// Where they come from.
    reader: BufReader<Source>,
    /// The current one, without its end.
    line: Vec<u8>,
    /// Its number, from 1.
    number: u64,
    /// It ended with a line end.
    terminated: bool,
}

impl std::fmt::Debug for Lines {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Lines").field("number", &self.number).finish_non_exhaustive()
    }
}

impl Lines {
    /// Lines of a source.
    pub(super) fn new(source: Source) -> Self {
        Self {
            reader: BufReader::with_capacity(BLOCK, source),
            line: Vec::new(),
            number: 0,
            terminated: true,
        }
    }

    /// Goes to the next line.
    pub(super) fn advance(&mut self) -> io::Result<Line> {
        self.line.clear();
        let limit = LONGEST_LINE as u64 + 1;
        let length = Read::take(&mut self.reader, limit).read_until(b'\n', &mut self.line)?;
        if length == 0 {
            return Ok(Line::End);
        }
        self.number += 1;
        self.terminated = self.line.pop_if(|byte| *byte == b'\n').is_some();
        if !self.terminated && length > LONGEST_LINE {
            self.line.truncate(80);
            self.terminated = self.reader.skip_until(b'\n')? > 0;
            return Ok(Line::TooLong);
        }
        self.line.pop_if(|byte| *byte == b'\r');
        if self.number == 1 && self.line.starts_with(UTF8_MARK) {
            self.line.drain(..UTF8_MARK.len());
        }
        Ok(Line::Read)
    }

    /// The next line as text; characters that are none are replaced. A line that is too long is an empty one, and where a compressed file
    /// is cut short it ends.
    pub(crate) fn next_line(&mut self) -> io::Result<Option<String>> {
        match self.advance() {
            Ok(Line::End) => Ok(None),
            Ok(Line::TooLong) => Ok(Some(String::new())),
            Ok(Line::Read) => Ok(Some(String::from_utf8_lossy(&self.line).into_owned())),
            Err(error) if error.kind() == io::ErrorKind::UnexpectedEof => Ok(None),
            Err(error) => Err(error),
        }
    }

    /// The current line, without its end.
    pub(super) fn line(&self) -> &[u8] {
        &self.line
    }

    /// The current line, for cells to be unquoted in place.
    pub(super) fn line_mut(&mut self) -> &mut [u8] {
        &mut self.line
    }

    /// Its number, from 1.
    pub(crate) fn number(&self) -> u64 {
        self.number
    }

    /// Whether it ended with a line end.
    pub(super) fn terminated(&self) -> bool {
        self.terminated
    }

    /// Whether it is the first line of UTF-16 text.
    pub(super) fn is_utf16(&self) -> bool {
        self.number == 1 && (self.line.starts_with(b"\xff\xfe") || self.line.starts_with(b"\xfe\xff"))
    }
}
