//! What the status of a unit says and only its service knows.

use crate::digest::Digest;
use crate::status::{Fault, InputRates, Latency, Swaps};

/// The service's part of a unit's status.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Edge<'a> {
    /// The service instance: its Zenoh id as text.
    pub instance: &'a str,
    /// Version of the service.
    pub version: &'a str,
    /// Present time (s since 1970-01-01 UTC), from which the age of the calibration follows.
    pub now_unix_s: Option<i64>,
    /// What came in over the last status interval.
    pub input_rates: InputRates,
    /// Latencies.
    pub latency: Latency,
    /// Swaps of this unit.
    pub swaps: Swaps,
    /// SHA-256 of the overlay that the last pre-launch calibration was stored as.
    pub overlay: Option<Digest>,
    /// Faults by kind; what is beyond [`crate::status::MAX_FAULTS`] is left out.
    pub faults: Vec<Fault>,
    /// The last fault of a kind not seen before, in words.
    pub last_fault: Option<String>,
}
