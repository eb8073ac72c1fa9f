//! Frames: kind, version, body, checksum.
//!
//! | bytes | meaning |
//! |---|---|
//! | 0 | kind of message ([`Kind`]) |
//! | 1 | version ([`crate::version`]) |
//! | 2 … n−4 | body, postcard |
//! | last 4 | CRC-32 (ISO-HDLC, as in zlib) of all bytes before, little-endian |
//!
//! Decoding never panics and never allocates more than a fixed multiple of the frame's length, which is bounded too.

mod reader;
mod writer;

use std::fmt;
use std::marker::PhantomData;
use std::mem;
use std::sync::LazyLock;

use serde::de::{DeserializeOwned, Error as _, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize};
use thiserror::Error;

pub(crate) use reader::{Body, Stretch, Tail};
pub(crate) use writer::{MAX_NUMBER, Writer, append, append_text};

use crate::version::Versions;

/// Longest frame that is decoded, in bytes.
pub const MAX_FRAME: usize = 1 << 20;
/// Most ticks in one batch.
pub const MAX_TICKS: usize = 4096;
/// Kind and version in front.
const HEADER: usize = 2;
/// CRC-32 behind.
const CHECKSUM: usize = 4;
/// What is read or written at once (bytes): 255 and the longest step from there.
pub(crate) const WINDOW: usize = 272;
/// Highest bit of each byte: set where a number goes on behind it.
const GOES_ON: u64 = 0x8080_8080_8080_8080;

/// Kind of a message: the first byte of its frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum Kind {
    /// [`crate::raw::GyroBatch`].
    RawGyro = 1,
    /// [`crate::raw::AccelBatch`].
    RawAccel = 2,
    /// [`crate::raw::TemperatureBatch`].
    RawTemperature = 3,
    /// [`crate::corrected::CorrectedBatch`].
    Corrected = 4,
    /// [`crate::status::Status`].
    Status = 5,
    /// [`crate::raw::HealthBatch`].
    RawHealth = 6,
    /// [`crate::service_status::ServiceStatus`].
    ServiceStatus = 7,
    /// [`crate::reference::Reference`].
    Reference = 8,
    /// [`crate::journal::JournalPart`].
    Journal = 9,
}

/// A message that has a frame of its own.
pub trait Message: Sized {
    /// Its kind.
    const KIND: Kind;
    /// Versions of its body.
    const VERSIONS: Versions;

    /// Checks what the types cannot say; called before a message is written.
    ///
    /// # Errors
    /// [`CodecError`] where the parts of the message contradict each other.
    fn check(&self) -> Result<(), CodecError> {
        Ok(())
    }

    /// Version that this message is written in.
    fn version(&self) -> u8 {
        Self::VERSIONS.current
    }

    /// Appends the body, in [that version](Message::version).
    ///
    /// # Errors
    /// [`CodecError`] where a value has no form on the wire.
    fn write_body(&self, frame: &mut Vec<u8>) -> Result<(), CodecError>;

    /// Reads a body of a version that [`Message::VERSIONS`] holds, to its end, and checks it.
    ///
    /// # Errors
    /// [`CodecError::Malformed`], then [`CodecError::Trailing`], then what [`Message::check`] finds.
    fn read_body(version: u8, body: &[u8]) -> Result<Self, CodecError>;
}

/// A message whose body is what serde makes of it.
pub(crate) trait PlainMessage: Serialize + DeserializeOwned {
    /// [`Message::KIND`].
    const KIND: Kind;
    /// [`Message::VERSIONS`].
    const VERSIONS: Versions;

    /// [`Message::check`].
    fn check(&self) -> Result<(), CodecError> {
        Ok(())
    }

    /// Reads a body of any of the versions; what is written in another one than the current converts.
    fn read(version: u8, body: &[u8]) -> Result<Self, CodecError> {
        let _ = version;
        whole(body)
    }
}

impl<M: PlainMessage> Message for M {
    const KIND: Kind = <M as PlainMessage>::KIND;
    const VERSIONS: Versions = <M as PlainMessage>::VERSIONS;

    fn check(&self) -> Result<(), CodecError> {
        PlainMessage::check(self)
    }

    fn write_body(&self, frame: &mut Vec<u8>) -> Result<(), CodecError> {
        *frame = postcard::to_extend(self, mem::take(frame)).map_err(|_| CodecError::Malformed)?;
        Ok(())
    }

    fn read_body(version: u8, body: &[u8]) -> Result<Self, CodecError> {
        let message = M::read(version, body)?;
        PlainMessage::check(&message)?;
        Ok(message)
    }
}

/// What a body holds that serde reads, to its end.
pub(crate) fn whole<T: DeserializeOwned>(body: &[u8]) -> Result<T, CodecError> {
    match postcard::take_from_bytes(body) {
        Ok((value, [])) => Ok(value),
        Ok((_, rest)) => Err(CodecError::Trailing { count: rest.len() }),
        Err(_) => Err(CodecError::Malformed),
    }
}

/// Why a frame cannot be read or written.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum CodecError {
    /// Too short to hold header and checksum, or longer than [`MAX_FRAME`].
    #[error("frame has {length} bytes, must have {} to {MAX_FRAME}", HEADER + CHECKSUM)]
    Length {
        /// Its length in bytes.
        length: usize,
    },
    /// Another kind than the key promises.
    #[error("message is of kind {got}, expected {need}")]
    Kind {
        /// The byte found.
        got: u8,
        /// The byte expected.
        need: u8,
    },
    /// A version that this reader does not know.
    #[error("message has version {got}, this reader knows {known}")]
    Version {
        /// The byte found.
        got: u8,
        /// Versions of this kind that are known.
        known: Versions,
    },
    /// The bytes changed on their way.
    #[error("checksum is {got:#010x}, the bytes give {need:#010x}")]
    Checksum {
        /// The checksum found.
        got: u32,
        /// The checksum of the bytes.
        need: u32,
    },
    /// The body does not decode as its version says.
    #[error("body is malformed")]
    Malformed,
    /// Bytes are left over behind the body.
    #[error("{count} bytes are left over after the body")]
    Trailing {
        /// How many.
        count: usize,
    },
    /// A batch without ticks, or with too many.
    #[error("batch has {count} ticks, must have 1 to {MAX_TICKS}")]
    Ticks {
        /// How many.
        count: usize,
    },
    /// Counts and means, or different numbers of sensors, in one batch.
    #[error("tick {index} of the batch has other readings than the first")]
    MixedReadings {
        /// Index of the first such tick.
        index: usize,
    },
    /// Temperatures that are not one per channel.
    #[error("tick {index} of the batch has {got} readings, must have one per channel: {need}")]
    ChannelReadings {
        /// Index of the first such tick.
        index: usize,
        /// How many it has.
        got: usize,
        /// How many channels there are.
        need: usize,
    },
    /// Half-period counts for another number of gyros than there are.
    #[error("tick {index} of the batch has half-period counts of {got} gyros, must be 0 or {need}")]
    HalfPeriods {
        /// Index of the first such tick.
        index: usize,
        /// How many it has.
        got: usize,
        /// How many gyros there are.
        need: usize,
    },
    /// Readings that are said to be counts and are none.
    #[error("tick {index} of the batch has readings that are not counts of 32 bits")]
    NotCounts {
        /// Index of the first such tick.
        index: usize,
    },
    /// A field with a value that its message cannot carry.
    #[error("{field} must be {must_be}")]
    Value {
        /// Name of the field.
        field: &'static str,
        /// What it must be.
        must_be: &'static str,
    },
}

/// Encodes a message into `frame`, whose old contents are dropped and whose capacity is kept.
///
/// # Errors
/// What [`Message::check`] finds; [`CodecError::Length`] beyond [`MAX_FRAME`].
pub fn encode_into<M: Message>(message: &M, frame: &mut Vec<u8>) -> Result<(), CodecError> {
    message.check()?;
    frame.clear();
    begin::<M>(frame, message.version());
    message.write_body(frame)?;
    seal(frame);
    if frame.len() > MAX_FRAME {
        return Err(CodecError::Length { length: frame.len() });
    }
    Ok(())
}

/// Appends kind and version.
pub(crate) fn begin<M: Message>(frame: &mut Vec<u8>, version: u8) {
    frame.extend([M::KIND as u8, version]);
}

/// What every checksum begins with: making one anew would ask each time what the processor can do.
static CHECKSUM_OF_NOTHING: LazyLock<crc32fast::Hasher> = LazyLock::new(crc32fast::Hasher::new);

fn checksum(bytes: &[u8]) -> u32 {
    let mut hasher = CHECKSUM_OF_NOTHING.clone();
    hasher.update(bytes);
    hasher.finalize()
}

/// Appends the checksum of everything before.
pub(crate) fn seal(frame: &mut Vec<u8>) {
    let checksum = checksum(frame);
    frame.extend(checksum.to_le_bytes());
}

/// Encodes a message.
///
/// # Errors
/// As [`encode_into`].
pub fn encode<M: Message>(message: &M) -> Result<Vec<u8>, CodecError> {
    let mut frame = Vec::new();
    encode_into(message, &mut frame)?;
    Ok(frame)
}

/// Decodes a frame.
///
/// # Errors
/// [`CodecError`], whatever the bytes are.
pub fn decode<M: Message>(frame: &[u8]) -> Result<M, CodecError> {
    let (version, body) = open::<M>(frame)?;
    M::read_body(version, body)
}

/// Version and body of a sound frame.
fn open<M: Message>(frame: &[u8]) -> Result<(u8, &[u8]), CodecError> {
    let length = frame.len();
    if !(HEADER + CHECKSUM..=MAX_FRAME).contains(&length) {
        return Err(CodecError::Length { length });
    }
    let Some((&[kind, version], _)) = frame.split_first_chunk() else {
        return Err(CodecError::Length { length });
    };
    let Some((covered, found)) = frame.split_last_chunk::<CHECKSUM>() else {
        return Err(CodecError::Length { length });
    };
    if kind != M::KIND as u8 {
        return Err(CodecError::Kind { got: kind, need: M::KIND as u8 });
    }
    let known = M::VERSIONS;
    if !(known.min..=known.current).contains(&version) {
        return Err(CodecError::Version { got: version, known });
    }
    let (got, need) = (u32::from_le_bytes(*found), checksum(covered));
    if got != need {
        return Err(CodecError::Checksum { got, need });
    }
    Ok((version, covered.get(HEADER..).unwrap_or_default()))
}

/// Body of a sound frame, for a reader of the current version that needs no message in between.
pub(crate) fn body<M: Message>(frame: &[u8]) -> Result<&[u8], CodecError> {
    open::<M>(frame).map(|(_, body)| body)
}

/// Most elements for which room is made before they come: a frame may promise more than it holds.
const ROOM_AHEAD: usize = 32;

/// Deserialises a sequence of at most `MAX` elements, allocating as they come and little ahead.
pub(crate) fn bounded<'de, D, T, const MAX: usize>(deserializer: D) -> Result<Vec<T>, D::Error>
where
    D: Deserializer<'de>,
    T: Deserialize<'de>,
{
    struct Bounded<T, const MAX: usize>(PhantomData<T>);

    impl<'de, T: Deserialize<'de>, const MAX: usize> Visitor<'de> for Bounded<T, MAX> {
        type Value = Vec<T>;

        fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
            write!(f, "at most {MAX} elements")
        }

        fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<Vec<T>, A::Error> {
            let mut elements = Vec::with_capacity(seq.size_hint().unwrap_or(0).min(ROOM_AHEAD));
            while let Some(element) = seq.next_element()? {
                if elements.len() == MAX {
                    return Err(A::Error::invalid_length(MAX + 1, &self));
                }
                elements.push(element);
            }
            Ok(elements)
        }
    }

    deserializer.deserialize_seq(Bounded::<T, MAX>(PhantomData))
}
