//! The journal of a unit: what acts on its stream beside the frames that come in.
//!
//! Raw frames and the journal together are enough to correct a log again, to the bit. Each entry says how much the stream
//! had been given of each input when the event came ([`JournalEntry::heard`]): a reader gives a
//! [`UnitStream`](crate::stream::UnitStream) the recorded frames up to there, then the event
//! ([`carry_out`](crate::stream::UnitStream::carry_out)).
//!
//! ```
//! use isotherm_protocol::journal::{Joiner, JournalEntry, JournalEvent, split};
//!
//! let event = JournalEvent::Flushed;
//! let entry = JournalEntry { unit: "ZLG-0001".into(), instance: "d36a8f01".into(), number: 3, heard: [Default::default(); 5], event };
//! let mut joiner = Joiner::new();
//! let joined: Vec<_> = split(&entry).into_iter().filter_map(|part| joiner.join(part).unwrap()).collect();
//! assert_eq!(joined, [entry]);
//! ```
//!
//! An entry may be longer than a frame: on the wire it is one or several [`JournalPart`]s on `imu/{unit}/journal`.
//!
//! A reader that begins in the middle asks: a query on the same key is answered with an entry of the kind
//! [`JournalEvent::Memory`], which holds everything that the stream knows *after* the entry whose number it carries.

mod joiner;
mod part;

use isotherm_correction::operation::Command;
use isotherm_correction::unit::UnitSettings;
use serde::{Deserialize, Serialize};

pub use joiner::{JoinError, JoinFault, Joiner, MAX_OPEN_BYTES, MAX_OPEN_ENTRIES};
pub use part::{JournalPart, MAX_PART_BYTES, MAX_PARTS, split};

use crate::control::Schedule;
use crate::corrected::Revision;
use crate::digest::Digest;
use crate::key::Input;
use crate::stream::Heard;

/// One event in the life of a unit's stream.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct JournalEntry {
    /// Serial of the unit.
    pub unit: String,
    /// The service instance: its Zenoh id as text.
    pub instance: String,
    /// Counts the entries of this unit at this instance from 1, without holes; it goes on when the unit starts anew. That
    /// of a [`JournalEvent::Memory`] is the number of the last entry before it, 0 where there is none.
    pub number: u64,
    /// What the stream had been given before the event, by [`Input::index`]; it goes on when the unit starts anew.
    pub heard: [Heard; Input::ALL.len()],
    /// What happened.
    pub event: JournalEvent,
}

/// What acts on a unit's stream beside its frames.
///
/// Settings and commands are written as the core's own types, field by field in their order.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum JournalEvent {
    /// The unit appeared, or started anew after an alarm: its stream knows nothing. What it had before an alarm is given to
    /// it again by the entries that follow.
    Began {
        /// Settings of the unit.
        settings: UnitSettings,
        /// The counters of the revisions that it is given from here on are above this one.
        highest_revision: u64,
    },
    /// Everything that the stream knows: the answer to a query.
    Memory {
        /// [`UnitStream::memory`](crate::stream::UnitStream::memory).
        memory: Vec<u8>,
        /// Text of the document in force; `None` where there is none.
        document: Option<String>,
        /// Text of the document that waits for its tick, likewise.
        pending: Option<String>,
    },
    /// A calibration was given to the unit.
    Changed {
        /// Its revision.
        revision: Revision,
        /// From which tick on.
        at: Schedule,
        /// Time over which the change is made (ns, ≥ 0).
        slew_ns: i64,
        /// Text of the document; `None` for a calibration that never was one.
        document: Option<String>,
        /// SHA-256 of the overlay that is part of the text; `None` without one.
        overlay: Option<Digest>,
        /// Where it came from, in words.
        source: String,
    },
    /// A command was given to the unit.
    Commanded {
        /// The command.
        command: Command,
        /// Whether it was carried out.
        accepted: bool,
        /// Why not, or the state that it led to.
        words: String,
    },
    /// Nothing more was waited for: the stream had stopped, by the service's clock. Only where something waited.
    Flushed,
    /// A self-test got no more ticks, by the service's clock: it ended with what it had seen.
    SelfTestExpired,
    /// A pre-launch calibration got no more ticks, by the service's clock: it was refused.
    PreLaunchEnded,
    /// The service stops. Nothing follows.
    Ended,
}

impl JournalEvent {
    /// Its name, for people.
    #[must_use]
    pub const fn name(&self) -> &'static str {
        match self {
            Self::Began { .. } => "began",
            Self::Memory { .. } => "memory",
            Self::Changed { .. } => "changed",
            Self::Commanded { .. } => "commanded",
            Self::Flushed => "flushed",
            Self::SelfTestExpired => "self-test expired",
            Self::PreLaunchEnded => "pre-launch ended",
            Self::Ended => "ended",
        }
    }
}
