//! Records, parsed without trust.

use std::io::Read;

use mcap::records::{Record, op};
use mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};
use mcap::{McapError, parse_record};

use super::walk::number;

/// Longest record (bytes): chunks beyond this are not of a recorder.
pub(super) const LONGEST_RECORD: usize = 1 << 28;
/// Bytes of a chunk that are handed over at once.
const BLOCK: usize = 1 << 20;

/// Parses a record; one whose lengths do not go together is an error, as it is not everywhere in the library.
///
/// # Errors
/// Those of the library.
pub(super) fn parse(opcode: u8, data: &[u8]) -> Result<Record<'_>, McapError> {
    if opcode == op::ATTACHMENT && attachment_length(data) != Some(data.len()) {
        return Err(McapError::UnexpectedEof);
    }
    parse_record(opcode, data)
}

/// The records of a chunk, of all of them or of none.
///
/// # Errors
/// Those of the library; where a length or its CRC is wrong.
pub(crate) fn chunk_records(data: &[u8]) -> Result<Vec<Record<'static>>, McapError> {
    if chunk_length(data) != Some(data.len()) {
        return Err(McapError::UnexpectedEoc);
    }
    // Not the library's own reader of chunks: it takes every length in a damaged one for true, and memory for it.
    let options = LinearReaderOptions::default()
        .with_skip_start_magic(true)
        .with_skip_end_magic(true)
        .with_prevalidate_chunk_crcs(true)
        .with_record_length_limit(LONGEST_RECORD);
    let mut reader = LinearReader::new_with_options(options);
    let length = (data.len() as u64).to_le_bytes();
    let mut chunk = [op::CHUNK].as_slice().chain(length.as_slice()).chain(data);
    let mut records = Vec::new();
    while let Some(event) = reader.next_event() {
        match event? {
            LinearReadEvent::ReadRequest(_) => {
                let count = chunk.read(reader.insert(BLOCK))?;
                reader.notify_read(count);
            }
            LinearReadEvent::Record { opcode, data } => records.push(parse(opcode, data)?.into_owned()),
        }
    }
    Ok(records)
}

/// How long a chunk says that it is: behind its end the library would go on.
fn chunk_length(data: &[u8]) -> Option<usize> {
    behind_long(data, behind_short(data, 28)?)
}

/// How long an attachment says that it is: name and media type, what it holds, the CRC.
fn attachment_length(data: &[u8]) -> Option<usize> {
    behind_long(data, behind_short(data, behind_short(data, 16)?)?)?.checked_add(4)
}

/// How long a record of names and values says that it is.
pub(super) fn metadata_length(data: &[u8]) -> Option<usize> {
    behind_short(data, behind_short(data, 0)?)
}

/// Where that ends whose length (u32) stands at a place.
fn behind_short(data: &[u8], at: usize) -> Option<usize> {
    let length = u32::from_le_bytes(*data.get(at..)?.first_chunk()?);
    at.checked_add(4)?.checked_add(usize::try_from(length).ok()?)
}

/// Where that ends whose length (u64) stands at a place.
fn behind_long(data: &[u8], at: usize) -> Option<usize> {
    at.checked_add(8)?.checked_add(usize::try_from(number(data, at)?).ok()?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_attachment_of_any_bytes_is_no_panic() {
        for length in 0..64 {
            for byte in [0, 1, 4, 20, 255] {
                assert!(parse(op::ATTACHMENT, &vec![byte; length]).is_err() || length == 36 && byte == 0);
            }
        }
    }

    /// A chunk without compression and CRC that holds these bytes.
    fn chunk(records: &[u8]) -> Vec<u8> {
        let length = (records.len() as u64).to_le_bytes();
        let mut bytes = vec![0; 16];
        bytes.extend(length);
        bytes.extend([0; 8]);
        bytes.extend(length);
        bytes.extend(records);
        bytes
    }

    #[test]
    fn a_length_in_a_damaged_chunk_is_not_taken_for_true() {
        for length in [1 << 62, u64::MAX, LONGEST_RECORD as u64 + 1, 100] {
            let mut records = vec![op::CHANNEL];
            records.extend(length.to_le_bytes());
            records.extend([0; 20]);
            assert!(chunk_records(&chunk(&records)).is_err(), "{length}");
        }
        assert!(chunk_records(&chunk(&[])).is_ok_and(|records| records.is_empty()));
        // A record that goes on behind the chunk's own end.
        let mut record = vec![op::HEADER];
        record.extend(8_u64.to_le_bytes());
        record.extend([0; 8]);
        let whole = chunk(&record);
        assert!(chunk_records(&whole).is_ok_and(|records| records.len() == 1));
        let mut short = whole;
        short[32] -= 4;
        assert!(chunk_records(&short).is_err());
    }
}
