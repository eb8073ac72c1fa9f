//! What goes with every message: its number, its time, its publisher.

use thiserror::Error;

use crate::name::Gid;

/// Its length.
pub const LENGTH: usize = 33;
/// What stands before the publisher: its length.
const GID_LENGTH: u8 = 16;
/// Name of the first value, which releases before jazzy 0.2.4 put before it.
const FIRST_NAME: &[u8] = b"sequence_number";

/// What goes with a message.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Attachment {
    /// Number of the message, from 1 on.
    pub sequence: i64,
    /// When it was published (ns since 1970-01-01 UTC).
    pub time_ns: i64,
    /// Who published it.
    pub gid: Gid,
}

/// Why an attachment is none.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
pub enum AttachmentError {
    /// It is not there.
    #[error("has no attachment: its sender is not a node of rmw_zenoh")]
    None,
    /// It is as `rmw_zenoh` had it before jazzy 0.2.4.
    #[error("has the attachment of rmw_zenoh before 0.2.4 (jazzy) or 0.6.0 (rolling): update its sender")]
    Old,
    /// It is anything else.
    #[error("has an attachment of {length} bytes that is not of rmw_zenoh, which has {LENGTH}")]
    Other {
        /// Its length.
        length: usize,
    },
}

impl Attachment {
    /// As bytes.
    #[must_use]
    pub fn to_bytes(&self) -> Vec<u8> {
        let numbers = [self.sequence.to_le_bytes(), self.time_ns.to_le_bytes()];
        [numbers.as_flattened(), &[GID_LENGTH], &self.gid].concat()
    }

    /// From bytes.
    ///
    /// # Errors
    /// [`AttachmentError`].
    pub fn parse(bytes: Option<&[u8]>) -> Result<Self, AttachmentError> {
        let bytes = bytes.ok_or(AttachmentError::None)?;
        let other = AttachmentError::Other { length: bytes.len() };
        if bytes.windows(FIRST_NAME.len()).take(LENGTH).any(|part| part == FIRST_NAME) {
            return Err(AttachmentError::Old);
        }
        let (sequence, rest) = bytes.split_first_chunk::<8>().ok_or(other)?;
        let (time, rest) = rest.split_first_chunk::<8>().ok_or(other)?;
        let (length, gid) = rest.split_first().ok_or(other)?;
        let gid = Gid::try_from(gid).ok().filter(|_| *length == GID_LENGTH).ok_or(other)?;
        let sequence = i64::from_le_bytes(*sequence);
        if sequence < 0 {
            return Err(other);
        }
        Ok(Self { sequence, time_ns: i64::from_le_bytes(*time), gid })
    }
}
