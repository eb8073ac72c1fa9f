//! An end for a file that could not be written to its end.

use std::fs::File;
use std::io::{self, Cursor, Seek, SeekFrom, Write};

use mcap::{McapError, WriteOptions};

use super::{MAGIC, Metadata};

/// Cuts a file at a length and ends it there, without a summary: what that would say has to be read from the messages. Where
/// there is no room for the record of why, without that too.
///
/// # Errors
/// Where there is no room even for an end; the file is cut all the same.
pub(super) fn write(mut file: &File, length: u64, why: Option<&Metadata>) -> io::Result<()> {
    let mut end = |why: Option<&Metadata>| {
        file.set_len(length)?;
        file.seek(SeekFrom::Start(length))?;
        let bytes = bytes(why).map_err(io::Error::other)?;
        file.write_all(&bytes)?;
        file.sync_all()
    };
    let ended = end(why).or_else(|_| end(None));
    if ended.is_err() {
        file.set_len(length)?;
    }
    ended
}

/// Everything behind the header of a file that holds nothing.
fn bytes(why: Option<&Metadata>) -> Result<Vec<u8>, McapError> {
    let mut file = Cursor::new(Vec::new());
    let mut writer = WriteOptions::new()
        .use_chunks(false)
        .calculate_data_section_crc(false)
        .emit_summary_records(false)
        .emit_summary_offsets(false)
        .create(&mut file)?;
    // The file begins with its magic and one record: opcode, length, header.
    writer.flush()?;
    if let Some(Metadata { name, values }) = why {
        writer.write_metadata(&mcap::records::Metadata { name: name.clone(), metadata: values.clone() })?;
    }
    writer.finish()?;
    drop(writer);
    let bytes = file.into_inner();
    let length = bytes.get(MAGIC.len() + 1..).and_then(|rest| rest.first_chunk()).copied();
    let length = usize::try_from(u64::from_le_bytes(length.unwrap_or_default())).unwrap_or(usize::MAX);
    let begin = (MAGIC.len() + 9).saturating_add(length);
    Ok(bytes.get(begin..).unwrap_or_default().to_vec())
}
