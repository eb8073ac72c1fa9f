//! One tick as the corrector saw it: what self-test, pre-launch calibration and drift estimator rest on.

use serde::{Deserialize, Serialize};

use crate::sample::{LasingMode, SensorFlags, Sensors, TickFlags};
use crate::units::{Span, Timestamp};

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
    /// Raw reading of each gyro, as it came (counts, or rad/s).
    pub gyro_readings: Sensors<f64>,
    /// K(T)·P/Δt of each gyro along its own input axis, before any bias is subtracted (rad/s); the last good rate
    /// with the bias put back where the reading was no number.
    pub gyro_rates: Sensors<f64>,
    /// The bias that the calibration states for it (rad/s): all terms, with the signs of mode and meander; subtracted.
    pub gyro_biases: Sensors<f64>,
    /// The estimated drift that was subtracted beside it (rad/s); zero where that is not asked for.
    pub gyro_drifts: Sensors<f64>,
    /// Smoothed temperature that each gyro follows (°C); the assumed one without a channel.
    pub gyro_temperatures_deg_c: Sensors<f64>,
    /// Flags of each gyro.
    pub gyro_flags: Sensors<SensorFlags>,
    /// Raw reading of each accelerometer, as it came; empty without an accelerometer tick.
    pub accel_readings: Sensors<f64>,
    /// Flags of each accelerometer; empty without an accelerometer tick.
    pub accel_flags: Sensors<SensorFlags>,
    /// Corrected mean angular rate of the tick in case axes (rad/s).
    pub angular_rate: [f64; 3],
    /// Corrected mean specific force of the tick in case axes (m/s²); `None` without a usable accelerometer tick.
    pub specific_force: Option<[f64; 3]>,
    /// Flags of the tick.
    pub flags: TickFlags,
}
