//! What the parts of a chain are to do.

use std::path::PathBuf;

use isotherm_protocol::key::UnitId;
use serde::{Deserialize, Serialize};

use crate::error::Error;

/// When the source publishes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) enum Pace {
    /// All units at the same moment, one after the other.
    Burst,
    /// As fast as it can be done, for so long at most (ms).
    Saturated {
        /// How long (ms).
        limit_ms: u64,
    },
}

/// What comes out of the middle.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) enum Format {
    /// Raw gyro frames as they were.
    Raw,
    /// Corrected frames.
    Corrected,
    /// What the Python script writes: sequence number, then six increments for each tick.
    Plain,
}

/// A plan of one round, the same for all its parts.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[expect(clippy::struct_excessive_bools, reason = "each is a thing of its own that a part does or not")]
pub(crate) struct Plan {
    /// Units.
    pub(crate) units: usize,
    /// Ticks per second of each unit.
    pub(crate) rate_hz: u32,
    /// Ticks in a message.
    pub(crate) batch: usize,
    /// Messages of each unit, of its gyros and of its accelerometers.
    pub(crate) messages: usize,
    /// The first of these, which go out before the clock runs: units appear with them, and a first tick waits for an earlier one.
    pub(crate) prelude: usize,
    /// When the others go out.
    pub(crate) pace: Pace,
    /// Whether the middle waits for the sink where that is slow.
    pub(crate) block: bool,
    /// Where the middle listens, once it does: two addresses where a standby is beside it.
    pub(crate) connect: Vec<String>,
    /// Where results are left.
    pub(crate) folder: PathBuf,
    /// Ticks of each unit of which the sink keeps everything.
    pub(crate) keep: usize,
    /// What the sink gets.
    pub(crate) format: Format,
    /// Whether the service has a state folder.
    pub(crate) state: bool,
    /// Whether it serves the console in the browser.
    pub(crate) web: bool,
    /// Whether it is one of a pair, and the sink takes each tick from the one that sends it first.
    pub(crate) pair: bool,
    /// Whether the relay declares the keys that it receives, so that Zenoh looks for their subscribers once only.
    pub(crate) declare_keys: bool,
}

impl Plan {
    /// Ticks of each unit.
    pub(crate) fn ticks(&self) -> usize {
        self.messages * self.batch
    }

    /// Duration of a tick (ns).
    pub(crate) fn tick_ns(&self) -> u64 {
        1_000_000_000 / u64::from(self.rate_hz)
    }

    /// Time between two messages of a unit (ns).
    pub(crate) fn period_ns(&self) -> u64 {
        self.tick_ns() * self.batch as u64
    }
}

/// Serial of a unit of the bench, whose number can be read back from a key.
pub(crate) fn unit_name(unit: usize) -> Result<UnitId, Error> {
    UnitId::new(&format!("BENCH-{unit:05}"))
        .map_err(|error| Error::Part { part: "plan", what: format!("unit {unit}: {error}") })
}
