//! One tick as the corrector saw it: what self-test, pre-launch calibration and drift estimator rest on.

use serde::{Deserialize, Serialize};

use crate::sample::{LasingMode, SensorFlags, Sensors, TickFlags};
use crate::units::{Span, Timestamp};

/// One gyro in one tick.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct GyroSeen {
    /// Raw reading, as it came (counts, or rad/s).
    pub reading: f64,
    /// K(T)·P/Δt along the input axis, before any bias is subtracted (rad/s); the last good rate with the bias put back
    /// where the reading was no number.
    pub rate: f64,
    /// The bias that the calibration states (rad/s): all terms, with the signs of mode and meander; subtracted.
    pub bias: f64,
    /// The estimated drift that was subtracted beside it (rad/s); zero where that is not asked for.
    pub drift: f64,
    /// Smoothed temperature that the gyro follows (°C); the assumed one without a channel.
    pub temperature_deg_c: f64,
    /// Its flags.
    pub flags: SensorFlags,
}

/// One accelerometer in one tick.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct AccelSeen {
    /// Raw reading, as it came.
    pub reading: f64,
    /// Its flags.
    pub flags: SensorFlags,
}

/// One tick after its correction, taken apart again.
///
/// The corrector fills one and the same `Observation` tick after tick; nothing is allocated.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Observation {
    /// Sequence number of the tick.
    pub sequence: u64,
    /// End of the tick on the producer's clock.
    pub end_time: Timestamp,
    /// Measured duration of the tick.
    pub duration: Span,
    /// Raw gyro ticks that are missing before this one.
    pub missed: u64,
    /// Lasing mode of the tick; `None` for an instrument without modes.
    pub mode: Option<LasingMode>,
    /// Whether the readings are those of a settled instrument: not lost in a mode switch, not carrying restored angle,
    /// no perimeter-servo transient, no swap on its way.
    pub settled: bool,
    /// Each gyro.
    pub gyros: Sensors<GyroSeen>,
    /// Each accelerometer; empty without an accelerometer tick.
    pub accels: Sensors<AccelSeen>,
    /// Corrected mean angular rate of the tick in case axes (rad/s).
    pub angular_rate: [f64; 3],
    /// Corrected mean specific force of the tick in case axes (m/s²); `None` without a usable accelerometer tick.
    pub specific_force: Option<[f64; 3]>,
    /// Flags of the tick.
    pub flags: TickFlags,
}
