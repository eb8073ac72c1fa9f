//! The servo's exponential through several ticks.

use serde::{Deserialize, Serialize};

/// The exponential A·d through the excesses of all ticks measured since a switch, by least squares: A = Σ e·d/Σ d².
///
/// Each tick takes what brings all that was taken since the switch to A·Σ gain·d under the present A. So the angle over the
/// transient is that of the best amplitude, not of the sum of all that it once was.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub(super) struct Decay {
    /// Σ e·d (Hz).
    projection_hz: f64,
    /// Σ d².
    norm: f64,
    /// Σ gain·d over the ticks that took something (s).
    reach_s: f64,
    /// What they took together.
    taken: f64,
}

impl Decay {
    /// Excess of this tick (Hz), and what it is to take of the transient, in units of `gain` times Hz; `None` where nothing was
    /// measured yet, or no number comes out.
    pub(super) fn take(&mut self, decay: f64, measured_hz: Option<f64>, gain: f64) -> Option<(f64, f64)> {
        let mut next = *self;
        if let Some(hz) = measured_hz {
            next.projection_hz += hz * decay;
            next.norm += decay * decay;
        }
        next.reach_s += gain * decay;
        let amplitude_hz = next.projection_hz / next.norm;
        next.taken = amplitude_hz * next.reach_s;
        let taken = next.taken - self.taken;
        if !(taken.is_finite() && next.norm.is_finite()) {
            return None;
        }
        *self = next;
        Some((amplitude_hz * decay, taken))
    }
}
