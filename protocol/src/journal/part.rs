//! Entries on the wire: in parts that fit a frame.

use serde::{Deserialize, Serialize};

use super::JournalEntry;
use crate::codec::{CodecError, Kind, PlainMessage, bounded};
use crate::version::{self, Versions};

/// Most bytes of an entry in one part.
pub const MAX_PART_BYTES: usize = 512 << 10;
/// Most parts of one entry.
pub const MAX_PARTS: u32 = 64;

/// One part of an entry: the message on `imu/{unit}/journal`.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct JournalPart {
    /// Serial of the unit, as in the entry.
    pub unit: String,
    /// The service instance, as in the entry.
    pub instance: String,
    /// Number of the entry.
    pub number: u64,
    /// Which part it is, from 0.
    pub part: u32,
    /// How many there are (1…64).
    pub parts: u32,
    /// Its share of the entry's bytes (1…512 KiB): those of all parts, one behind the other, are the entry.
    #[serde(deserialize_with = "bounded::<_, _, MAX_PART_BYTES>")]
    pub bytes: Vec<u8>,
}

impl PlainMessage for JournalPart {
    const KIND: Kind = Kind::Journal;
    const VERSIONS: Versions = version::JOURNAL;

    fn check(&self) -> Result<(), CodecError> {
        if !(1..=MAX_PARTS).contains(&self.parts) {
            return Err(CodecError::Value { field: "parts", must_be: "1 to 64" });
        }
        if self.part >= self.parts {
            return Err(CodecError::Value { field: "part", must_be: "below parts" });
        }
        if !(1..=MAX_PART_BYTES).contains(&self.bytes.len()) {
            return Err(CodecError::Value { field: "bytes", must_be: "1 byte to 512 KiB" });
        }
        Ok(())
    }
}

/// The parts of an entry, in order. An entry of more than [`MAX_PARTS`] has parts that cannot be encoded.
#[must_use]
pub fn split(entry: &JournalEntry) -> Vec<JournalPart> {
    // Writing to a vector does not fail.
    let bytes = postcard::to_allocvec(entry).unwrap_or_default();
    let chunks = bytes.chunks(MAX_PART_BYTES);
    let parts = u32::try_from(chunks.len()).unwrap_or(u32::MAX);
    let part = |(part, bytes): (u32, &[u8])| JournalPart {
        unit: entry.unit.clone(),
        instance: entry.instance.clone(),
        number: entry.number,
        part,
        parts,
        bytes: bytes.to_vec(),
    };
    (0..parts).zip(chunks).map(part).collect()
}
