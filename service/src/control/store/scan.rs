//! An audit file read line by line, whatever is in it.

use std::fs::File;
use std::io::{self, BufRead, BufReader, Read};
use std::path::Path;

use isotherm_protocol::history::MAX_LINE_BYTES;

use isotherm_document::file::check_regular;

/// Where the lines of a file end.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Extent {
    /// Up to the last line feed (bytes).
    pub(super) lines: u64,
    /// Behind it: a line that was not written to its end (bytes).
    pub(super) rest: u64,
}

/// One line, as it stands in the file.
#[derive(Debug, Clone, Copy)]
pub(super) struct Line<'l> {
    /// Its number, from 1.
    pub(super) number: u64,
    /// Its bytes, line feed included; of one that is longer than any entry only the beginning, so that no file can fill the
    /// memory.
    pub(super) bytes: &'l [u8],
    /// Whether it has a line feed at its end.
    pub(super) ended: bool,
}

/// Calls `visit` with each line of a file; what stands behind the last line feed comes last.
pub(super) fn lines(path: &Path, mut visit: impl FnMut(Line<'_>)) -> io::Result<Extent> {
    check_regular(path)?;
    let mut reader = BufReader::with_capacity(1 << 16, File::open(path)?);
    let mut extent = Extent { lines: 0, rest: 0 };
    let mut line = Vec::new();
    for number in 1.. {
        line.clear();
        let read = reader.by_ref().take(MAX_LINE_BYTES as u64 + 1).read_until(b'\n', &mut line)?;
        if read == 0 {
            break;
        }
        let mut length = read as u64;
        let mut ended = line.ends_with(b"\n");
        if !ended {
            let (beyond, feed) = skip_line(&mut reader)?;
            length += beyond;
            ended = feed;
        }
        visit(Line { number, bytes: &line, ended });
        if !ended {
            extent.rest = length;
            break;
        }
        extent.lines += length;
    }
    Ok(extent)
}

/// Skips to behind the next line feed: how many bytes, and whether there was one.
fn skip_line(reader: &mut impl BufRead) -> io::Result<(u64, bool)> {
    let mut skipped = 0;
    loop {
        let buffer = reader.fill_buf()?;
        if buffer.is_empty() {
            return Ok((skipped, false));
        }
        let feed = buffer.iter().position(|byte| *byte == b'\n');
        let taken = feed.map_or(buffer.len(), |at| at + 1);
        reader.consume(taken);
        skipped += taken as u64;
        if feed.is_some() {
            return Ok((skipped, true));
        }
    }
}
