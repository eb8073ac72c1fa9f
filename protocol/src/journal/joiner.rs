//! Parts put together again.

use std::collections::BTreeMap;

use thiserror::Error;

use super::{JournalEntry, JournalPart};
use crate::codec::{CodecError, Message};
use crate::escape::clipped;
use crate::key::MAX_UNIT_ID;

/// Most entries of which some parts are there and others are not.
pub const MAX_OPEN_ENTRIES: usize = 256;
/// Most bytes of all of them together.
pub const MAX_OPEN_BYTES: usize = 64 << 20;

/// Why a part does not become an entry; nothing of its entry is kept.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("journal of unit {}, entry {number}: {fault}", shown(.unit))]
pub struct JoinError {
    /// Serial of the unit, as the parts say.
    pub unit: String,
    /// Number of the entry, likewise.
    pub number: u64,
    /// What is wrong.
    pub fault: JoinFault,
}

/// What is wrong with a part, or with the entry that it was to complete.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum JoinFault {
    /// The part is none by itself.
    #[error(transparent)]
    Part(CodecError),
    /// The part before it did not come.
    #[error("received part {got} of {parts} instead of part {need}: the entry is lost")]
    Missing {
        /// The part that has come, from 0.
        got: u32,
        /// The part that was to come.
        need: u32,
        /// How many there are.
        parts: u32,
    },
    /// Too many entries are incomplete.
    #[error("more than {MAX_OPEN_ENTRIES} incomplete entries, or {MAX_OPEN_BYTES} bytes of them")]
    TooMuch,
    /// The parts together are no entry.
    #[error("the parts do not make an entry")]
    Malformed,
    /// The entry is another one than its parts say.
    #[error("the parts are entry {number} of unit {}", shown(.unit))]
    Other {
        /// Serial of the unit, as the entry says.
        unit: String,
        /// Number of the entry, likewise.
        number: u64,
    },
}

/// A serial as far as it may be one.
fn shown(unit: &str) -> String {
    clipped(unit, MAX_UNIT_ID)
}

/// An entry of which some parts are there.
#[derive(Debug)]
struct Open {
    number: u64,
    parts: u32,
    /// The part that is to come.
    next: u32,
    bytes: Vec<u8>,
}

/// What it takes in memory (bytes): nobody has looked at the names yet.
fn size((instance, unit): &(String, String), open: &Open) -> usize {
    instance.len() + unit.len() + open.bytes.len()
}

/// Puts the parts of entries together: of any number of units, those of one unit in the order in which they were sent.
///
/// The topic and each answer to a query need a joiner of their own. An entry whose remaining parts never come is given up
/// when the unit's next one begins; its number is missing then.
#[derive(Debug, Default)]
pub struct Joiner {
    /// By instance and unit.
    open: BTreeMap<(String, String), Open>,
    bytes: usize,
    given_up: u64,
}

impl Joiner {
    /// One that waits for nothing.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Takes a part; the entry where it was the last one.
    ///
    /// # Errors
    /// [`JoinError`]: the entry is given up.
    pub fn join(&mut self, part: JournalPart) -> Result<Option<JournalEntry>, JoinError> {
        let checked = part.check();
        let JournalPart { unit, instance, number, part: got, parts, bytes: more } = part;
        let place = (instance, unit);
        let refused = |fault| Err(JoinError { unit: place.1.clone(), number, fault });
        let open = self.close(&place);
        if let Err(error) = checked {
            self.given_up += u64::from(open.is_some());
            return refused(JoinFault::Part(error));
        }
        let open = match open {
            Some(open) if (open.number, open.parts, open.next) == (number, parts, got) => open,
            before => {
                self.given_up += u64::from(before.is_some());
                if got > 0 {
                    let need = before
                        .filter(|open| (open.number, open.parts) == (number, parts))
                        .map_or(0, |open| open.next);
                    return refused(JoinFault::Missing { got, need, parts });
                }
                Open { number, parts, next: 0, bytes: Vec::new() }
            }
        };
        let Open { mut bytes, .. } = open;
        bytes.extend(more);
        if got + 1 < parts {
            let open = Open { number, parts, next: got + 1, bytes };
            let size = size(&place, &open);
            if self.open.len() >= MAX_OPEN_ENTRIES || self.bytes + size > MAX_OPEN_BYTES {
                self.given_up += 1;
                return refused(JoinFault::TooMuch);
            }
            self.bytes += size;
            self.open.insert(place, open);
            return Ok(None);
        }
        let Ok((entry, [])) = postcard::take_from_bytes::<JournalEntry>(&bytes) else {
            return refused(JoinFault::Malformed);
        };
        if (&entry.instance, &entry.unit, entry.number) != (&place.0, &place.1, number) {
            return refused(JoinFault::Other { unit: entry.unit, number: entry.number });
        }
        Ok(Some(entry))
    }

    /// Entries that were given up because parts of them never came.
    #[must_use]
    pub fn given_up(&self) -> u64 {
        self.given_up
    }

    /// Takes an open entry out.
    fn close(&mut self, place: &(String, String)) -> Option<Open> {
        let open = self.open.remove(place)?;
        self.bytes -= size(place, &open);
        Some(open)
    }
}
