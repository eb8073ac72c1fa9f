//! What comes in, what goes wrong, and how long it takes.

use serde::{Deserialize, Serialize};

use crate::codec::bounded;

/// Most buckets of a latency histogram.
const MAX_BUCKETS: usize = 1024;

/// A counter; names are those of `docs/wire.md`.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Counter {
    /// Name.
    pub name: String,
    /// Value since the service started.
    pub value: u64,
}

/// What came in over the last status interval, by the service's clock.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct InputRates {
    /// Raw gyro ticks (1/s).
    pub gyro_ticks_per_s: f64,
    /// Raw accelerometer ticks (1/s).
    pub accel_ticks_per_s: f64,
    /// Temperature readings (1/s).
    pub temperature_readings_per_s: f64,
    /// Messages on all raw keys of the unit (1/s).
    pub messages_per_s: f64,
}

/// Faults of one kind since the service started.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Fault {
    /// Kind: the name of its counter.
    pub kind: String,
    /// How many.
    pub count: u64,
    /// The first one in words.
    pub first: String,
    /// Time of the last one by the service's clock (ms since 1970-01-01 UTC).
    pub last_unix_ms: i64,
}

/// One bucket of a histogram.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct LatencyBucket {
    /// Its largest latency (ns); above the one before.
    pub up_to_ns: u64,
    /// Messages in it, those of the buckets before not counted again.
    pub count: u64,
}

/// Latencies since the service started; all zero where there was none.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Latency {
    /// Median (ns).
    pub p50_ns: u64,
    /// 99th percentile (ns).
    pub p99_ns: u64,
    /// 99.9th percentile (ns).
    pub p999_ns: u64,
    /// Largest (ns).
    pub max_ns: u64,
    /// Histogram without its empty buckets, in rising order.
    #[serde(deserialize_with = "bounded::<_, _, MAX_BUCKETS>")]
    pub buckets: Vec<LatencyBucket>,
}
