//! One tick as the corrector saw it, in the lanes that it was corrected in: what self-test, pre-launch calibration and drift
//! estimator rest on.

use serde::{Deserialize, Serialize};

use crate::lanes::{Lanes, put};
use crate::sample::{LasingMode, MAX_SENSORS, SensorFlags, TickFlags};
use crate::units::{Span, Timestamp};

/// Flags of the sensors in a tick with nothing to say of any.
pub(crate) const SOUND: [SensorFlags; MAX_SENSORS] = [SensorFlags::VALID; MAX_SENSORS];

/// One gyro in one tick.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
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

/// All gyros in one tick: the fields of [`GyroSeen`], a lane for each gyro.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct GyroLanes {
    /// Number of gyros.
    pub count: usize,
    /// Raw readings.
    pub reading: Lanes,
    /// K(T)·P/Δt (rad/s).
    pub rate: Lanes,
    /// Bias (rad/s).
    pub bias: Lanes,
    /// Drift (rad/s).
    pub drift: Lanes,
    /// Temperature (°C).
    pub temperature_deg_c: Lanes,
    /// Flags.
    pub flags: [SensorFlags; MAX_SENSORS],
}

impl GyroLanes {
    /// Notes readings, rates with the bias still in them, and biases of a tick.
    #[inline(always)]
    #[expect(clippy::inline_always, reason = "once per tick: lanes that stay in registers")]
    pub(crate) fn note<const N: usize>(
        &mut self,
        [readings, rates, biases]: [[f64; N]; 3],
        count: usize,
        flags: [SensorFlags; MAX_SENSORS],
    ) {
        self.count = count;
        put(&mut self.reading, readings);
        put(&mut self.rate, rates);
        put(&mut self.bias, biases);
        self.flags = flags;
    }

    /// Gyro by gyro.
    pub fn iter(&self) -> impl Iterator<Item = GyroSeen> + '_ {
        (0..self.count).map_while(|lane| self.get(lane))
    }

    /// One gyro.
    #[must_use]
    pub fn get(&self, lane: usize) -> Option<GyroSeen> {
        (lane < self.count.min(MAX_SENSORS)).then(|| GyroSeen {
            reading: self.reading[lane],
            rate: self.rate[lane],
            bias: self.bias[lane],
            drift: self.drift[lane],
            temperature_deg_c: self.temperature_deg_c[lane],
            flags: self.flags[lane],
        })
    }
}

impl FromIterator<GyroSeen> for GyroLanes {
    fn from_iter<I: IntoIterator<Item = GyroSeen>>(gyros: I) -> Self {
        let mut lanes = Self::default();
        for (lane, gyro) in gyros.into_iter().take(MAX_SENSORS).enumerate() {
            lanes.count = lane + 1;
            lanes.reading[lane] = gyro.reading;
            lanes.rate[lane] = gyro.rate;
            lanes.bias[lane] = gyro.bias;
            lanes.drift[lane] = gyro.drift;
            lanes.temperature_deg_c[lane] = gyro.temperature_deg_c;
            lanes.flags[lane] = gyro.flags;
        }
        lanes
    }
}

/// All accelerometers in one tick.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct AccelLanes {
    /// Number of accelerometers; 0 without an accelerometer tick.
    pub count: usize,
    /// Raw readings, as they came.
    pub reading: Lanes,
    /// Flags.
    pub flags: [SensorFlags; MAX_SENSORS],
}

impl AccelLanes {
    /// Reading and flags, accelerometer by accelerometer.
    pub fn iter(&self) -> impl Iterator<Item = (f64, SensorFlags)> + '_ {
        self.reading.iter().copied().zip(self.flags).take(self.count)
    }
}

/// One tick after its correction, taken apart again.
///
/// The corrector works in one and the same `Observation` tick after tick; nothing is allocated.
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
    /// Each gyro; none before the first tick.
    pub gyros: GyroLanes,
    /// Each accelerometer; none without an accelerometer tick.
    pub accels: AccelLanes,
    /// Corrected mean angular rate of the tick in case axes (rad/s).
    pub angular_rate: [f64; 3],
    /// Corrected mean specific force of the tick in case axes (m/s²); `None` without a usable accelerometer tick.
    pub specific_force: Option<[f64; 3]>,
    /// Flags of the tick.
    pub flags: TickFlags,
}
