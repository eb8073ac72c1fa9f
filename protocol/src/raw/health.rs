//! What a producer reports of its instrument: voltages and counters, for the self-test (models §7).

use isotherm_correction::operation;
use isotherm_correction::sample::ChannelName;
use isotherm_correction::units::Timestamp;
use serde::{Deserialize, Serialize};

use crate::codec::{CodecError, Kind, MAX_TICKS, PlainMessage, bounded};
use crate::version::{self, Versions};

/// Most readings at one time.
pub const MAX_HEALTH: usize = 64;

/// A voltage or a counter.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct HealthReading {
    /// Name, as the calibration document's `[self_test]` spells it (at most 24 bytes).
    pub name: ChannelName,
    /// Voltage (V), or the counter's present value; NaN where there is none.
    pub value: f64,
}

/// Readings at one time.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct HealthTick {
    /// Time of the readings (ns on the producer's clock).
    pub time_ns: i64,
    /// 0…64 readings.
    #[serde(deserialize_with = "bounded::<_, _, MAX_HEALTH>")]
    pub readings: Vec<HealthReading>,
}

/// What a producer reports of one unit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct HealthBatch {
    /// 1…4096 ticks, oldest first.
    #[serde(deserialize_with = "bounded::<_, _, MAX_TICKS>")]
    pub ticks: Vec<HealthTick>,
}

impl PlainMessage for HealthBatch {
    const KIND: Kind = Kind::RawHealth;
    const VERSIONS: Versions = version::RAW_HEALTH;

    fn check(&self) -> Result<(), CodecError> {
        let count = self.ticks.len();
        if !(1..=MAX_TICKS).contains(&count) {
            return Err(CodecError::Ticks { count });
        }
        if self.ticks.iter().any(|tick| tick.readings.len() > MAX_HEALTH) {
            return Err(CodecError::Value { field: "readings", must_be: "0 to 64 per tick" });
        }
        Ok(())
    }
}

impl HealthBatch {
    /// The readings as the core takes them, in the order of the batch.
    pub fn to_core(&self) -> impl Iterator<Item = operation::HealthReading> {
        self.ticks.iter().flat_map(|tick| {
            tick.readings.iter().map(|reading| operation::HealthReading {
                name: reading.name,
                time: Timestamp::from_ns(tick.time_ns),
                value: reading.value,
            })
        })
    }
}
