//! Raw streams for tests.

use isotherm_correction::sample::{AccelTick, ChannelName, GyroTick, TemperatureReading};
use isotherm_correction::units::{Span, Timestamp};

/// Duration of a tick in these streams (5 ms).
pub const TICK: Span = Span::from_ns(5_000_000);
/// End of tick 0.
pub const START: Timestamp = Timestamp::from_ns(1_000_000_000_000);

/// End of tick `k`.
#[must_use]
pub fn end_of(k: u64) -> Timestamp {
    START + Span::from_ns(TICK.as_ns() * i64::try_from(k).unwrap_or(i64::MAX / TICK.as_ns()))
}

/// Gyro tick `k` with mean rates (rad/s).
#[must_use]
pub fn gyro(k: u64, rates: &[f64]) -> GyroTick {
    GyroTick {
        sequence: k,
        end_time: end_of(k),
        duration: TICK,
        readings: rates.iter().copied().collect(),
        ..GyroTick::default()
    }
}

/// Accelerometer tick `k` with mean outputs.
#[must_use]
pub fn accel(k: u64, outputs: &[f64]) -> AccelTick {
    AccelTick {
        sequence: k,
        end_time: end_of(k),
        duration: TICK,
        readings: outputs.iter().copied().collect(),
    }
}

/// A reading of channel "t" at the end of tick `k`.
#[must_use]
pub fn temperature(k: u64, raw: f64) -> TemperatureReading {
    TemperatureReading { channel: ChannelName::from("t").unwrap_or_default(), time: end_of(k), raw }
}
