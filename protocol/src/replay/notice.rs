//! What is to be said of a recording that is not, or not surely, what the service heard.

use std::sync::Arc;

use serde::{Serialize, Serializer};
use thiserror::Error;

use crate::key::Input;

/// Where recorder and service did not have the same, or what could not be done.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum Notice {
    /// The service heard frames that the recording does not have.
    #[error(
        "{} that the service received before entry {entry} of its journal are not in the recording",
        counted(*.frames, *.input)
    )]
    NotRecorded {
        /// Of which input.
        input: Input,
        /// How many.
        frames: u64,
        /// Number of the entry at which it was noticed.
        entry: u64,
    },
    /// The recording has frames that the service did not hear.
    #[error(
        "{} of the recording before entry {entry} of the journal did not reach the service",
        counted(*.frames, *.input)
    )]
    NotHeard {
        /// Of which input.
        input: Input,
        /// How many.
        frames: u64,
        /// Number of the entry at which it was noticed.
        entry: u64,
    },
    /// Frames were given to the unit before an entry that they came behind.
    #[error(
        "{} reached the unit before entry {entry} of the journal, in the service after it: earlier frames are missing in \
        the recording",
        counted(*.frames, *.input)
    )]
    TooEarly {
        /// Of which input.
        input: Input,
        /// How many.
        frames: u64,
        /// Number of the entry.
        entry: u64,
    },
    /// The last frame before an entry is not in the recording: its place is guessed from the times of reception.
    #[error(
        "the last {} frame that the service received before entry {entry} of its journal is not in the recording: its \
        place is estimated from times of reception",
        .input.name()
    )]
    PlaceUnknown {
        /// Of which input.
        input: Input,
        /// Number of the entry.
        entry: u64,
    },
    /// Entries of the journal are missing.
    #[error("{} of the journal {} not in the recording", entries(*.from, *.to), if from == to { "is" } else { "are" })]
    EntriesMissing {
        /// Number of the first.
        from: u64,
        /// Number of the last.
        to: u64,
    },
    /// Entries that no stream can begin with stand before the first that one can begin with.
    #[error(
        "the journal has {entries} entries before the first that a stream can begin with: ticks of that time are left out"
    )]
    WithoutBeginning {
        /// How many.
        entries: u64,
    },
    /// A part of an entry that cannot be used.
    #[error("{words}")]
    Damaged {
        /// Why.
        words: String,
    },
    /// Two services had the unit at once.
    #[error(
        "two services had the unit at once: the journal of instance {instance} is left out, and it is unknown which of \
        them published a corrected tick"
    )]
    Beside {
        /// The instance whose entries are left out.
        instance: Arc<str>,
    },
    /// An event that could not be carried out as the service did.
    #[error("entry {entry} of the journal: {words}")]
    NotCarriedOut {
        /// Number of the entry.
        entry: u64,
        /// Why.
        words: String,
    },
    /// The service's memory is another one than the replica's; it is gone on with.
    #[error(
        "after entry {entry} of the journal the service's memory differs from that of the recording ({words}); from there \
        on the service's is used"
    )]
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

fn counted(frames: u64, input: Input) -> String {
    format!("{frames} {} frame{}", input.name(), if frames == 1 { "" } else { "s" })
}

fn entries(from: u64, to: u64) -> String {
    if from == to { format!("entry {from}") } else { format!("entries {from} to {to}") }
}

/// As words.
impl Serialize for Notice {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}
