//! What a service instance says of itself, on change and once a second.

use serde::{Deserialize, Serialize};

use crate::codec::{Kind, PlainMessage, bounded};
use crate::digest::Digest;
use crate::status::{Fault, MAX_FAULTS, Output, State};
use crate::version::{self, Versions};

/// Most units in the list of a service.
pub const MAX_UNITS: usize = 4096;
/// Most bad documents that are told.
pub const MAX_BAD_DOCUMENTS: usize = 64;

/// One unit of a service.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct UnitSummary {
    /// Serial.
    pub unit: String,
    /// What it is doing.
    pub state: State,
    /// What becomes of its ticks.
    pub output: Output,
}

/// How the folder of calibrations is followed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum FolderState {
    /// The system tells of changes; a slow poll finds what it does not tell.
    Watching,
    /// By the poll alone.
    Polling,
    /// It cannot be read: what is in force stays in force.
    Gone,
}

/// The folder of calibrations.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct FolderStatus {
    /// Its path.
    pub path: String,
    /// How it is followed.
    pub state: FolderState,
    /// Why it is not watched, in words; `None` where it is.
    pub reason: Option<String>,
}

/// A document of the folder that is not taken.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct BadDocument {
    /// Its file.
    pub file: String,
    /// Its first problem in words, with line, column and key.
    pub problem: String,
    /// How many problems it has.
    pub problems: u64,
}

/// The state folder.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct StoreStatus {
    /// Its path.
    pub path: String,
    /// Number of the last entry of the audit file.
    pub audit_entries: u64,
}

/// State of one service instance.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct ServiceStatus {
    /// The instance: its Zenoh id, as in the key.
    pub instance: String,
    /// Version of the service.
    pub version: String,
    /// Process id; `None` where the service is part of another program.
    pub pid: Option<u32>,
    /// Time of its start by its clock (ms since 1970-01-01 UTC).
    pub started_unix_ms: i64,
    /// How long it has been running (s).
    pub uptime_s: f64,
    /// Units that have appeared, in the order of their serials.
    #[serde(deserialize_with = "bounded::<_, _, MAX_UNITS>")]
    pub units: Vec<UnitSummary>,
    /// Folder of calibrations; `None` where none is configured.
    pub calibrations: Option<FolderStatus>,
    /// Documents of that folder that are not taken; the first 64 of them.
    #[serde(deserialize_with = "bounded::<_, _, MAX_BAD_DOCUMENTS>")]
    pub bad_documents: Vec<BadDocument>,
    /// State folder; `None` where nothing survives the service.
    pub store: Option<StoreStatus>,
    /// Faults that belong to no unit.
    #[serde(deserialize_with = "bounded::<_, _, MAX_FAULTS>")]
    pub faults: Vec<Fault>,
    /// SHA-256 of the configuration file's text; `None` without a file.
    pub settings_digest: Option<Digest>,
    /// Calibrations accepted since the start, over all units.
    pub swaps_accepted: u64,
    /// Calibrations refused since the start, over all units.
    pub swaps_refused: u64,
}

impl PlainMessage for ServiceStatus {
    const KIND: Kind = Kind::ServiceStatus;
    const VERSIONS: Versions = version::SERVICE_STATUS;
}
