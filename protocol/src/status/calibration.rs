//! The calibration in force, the one that waits, and what the correction comes to.

use serde::{Deserialize, Serialize};

use crate::control::Schedule;
use crate::corrected::Revision;
use crate::digest::Digest;

/// Calibration in force.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct ActiveCalibration {
    /// Its revision, as corrected batches name it.
    pub revision: Revision,
    /// SHA-256 of the document's text; `None` where only the head that stands in the revision is known.
    pub digest: Option<Digest>,
    /// When the document was made (s since 1970-01-01 UTC); `None` where it does not say.
    pub created_unix_s: Option<i64>,
    /// How long ago that was by the service's clock (s); negative where it lies ahead.
    pub age_s: Option<i64>,
    /// Where it came from, in words, such as "folder zlg-0001.toml" or "bus, by ann".
    pub source: String,
    /// SHA-256 of the overlay that was applied to the base document; `None` without one.
    pub overlay: Option<Digest>,
}

/// A change of calibration that waits for its tick.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct PendingChange {
    /// The revision to come.
    pub revision: Revision,
    /// SHA-256 of its document's text; `None` where only the head is known.
    pub digest: Option<Digest>,
    /// Where it came from, in words.
    pub source: String,
    /// When it takes effect.
    pub schedule: Schedule,
    /// Time over which the change is made (s).
    pub slew_s: f64,
}

/// Swaps since the service started, whichever way they came in.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Swaps {
    /// Calibrations accepted.
    pub accepted: u64,
    /// Calibrations refused; nothing changed.
    pub refused: u64,
    /// The last refusal in words; `None` where there was none.
    pub last_refusal: Option<String>,
}

/// Correction that is subtracted at present, in case axes.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct AppliedCorrection {
    /// About x, y, z (rad/s).
    pub angular_rate_rad_per_s: [f64; 3],
    /// Along x, y, z (m/s²).
    pub specific_force_m_per_s2: [f64; 3],
}
