//! What can go wrong between a program and Zenoh.

use std::path::PathBuf;
use std::time::Duration;

use isotherm_protocol::codec::CodecError;
use isotherm_protocol::key::UnitId;
use thiserror::Error;

/// Why something on the bus did not work.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum BusError {
    /// The Zenoh configuration file cannot be read or is not valid.
    #[error("cannot use the Zenoh configuration {path}: {source}", path = path.display())]
    Configuration {
        /// The file.
        path: PathBuf,
        /// What Zenoh says.
        source: zenoh::Error,
    },
    /// An option is not valid, e.g. an endpoint that is none.
    #[error("{option} = {value} is not valid: {source}")]
    Option {
        /// Name of the option.
        option: &'static str,
        /// Its value, as JSON.
        value: String,
        /// What Zenoh says.
        source: zenoh::Error,
    },
    /// The session cannot be opened.
    #[error("cannot open the Zenoh session: {0}")]
    Open(#[source] zenoh::Error),
    /// A publisher, subscriber or querier cannot be declared.
    #[error("cannot declare {key}: {source}")]
    Declare {
        /// The key.
        key: String,
        /// What Zenoh says.
        source: zenoh::Error,
    },
    /// A message cannot be handed to Zenoh.
    #[error("cannot publish on {key}: {source}")]
    Put {
        /// The key.
        key: String,
        /// What Zenoh says.
        source: zenoh::Error,
    },
    /// A message cannot be encoded.
    #[error("cannot encode a message for {key}: {source}")]
    Encode {
        /// The key.
        key: String,
        /// What the codec says.
        source: CodecError,
    },
    /// A reading that is announced as a count is no whole number of 32 bits.
    #[error(
        "unit {unit}: a reading in the ticks from sequence {sequence} on is announced as a count but is no whole number of 32 bits"
    )]
    NotCounts {
        /// Serial of the unit.
        unit: UnitId,
        /// First sequence number of the batch.
        sequence: u64,
    },
    /// An option of the producer is outside its range.
    #[error("{option} is {got}, must be {min} to {max}")]
    Range {
        /// Name of the option.
        option: &'static str,
        /// Its value.
        got: u64,
        /// Smallest value allowed.
        min: u64,
        /// Largest value allowed.
        max: u64,
    },
    /// Nobody subscribed to a raw topic in time.
    #[error(
        "nobody subscribes to {key} after {waited:?}: is the service running, and connected to this session?"
    )]
    NoSubscriber {
        /// The key.
        key: String,
        /// How long was waited.
        waited: Duration,
    },
    /// The service did not answer in time.
    #[error("no service answers on {key} after {waited:?}: is it running, and connected to this session?")]
    NoService {
        /// The key.
        key: String,
        /// How long was waited.
        waited: Duration,
    },
    /// Nothing comes back on the corrected topic.
    #[error(
        "unit {unit}: nothing came back on {key} for {waited:?} while {in_flight} ticks were under way; the service may hold \
         the unit back (uncalibrated = \"hold\"), may have stopped, or may refuse the unit's messages: see its log and the unit's status"
    )]
    NoAcknowledgement {
        /// Serial of the unit.
        unit: UnitId,
        /// The key.
        key: String,
        /// How long nothing came.
        waited: Duration,
        /// Ticks sent and not come back.
        in_flight: u64,
    },
    /// The session did not close in time; it is left to itself.
    #[error("the Zenoh session did not close within {0:?}")]
    CloseTimeout(Duration),
    /// The session did not close in order.
    #[error("cannot close the Zenoh session: {0}")]
    Close(#[source] zenoh::Error),
}
