//! Raw streams for tests.

use isotherm_bus::{Producer, ProducerOptions};
use isotherm_correction::sample::{AccelTick, ChannelName, GyroTick, OutputKind, TemperatureReading};
use isotherm_correction::units::{Span, Timestamp};
use isotherm_protocol::key::UnitId;
use zenoh::Session;

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

/// Sends the first gyro ticks of a unit, ten in a batch, and nothing else: they all wait for accelerometer ticks.
///
/// # Panics
/// Where they cannot be sent.
pub async fn send_waiting_ticks(session: &Session, unit: &UnitId, count: u64) {
    let options = ProducerOptions { batch_ticks: 10, max_in_flight: None, ..ProducerOptions::default() };
    let mut producer = Producer::declare(session, unit, options).await.expect("a producer");
    for k in 0..count {
        producer.gyro(OutputKind::Mean, gyro(k, &[0.1, 0.2, 0.3])).await.expect("a tick is sent");
    }
    producer.flush().await.expect("the rest is sent");
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
