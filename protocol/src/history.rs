//! What was done to a unit: the entries of the audit file, which operators are sent as JSON too.
//!
//! One entry is one line of JSON; [`AuditEntry::to_line`] and [`AuditEntry::from_line`] write and read it with its checksum, and
//! [`chain`] makes the lines a chain of digests. Unknown fields are skipped, so that an older reader understands a newer file
//! as far as it can.

pub mod chain;
mod line;
mod time;
mod words;

pub use crate::digest::{Digest, DigestError};
pub use line::{LineError, MAX_LINE_BYTES};
pub use time::WallTime;

use serde::{Deserialize, Serialize};

use crate::control::{Order, PlaceOrder, Schedule};

/// Most lines that [`Acceptance::changed`] keeps; one more says how many there were beyond.
pub const MAX_CHANGED: usize = 32;
/// Most problems that [`Refusal::problems`] keeps.
pub const MAX_PROBLEMS: usize = 16;
/// Most good sets that [`CarriedUnit::sets`] keeps.
pub const MAX_CARRIED: usize = 8;

/// One line of the audit file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct AuditEntry {
    /// Consecutive from 1 over all units and files.
    pub number: u64,
    /// When it was written down.
    pub time: WallTime,
    /// Serial of the unit; `None` where a refused document does not say whose it is.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub unit: Option<String>,
    /// Who asked for it, at most [`MAX_BY`](crate::control::MAX_BY) characters; empty where nobody said.
    #[serde(default)]
    pub by: String,
    /// What happened.
    #[serde(flatten)]
    pub event: AuditEvent,
}

/// What happened.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "event", rename_all = "kebab-case")]
#[non_exhaustive]
pub enum AuditEvent {
    /// A calibration passed every check and will be put in force.
    Accepted(Acceptance),
    /// The first tick was corrected with it.
    InForce(FirstTick),
    /// It never came, or no longer comes, in force: the one before holds.
    Withdrawn(Withdrawal),
    /// A document was refused; nothing has changed.
    Refused(Refusal),
    /// A command was given.
    Command(CommandRecord),
    /// First in a new file: what holds for a unit by the files before it.
    CarriedUnit(CarriedUnit),
    /// What was last seen in a file of the watched folder, where no other entry says so; and first in a new file.
    CarriedFile(CarriedFile),
}

/// A calibration that was accepted.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Acceptance {
    /// Revision counter that it has been given.
    pub revision: u64,
    /// SHA-256 of the document's bytes.
    pub digest: Digest,
    /// SHA-256 of the overlay laid over the document (result of a pre-launch calibration); `None` for a document alone.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub overlay: Option<Digest>,
    /// Where it came from.
    pub source: Source,
    /// SHA-256 of the document that was in force before; `None` for the first.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub base: Option<Digest>,
    /// What differs from the one before, a short line each: at most [`MAX_CHANGED`], then "and N more".
    #[serde(default)]
    pub changed: Vec<String>,
    /// When it takes effect.
    #[serde(default)]
    pub schedule: Schedule,
    /// Time over which the change is made (ms); 0 is at once.
    #[serde(default)]
    pub slew_ms: u64,
}

/// Where a calibration came from.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(tag = "from", rename_all = "kebab-case")]
pub enum Source {
    /// A file of the watched folder that has changed.
    Folder {
        /// The file.
        path: String,
    },
    /// A put or query on `imu/{unit}/calibration`.
    Bus,
    /// An earlier revision, put in force again.
    Rollback {
        /// The revision whose document it is.
        to: u64,
    },
    /// A pre-launch calibration.
    PreLaunch,
    /// A file of the folder as it was when the service started.
    Start {
        /// The file.
        path: String,
    },
}

impl Source {
    /// The file of the watched folder, where it came from one.
    #[must_use]
    pub fn file(&self) -> Option<&str> {
        match self {
            Self::Folder { path } | Self::Start { path } => Some(path),
            Self::Bus | Self::Rollback { .. } | Self::PreLaunch => None,
        }
    }
}

/// The first tick of a revision.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct FirstTick {
    /// Revision counter.
    pub revision: u64,
    /// The producer's series that the tick belongs to.
    pub series: u64,
    /// Sequence number of the tick.
    pub first_sequence: u64,
    /// End of the output with the tick (ns on the producer's clock): of the tick itself, unless several are summed to a navigation step.
    pub first_end_time_ns: i64,
}

/// A calibration that was accepted, yet does not hold.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Withdrawal {
    /// Revision counter.
    pub revision: u64,
    /// Why.
    #[serde(flatten)]
    pub why: Withdrawn,
}

/// Why an accepted calibration does not hold.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(tag = "why", rename_all = "kebab-case")]
pub enum Withdrawn {
    /// Another took its place before its tick came.
    Superseded {
        /// Revision counter of the other.
        by_revision: u64,
    },
    /// It was called off.
    Cancelled,
}

/// A document that was refused.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Refusal {
    /// Where it came from.
    pub source: Source,
    /// SHA-256 of the refused bytes.
    pub digest: Digest,
    /// The first [`MAX_PROBLEMS`] problems, as they were told.
    pub problems: Vec<String>,
    /// How many there were.
    pub count: u64,
    /// Whether all that speaks against it is that another file of the folder names its unit too.
    #[serde(skip_serializing_if = "std::ops::Not::not", default)]
    pub rival: bool,
}

/// A command and what became of it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CommandRecord {
    /// The command in words.
    pub command: String,
    /// Whether it was carried out, or begun.
    pub accepted: bool,
    /// Why it was refused, or what it led to.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub reason: Option<String>,
    /// The unit's state before it.
    pub state_before: String,
    /// The unit's state after it.
    pub state_after: String,
    /// Sequence number of the last tick before it; `None` before the first.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub last_sequence: Option<u64>,
    /// The order itself; `None` for what no operator asked for, and in the files of older versions.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub order: Option<Order>,
}

/// What an operator wants of a unit, by the commands that were carried out: what a restart begins with.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Intent {
    /// The last of standby and run.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub state: Option<Order>,
    /// Where the unit rests, if it does.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub rest: Option<PlaceOrder>,
}

impl Intent {
    /// Takes in a command that was carried out.
    pub fn note(&mut self, record: &CommandRecord) {
        if !record.accepted {
            return;
        }
        // Older versions wrote the words alone.
        let order = record.order.clone().or(match record.command.as_str() {
            "standby" => Some(Order::Standby),
            "run" => Some(Order::Run { reversal: None }),
            "run with mode reversal" => Some(Order::Run { reversal: Some(true) }),
            "run without mode reversal" => Some(Order::Run { reversal: Some(false) }),
            _ => None,
        });
        match order {
            Some(state @ (Order::Standby | Order::Run { .. })) => self.state = Some(state),
            Some(Order::Rest(place)) => self.rest = Some(place),
            Some(Order::EndRest) => self.rest = None,
            // These begin and end in standby, and a change of the calibration changes no state.
            Some(Order::Forget) => *self = Self::default(),
            Some(Order::SelfTest | Order::PreLaunch(_) | Order::Abort | Order::Rollback { .. }) | None => {}
        }
    }

    /// Whether nothing was asked for.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.state.is_none() && self.rest.is_none()
    }

    /// The orders that lead to it.
    pub fn orders(&self) -> impl Iterator<Item = Order> {
        self.state.iter().cloned().chain(self.rest.map(Order::Rest))
    }
}

/// What holds for a unit when a new audit file begins.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CarriedUnit {
    /// Highest revision counter that the unit was ever given.
    pub highest_revision: u64,
    /// Its last good sets, the newest last: at most [`MAX_CARRIED`].
    pub sets: Vec<GoodSet>,
    /// What an operator wants of it.
    #[serde(skip_serializing_if = "Intent::is_empty", default)]
    pub intent: Intent,
}

/// What was last seen in a file of the watched folder.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct CarriedFile {
    /// The file.
    pub path: String,
    /// SHA-256 of its bytes, accepted or refused.
    pub digest: Digest,
    /// Whether that was refused; otherwise it is what the folder says for the unit of the entry.
    #[serde(skip_serializing_if = "std::ops::Not::not", default)]
    pub refused: bool,
}

/// A calibration that was accepted and not withdrawn.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct GoodSet {
    /// Revision counter.
    pub revision: u64,
    /// SHA-256 of the document's bytes.
    pub digest: Digest,
    /// SHA-256 of the overlay laid over it, if any.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub overlay: Option<Digest>,
    /// Where it came from.
    pub source: Source,
    /// When it was accepted.
    pub time: WallTime,
    /// When it takes effect; of interest while it is not in force.
    #[serde(default)]
    pub schedule: Schedule,
    /// Time over which the change is made (ms).
    #[serde(default)]
    pub slew_ms: u64,
    /// Whether a tick has been corrected with it.
    pub in_force: bool,
}

impl GoodSet {
    /// The good set that an acceptance makes.
    #[must_use]
    pub fn new(accepted: &Acceptance, time: WallTime) -> Self {
        Self {
            revision: accepted.revision,
            digest: accepted.digest,
            overlay: accepted.overlay,
            source: accepted.source.clone(),
            time,
            schedule: accepted.schedule,
            slew_ms: accepted.slew_ms,
            in_force: false,
        }
    }

    /// Whether it corrects as another one does: same document, same overlay.
    #[must_use]
    pub fn corrects_as(&self, other: &Self) -> bool {
        (self.digest, self.overlay) == (other.digest, other.overlay)
    }
}

#[cfg(test)]
mod tests;
