//! What a unit says of itself, on change and once a second.
//!
//! The same types are what `isotherm status --json` prints: in JSON, enums are words and digests hexadecimal digits; a
//! number that is not finite is `null`.

mod calibration;
mod channel;
mod drift;
mod pre_launch;
mod self_test;
mod sensor;
mod traffic;
pub mod v1;

use serde::{Deserialize, Serialize};

pub use calibration::{ActiveCalibration, AppliedCorrection, PendingChange, Swaps};
pub use channel::{ChannelStatus, Place};
pub use drift::{DriftStatus, Rest};
pub use isotherm_correction::operation::State;
pub use pre_launch::{
    ConstantsChange, PreLaunchGyro, PreLaunchMode, PreLaunchOutcome, PreLaunchProgress, PreLaunchVerdict,
};
pub use self_test::{SelfTestItem, SelfTestReport};
pub use sensor::{SensorKind, SensorStatus};
pub use traffic::{Counter, Fault, InputRates, Latency, LatencyBucket};

use crate::codec::{CodecError, Kind, PlainMessage, bounded, whole};
use crate::corrected::Revision;
use crate::version::{self, Versions};

/// Most entries of a list in a status, where nothing else is said.
pub(crate) const MAX_ENTRIES: usize = 256;
/// Most kinds of fault in a status.
pub const MAX_FAULTS: usize = 32;
/// Kind of the fault that temperatures come of channels which the calibration does not have.
pub const UNKNOWN_CHANNEL: &str = "unknown_temperature_channel";
/// Most sensors of both kinds together.
const MAX_ALL_SENSORS: usize = 2 * isotherm_correction::sample::MAX_SENSORS;

/// What becomes of ticks in a running state.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Output {
    /// They are corrected.
    Calibrated,
    /// No calibration: raw readings are passed through, flagged.
    #[default]
    PassThrough,
    /// No calibration: nothing is published, as configured.
    Held,
}

/// The last tick that was published.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct LastTick {
    /// Its end (ns on the producer's clock).
    pub end_time_ns: i64,
    /// Its sequence number.
    pub sequence: u64,
    /// The producer's run that it belongs to.
    pub series: u64,
}

/// State of one unit.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Status {
    /// Serial of the unit.
    pub unit: String,
    /// The service instance: its Zenoh id, as in the key of its own status.
    pub instance: String,
    /// Version of the service.
    pub version: String,
    /// What the unit is doing.
    pub state: State,
    /// What becomes of its ticks.
    pub output: Output,
    /// Calibration in force; `None` without one.
    pub calibration: Option<ActiveCalibration>,
    /// Change of calibration that waits for its tick.
    pub pending: Option<PendingChange>,
    /// Swaps of this unit since the service started.
    pub swaps: Swaps,
    /// The last tick that was published.
    pub last_tick: Option<LastTick>,
    /// Temperature channels of the calibration in force.
    #[serde(deserialize_with = "bounded::<_, _, MAX_ENTRIES>")]
    pub channels: Vec<ChannelStatus>,
    /// Gyros, then accelerometers, of the calibration in force.
    #[serde(deserialize_with = "bounded::<_, _, MAX_ALL_SENSORS>")]
    pub sensors: Vec<SensorStatus>,
    /// What came in over the last status interval.
    pub input_rates: InputRates,
    /// Correction that is subtracted at present; `None` before the first corrected tick.
    pub applied: Option<AppliedCorrection>,
    /// Estimates of the drift estimator, one per gyro that has one.
    #[serde(deserialize_with = "bounded::<_, _, MAX_ALL_SENSORS>")]
    pub drift: Vec<DriftStatus>,
    /// The rest that the operator has declared; `None` where none was, or it was ended.
    pub rest: Option<Rest>,
    /// Report of the last self-test.
    pub self_test: Option<SelfTestReport>,
    /// Progress of the pre-launch calibration that is running.
    pub pre_launch: Option<PreLaunchProgress>,
    /// Outcome of the last pre-launch calibration.
    pub pre_launch_outcome: Option<PreLaunchOutcome>,
    /// Counters.
    #[serde(deserialize_with = "bounded::<_, _, MAX_ENTRIES>")]
    pub counters: Vec<Counter>,
    /// Faults by kind.
    #[serde(deserialize_with = "bounded::<_, _, MAX_FAULTS>")]
    pub faults: Vec<Fault>,
    /// The last fault of a kind not seen before, in words.
    pub last_fault: Option<String>,
    /// Time that the service added, from a raw message's arrival to the return of the put it caused.
    pub latency: Latency,
}

impl PlainMessage for Status {
    const KIND: Kind = Kind::Status;
    const VERSIONS: Versions = version::STATUS;

    fn read(version: u8, body: &[u8]) -> Result<Self, CodecError> {
        match version {
            1 => whole::<v1::Status>(body).map(Into::into),
            _ => whole(body),
        }
    }
}

impl Status {
    /// The calibration in force, as corrected batches name it; counter 0 without one.
    #[must_use]
    pub fn revision(&self) -> Revision {
        self.calibration.as_ref().map(|calibration| calibration.revision).unwrap_or_default()
    }

    /// A counter by its name; 0 where it is not listed.
    #[must_use]
    pub fn counter(&self, name: &str) -> u64 {
        self.counters.iter().find(|counter| counter.name == name).map_or(0, |counter| counter.value)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn states_have_the_names_that_they_have_everywhere() {
        for state in State::ALL {
            assert_eq!(serde_json::to_value(state).unwrap(), state.name());
        }
    }
}
