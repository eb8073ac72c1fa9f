//! Records, parsed without trust.

use mcap::records::{Record, op};
use mcap::{McapError, parse_record};

/// Longest record (bytes): chunks beyond this are not of a recorder.
pub(super) const LONGEST_RECORD: usize = 1 << 28;

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

/// How long an attachment says that it is.
fn attachment_length(data: &[u8]) -> Option<usize> {
    let mut at = 16_usize;
    // Name and media type behind their lengths.
    for _ in 0..2 {
        let length = u32::from_le_bytes(*data.get(at..)?.first_chunk()?);
        at = at.checked_add(4)?.checked_add(usize::try_from(length).ok()?)?;
    }
    let length = u64::from_le_bytes(*data.get(at..)?.first_chunk()?);
    // The length itself, and the CRC.
    at.checked_add(8 + 4)?.checked_add(usize::try_from(length).ok()?)
}

/// How long a record of names and values says that it is.
pub(super) fn metadata_length(data: &[u8]) -> Option<usize> {
    let text = |at: usize| {
        let length = u32::from_le_bytes(*data.get(at..)?.first_chunk()?);
        at.checked_add(4)?.checked_add(usize::try_from(length).ok()?)
    };
    let values = text(0)?;
    let length = u32::from_le_bytes(*data.get(values..)?.first_chunk()?);
    values.checked_add(4)?.checked_add(usize::try_from(length).ok()?)
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
}
