//! A calibration that is to take effect: at once, at a stated tick, or at a stated time.

use alloc::sync::Arc;

use serde::{Deserialize, Serialize};

use crate::calibration::Calibration;
use crate::sample::GyroTick;
use crate::units::Span;

/// When a change takes effect; always before a tick, and at the latest when the producer restarts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum At {
    /// The next tick that is corrected.
    #[default]
    NextTick,
    /// The first tick with this sequence number or a later one.
    Sequence(u64),
    /// The first tick that ends at this time or later (ns on the producer's clock).
    TimeNs(i64),
}

impl At {
    /// Whether a tick is at or behind the point.
    pub(super) fn is_due(self, tick: &GyroTick) -> bool {
        match self {
            Self::NextTick => true,
            Self::Sequence(sequence) => tick.sequence >= sequence,
            Self::TimeNs(time_ns) => tick.end_time.as_ns() >= time_ns,
        }
    }
}

/// A change of calibration.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Change {
    /// The calibration.
    #[serde(with = "crate::written::shared")]
    pub calibration: Arc<Calibration>,
    /// Revision counter that its ticks carry.
    pub revision: u64,
    /// When it takes effect.
    pub at: At,
    /// Time over which the correction moves from the old terms to the new; zero: at once. Between sets of another number or
    /// kind of sensors there is no way, and the change is made at once.
    pub slew: Span,
}
