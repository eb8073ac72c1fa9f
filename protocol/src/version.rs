//! Versions of the wire messages: each kind has its own.
//!
//! The version is the second byte of every frame, where a reader sees it before it decodes anything.
//!
//! Policy: a reader accepts every version of a kind from [`Versions::min`] to [`Versions::current`] and refuses others by
//! number. Any change of a body — a field added, removed, moved or given another meaning, a new flag bit excepted — makes
//! a new version of its kind and leaves the other kinds as they are. A version is dropped (by raising `min`) only in a
//! release that says so at the top of its changelog, and not before the release after the one that introduced its
//! successor. Each version from `min` on has frozen bytes in `protocol/tests/versions/`; those files are never edited.

use std::fmt;

/// Versions of one kind of message.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Versions {
    /// Oldest version that is still read.
    pub min: u8,
    /// The version that is written.
    pub current: u8,
}

impl fmt::Display for Versions {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} to {}", self.min, self.current)
    }
}

/// Of the raw gyro batch.
pub const RAW_GYRO: Versions = Versions { min: 1, current: 1 };
/// Of the raw accelerometer batch.
pub const RAW_ACCEL: Versions = Versions { min: 1, current: 1 };
/// Of the raw temperature batch.
pub const RAW_TEMPERATURE: Versions = Versions { min: 1, current: 1 };
/// Of the corrected batch. 2: with standard errors; a batch without them is still written as 1. 3: with the series, and with
/// standard errors or none; a batch of series 0 is still written as 1 or 2.
pub const CORRECTED: Versions = Versions { min: 1, current: 3 };
/// Of the unit's status. 2: states, sensors, swaps, drift, self-test, pre-launch calibration, latencies.
pub const STATUS: Versions = Versions { min: 1, current: 2 };
/// Of the raw health batch.
pub const RAW_HEALTH: Versions = Versions { min: 1, current: 1 };
/// Of the service's status.
pub const SERVICE_STATUS: Versions = Versions { min: 1, current: 1 };
/// Of the rate reference.
pub const REFERENCE: Versions = Versions { min: 1, current: 1 };
/// Of the parts of a journal entry, and of the entry in them.
pub const JOURNAL: Versions = Versions { min: 1, current: 1 };
