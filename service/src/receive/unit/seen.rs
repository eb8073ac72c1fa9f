//! The last corrected tick, for those who watch a unit.

use super::UnitActor;

/// The last tick that was corrected, in case axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct TickSeen {
    /// End of the tick (ns on the producer's clock) and its sequence number: what tells it from others.
    pub(crate) place: (i64, u64),
    /// Corrected mean angular rate (rad/s).
    pub(crate) angular_rate_rad_per_s: [f64; 3],
    /// What was subtracted from it (rad/s).
    pub(crate) subtracted_rad_per_s: [f64; 3],
    /// Corrected mean specific force (m/s²); `None` without a usable accelerometer tick.
    pub(crate) specific_force_m_per_s2: Option<[f64; 3]>,
    /// What was subtracted from it (m/s²).
    pub(crate) subtracted_m_per_s2: [f64; 3],
}

impl UnitActor {
    /// The last tick that was corrected; `None` before the first, and without a calibration.
    pub(crate) fn tick_seen(&self) -> Option<TickSeen> {
        let unit = self.stream.unit();
        let (seen, applied) = (unit.observation()?, unit.applied()?);
        Some(TickSeen {
            place: (seen.end_time.as_ns(), seen.sequence),
            angular_rate_rad_per_s: seen.angular_rate,
            subtracted_rad_per_s: applied.angular_rate,
            specific_force_m_per_s2: seen.specific_force,
            subtracted_m_per_s2: applied.specific_force,
        })
    }
}
