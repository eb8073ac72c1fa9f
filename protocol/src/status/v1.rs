//! Version 1 of the status: before units had states of operation. Still read, no longer written by the service.

use isotherm_correction::sample::ChannelName;
use serde::{Deserialize, Serialize};

use super::{ActiveCalibration, Counter, LastTick, Latency, MAX_ENTRIES, Output};
use crate::codec::{Kind, PlainMessage, bounded};
use crate::corrected::Revision;
use crate::version::Versions;

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

impl PlainMessage for Status {
    const KIND: Kind = Kind::Status;
    const VERSIONS: Versions = Versions { min: 1, current: 1 };
}

impl From<Status> for super::Status {
    /// What version 1 does not say is empty; the state is running without mode reversal, as of a unit that nobody has
    /// commanded.
    fn from(old: Status) -> Self {
        let output = match old.state {
            State::Uncalibrated => Output::PassThrough,
            State::Held => Output::Held,
            State::Running => Output::Calibrated,
        };
        let calibration = (old.state == State::Running)
            .then(|| ActiveCalibration { revision: old.revision, ..ActiveCalibration::default() });
        let last_tick = old.last_end_time_ns.zip(old.last_sequence).map(|(end_time_ns, sequence)| LastTick {
            end_time_ns,
            sequence,
            series: 0,
        });
        let channels = old.channels.into_iter().map(|channel| super::ChannelStatus {
            name: channel.channel,
            temperature_deg_c: channel.temperature_deg_c,
            rate_deg_c_per_s: channel.rate_deg_c_per_s,
            stale: channel.stale,
            warming_up: channel.warming_up,
            calibrated_range_deg_c: None,
            place: None,
        });
        Self {
            unit: old.unit,
            version: old.service_version,
            output,
            calibration,
            last_tick,
            channels: channels.collect(),
            counters: old.counters,
            last_fault: old.last_fault,
            latency: Latency {
                p50_ns: old.added_latency_p50_ns,
                p99_ns: old.added_latency_p99_ns,
                ..Latency::default()
            },
            ..Self::default()
        }
    }
}
