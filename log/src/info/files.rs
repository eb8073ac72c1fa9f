//! The files of a log: sizes, and how a recording is laid out.

use std::fs::File;
use std::io;
use std::path::Path;

use mcap::records::op;
use serde::Serialize;

use crate::error::Error;
use crate::recording::MAGIC;
use crate::recording::walk::{Head, RecordFile, number};
use crate::source::is_recording;

/// How a recording is laid out.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize)]
pub struct ChunksInfo {
    /// Whole chunks.
    pub chunks: u64,
    /// Bytes of their messages before compression.
    pub uncompressed_bytes: u64,
    /// Bytes of them in the file.
    pub stored_bytes: u64,
    /// How they are compressed, each way once.
    pub compression: Vec<String>,
    /// Files inside the recording.
    pub attachments: u64,
    /// Whether it ends as a recording that was closed; otherwise it was cut short.
    pub complete: bool,
}

/// One file.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct FileInfo {
    /// Where it is.
    pub path: String,
    /// Its length.
    pub bytes: u64,
    /// Its layout; `None` for a text log's.
    pub recording: Option<ChunksInfo>,
}

impl FileInfo {
    /// Looks at a file; of a recording only the heads of its records are read.
    ///
    /// # Errors
    /// [`Error::File`].
    pub fn of(path: &Path) -> Result<Self, Error> {
        let failed = |source| Error::file(path, "look at the log", source);
        let bytes = std::fs::metadata(path).map_err(failed)?.len();
        let recording = if is_recording(path) { Some(layout(path).map_err(failed)?) } else { None };
        Ok(Self { path: path.display().to_string(), bytes, recording })
    }
}

/// What is read at once (bytes): heads.
const BLOCK: usize = 1 << 8;

/// Goes from record to record.
fn layout(path: &Path) -> io::Result<ChunksInfo> {
    let mut records = RecordFile::new(File::open(path)?, BLOCK)?;
    let mut info = ChunksInfo::default();
    let (mut at, mut ended) = (MAGIC.len() as u64, false);
    while let Some(head) = records.head(at)? {
        at = head.end();
        match head.opcode {
            op::CHUNK => chunk(&mut records, &head, &mut info)?,
            op::ATTACHMENT => info.attachments += 1,
            op::DATA_END => ended = true,
            op::FOOTER => {
                info.complete = ended && at + MAGIC.len() as u64 == records.length();
                break;
            }
            _ => {}
        }
    }
    Ok(info)
}

/// Reads the head of a chunk: start and end time, uncompressed size, checksum, compression, size.
fn chunk(records: &mut RecordFile, chunk: &Head, info: &mut ChunksInfo) -> io::Result<()> {
    let head = records.load(chunk.begin, 32 + 64)?;
    let Some(name_length) = head.get(28..).and_then(|from| from.first_chunk()) else { return Ok(()) };
    let name = head.get(32..).unwrap_or_default();
    let name_length = usize::try_from(u32::from_le_bytes(*name_length)).unwrap_or(usize::MAX);
    let name = String::from_utf8_lossy(name.get(..name_length).unwrap_or(name)).into_owned();
    info.chunks += 1;
    info.uncompressed_bytes = info.uncompressed_bytes.saturating_add(number(&head, 16).unwrap_or(0));
    info.stored_bytes = info.stored_bytes.saturating_add(chunk.length);
    let name = if name.is_empty() { "none".to_owned() } else { name };
    if !info.compression.contains(&name) && info.compression.len() < 16 {
        info.compression.push(name);
    }
    Ok(())
}
