//! The files of a log: sizes, and how a recording is laid out.

use std::fs::File;
use std::io::{self, BufReader, ErrorKind, Read, Seek, SeekFrom};
use std::path::Path;

use mcap::records::op;
use serde::Serialize;

use crate::error::Error;
use crate::recording::MAGIC;
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
        let recording = if is_recording(path) { Some(layout(path, bytes).map_err(failed)?) } else { None };
        Ok(Self { path: path.display().to_string(), bytes, recording })
    }
}

/// Goes from record to record; each is an opcode (u8), a length (u64, little-endian) and so many bytes.
fn layout(path: &Path, bytes: u64) -> io::Result<ChunksInfo> {
    let mut file = BufReader::with_capacity(1 << 8, File::open(path)?);
    let mut info = ChunksInfo::default();
    let mut at = file.seek(SeekFrom::Start(MAGIC.len() as u64))?;
    let mut ended = false;
    loop {
        let mut head = [0; 9];
        match file.read_exact(&mut head) {
            Ok(()) => {}
            Err(error) if error.kind() == ErrorKind::UnexpectedEof => return Ok(info),
            Err(error) => return Err(error),
        }
        let [opcode, length @ ..] = head;
        let length = u64::from_le_bytes(length);
        let Some(end) = at.checked_add(9).and_then(|start| start.checked_add(length)) else {
            return Ok(info);
        };
        if end > bytes {
            return Ok(info);
        }
        match opcode {
            op::CHUNK => chunk(&mut file, length, &mut info)?,
            op::ATTACHMENT => info.attachments += 1,
            op::DATA_END => ended = true,
            op::FOOTER => {
                info.complete = ended && end + MAGIC.len() as u64 == bytes;
                return Ok(info);
            }
            _ => {}
        }
        at = file.seek(SeekFrom::Start(end))?;
    }
}

/// Reads the head of a chunk: start and end time, uncompressed size, checksum, compression, size.
fn chunk(file: &mut impl Read, length: u64, info: &mut ChunksInfo) -> io::Result<()> {
    let mut head = [0; 32];
    if length < head.len() as u64 {
        return Ok(());
    }
    file.read_exact(&mut head)?;
    let field = |from: usize| {
        head.get(from..from + 8).and_then(|bytes| bytes.try_into().ok()).map(u64::from_le_bytes)
    };
    let name_length = head.last_chunk::<4>().map_or(0, |bytes| u32::from_le_bytes(*bytes));
    let mut name = Vec::new();
    file.take(u64::from(name_length.min(64))).read_to_end(&mut name)?;
    let name = String::from_utf8_lossy(&name).into_owned();
    info.chunks += 1;
    info.uncompressed_bytes = info.uncompressed_bytes.saturating_add(field(16).unwrap_or(0));
    info.stored_bytes = info.stored_bytes.saturating_add(length);
    let name = if name.is_empty() { "none".to_owned() } else { name };
    if !info.compression.contains(&name) && info.compression.len() < 16 {
        info.compression.push(name);
    }
    Ok(())
}
