//! What is to be said of a recording that is not, or not surely, what the service heard.

use std::fmt;
use std::sync::Arc;

use crate::key::{Input, RawStream};
use serde::{Serialize, Serializer};

/// Where recorder and service did not have the same, or what could not be done.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub enum Notice {
    /// The service heard frames that the recording does not have.
    NotRecorded {
        /// Of which input.
        input: Input,
        /// How many.
        frames: u64,
        /// Number of the entry at which it was noticed.
        entry: u64,
    },
    /// The recording has frames that the service did not hear.
    NotHeard {
        /// Of which input.
        input: Input,
        /// How many.
        frames: u64,
        /// Number of the entry at which it was noticed.
        entry: u64,
    },
    /// Frames were given to the unit before an entry that they came behind.
    TooEarly {
        /// Of which input.
        input: Input,
        /// How many.
        frames: u64,
        /// Number of the entry.
        entry: u64,
    },
    /// The last frame before an entry is not in the recording: its place is guessed from the times of reception.
    PlaceUnknown {
        /// Of which input.
        input: Input,
        /// Number of the entry.
        entry: u64,
    },
    /// Entries of the journal are missing.
    EntriesMissing {
        /// Number of the first.
        from: u64,
        /// Number of the last.
        to: u64,
    },
    /// Entries that no stream can begin with stand before the first that one can begin with.
    WithoutBeginning {
        /// How many.
        entries: u64,
    },
    /// A part of an entry that cannot be used.
    Damaged {
        /// Why.
        words: String,
    },
    /// Two services had the unit at once.
    Beside {
        /// The instance whose entries are left out.
        instance: Arc<str>,
    },
    /// An event that could not be carried out as the service did.
    NotCarriedOut {
        /// Number of the entry.
        entry: u64,
        /// Why.
        words: String,
    },
    /// The service's memory is another one than the replica's; it is gone on with.
    OtherMemory {
        /// Number of the entry before it.
        entry: u64,
        /// In what they differ.
        words: String,
    },
}

impl Notice {
    /// A short name of its kind.
    #[must_use]
    pub const fn kind(&self) -> &'static str {
        match self {
            Self::NotRecorded { .. } => "not recorded",
            Self::NotHeard { .. } => "not heard",
            Self::TooEarly { .. } => "too early",
            Self::PlaceUnknown { .. } => "place unknown",
            Self::EntriesMissing { .. } => "entries missing",
            Self::WithoutBeginning { .. } => "without beginning",
            Self::Damaged { .. } => "damaged",
            Self::Beside { .. } => "beside",
            Self::NotCarriedOut { .. } => "not carried out",
            Self::OtherMemory { .. } => "other memory",
        }
    }
}

/// Name of an input, for people.
#[must_use]
pub const fn input_name(input: Input) -> &'static str {
    match input {
        Input::Raw(RawStream::Gyro) => "gyro",
        Input::Raw(RawStream::Accel) => "accelerometer",
        Input::Raw(RawStream::Temperature) => "temperature",
        Input::Raw(RawStream::Health) => "health",
        Input::Reference => "reference",
    }
}

fn frames(count: u64) -> String {
    format!("{count} frame{}", if count == 1 { "" } else { "s" })
}

impl fmt::Display for Notice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotRecorded { input, frames: count, entry } => write!(
                f,
                "{} {} that the service received before entry {entry} of its journal are not in the recording",
                frames(*count),
                input_name(*input)
            ),
            Self::NotHeard { input, frames: count, entry } => write!(
                f,
                "{} {} of the recording before entry {entry} of the journal did not reach the service",
                frames(*count),
                input_name(*input)
            ),
            Self::TooEarly { input, frames: count, entry } => write!(
                f,
                "{} {} reached the unit before entry {entry} of the journal, in the service after it: earlier frames \
                 are missing in the recording",
                frames(*count),
                input_name(*input)
            ),
            Self::PlaceUnknown { input, entry } => write!(
                f,
                "the last {} frame that the service received before entry {entry} of its journal is not in the \
                 recording: its place is estimated from times of reception",
                input_name(*input)
            ),
            Self::EntriesMissing { from, to } if from == to => {
                write!(f, "entry {from} of the journal is not in the recording")
            }
            Self::EntriesMissing { from, to } => {
                write!(f, "entries {from} to {to} of the journal are not in the recording")
            }
            Self::WithoutBeginning { entries } => write!(
                f,
                "the journal has {entries} entries before the first that a stream can begin with: ticks of that time \
                 are left out"
            ),
            Self::Damaged { words } => f.write_str(words),
            Self::Beside { instance } => write!(
                f,
                "two services had the unit at once: the journal of instance {instance} is left out, and it is \
                 unknown which of them published a corrected tick"
            ),
            Self::NotCarriedOut { entry, words } => write!(f, "entry {entry} of the journal: {words}"),
            Self::OtherMemory { entry, words } => write!(
                f,
                "after entry {entry} of the journal the service's memory differs from that of the recording \
                 ({words}); from there on the service's is used"
            ),
        }
    }
}

/// As words.
impl Serialize for Notice {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}
