//! What a unit says of itself, on change and once a second.

use isotherm_correction::sample::ChannelName;
use serde::{Deserialize, Serialize};

use crate::codec::{Kind, Message, bounded};
use crate::corrected::Revision;

/// Most entries of a list in a status.
const MAX_ENTRIES: usize = 256;

/// What the unit is doing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum State {
    /// No calibration: raw readings are passed through, flagged.
    Uncalibrated,
    /// No calibration: nothing is published, as configured.
    Held,
    /// Corrected increments are published.
    Running,
}

/// A temperature channel.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ChannelStatus {
    /// Name.
    pub channel: ChannelName,
    /// Smoothed temperature (°C); `None` before the first reading.
    pub temperature_deg_c: Option<f64>,
    /// Its rate (°C/s); `None` before the first reading.
    pub rate_deg_c_per_s: Option<f64>,
    /// Missing, rejected or older than its limit.
    pub stale: bool,
    /// Derivatives do not rest on readings alone yet.
    pub warming_up: bool,
}

/// A counter; names are those of `docs/wire.md`.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Counter {
    /// Name.
    pub name: String,
    /// Value since the service started.
    pub value: u64,
}

/// State of one unit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Status {
    /// Serial of the unit.
    pub unit: String,
    /// Version of the service.
    pub service_version: String,
    /// What the unit is doing.
    pub state: State,
    /// Active calibration; counter 0 while there is none.
    pub revision: Revision,
    /// End of the last tick that was published (ns on the producer's clock).
    pub last_end_time_ns: Option<i64>,
    /// Its sequence number.
    pub last_sequence: Option<u64>,
    /// Temperature channels of the active calibration.
    #[serde(deserialize_with = "bounded::<_, _, MAX_ENTRIES>")]
    pub channels: Vec<ChannelStatus>,
    /// Counters.
    #[serde(deserialize_with = "bounded::<_, _, MAX_ENTRIES>")]
    pub counters: Vec<Counter>,
    /// The last fault in words, e.g. why a calibration document was refused.
    pub last_fault: Option<String>,
    /// Time that the service added, from a raw message's arrival to the return of the put it caused: median (ns).
    pub added_latency_p50_ns: u64,
    /// The same, 99th percentile (ns).
    pub added_latency_p99_ns: u64,
}

impl Message for Status {
    const KIND: Kind = Kind::Status;
}
