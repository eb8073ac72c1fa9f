//! The configuration as types: key for key what stands in the file. A key that is left out has its default.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::swap::Severity;

/// The keys of `config/service.toml`, in its order.
#[derive(Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
#[schemars(deny_unknown_fields, title = "Isotherm service configuration")]
pub(super) struct Keys {
    /// Folder of the calibration documents.
    #[schemars(length(min = 1))]
    pub(super) calibrations: Option<String>,
    /// Whether a bad calibration document keeps the service from starting.
    pub(super) strict_start: Option<bool>,
    /// Folder of the audit file and of every accepted document.
    #[schemars(length(min = 1))]
    pub(super) state: Option<String>,
    /// State that a unit starts in.
    pub(super) initial_state: Option<InitialState>,
    /// What is done with the drift estimate.
    pub(super) drift_estimate: Option<DriftEstimate>,
    /// How long a rate reference is waited for.
    #[schemars(range(max = 60_000))]
    pub(super) reference_delay_ms: Option<u32>,
    /// What happens to ticks of units without a calibration.
    pub(super) uncalibrated: Option<UncalibratedKey>,
    /// Most units at a time.
    #[schemars(range(min = 1, max = 16_384))]
    pub(super) max_units: Option<u32>,
    /// How long a gyro tick waits for its accelerometer tick.
    #[schemars(range(min = 1, max = 10_000))]
    pub(super) pairing_window_ms: Option<u32>,
    /// How much later than its time a temperature reading takes effect.
    #[schemars(range(max = 10_000))]
    pub(super) temperature_delay_ms: Option<u32>,
    /// Silence after which what a unit holds back is flushed.
    #[schemars(range(min = 10, max = 60_000))]
    pub(super) tail_flush_ms: Option<u32>,
    /// Interval of the status messages.
    #[schemars(range(min = 100, max = 60_000))]
    pub(super) status_interval_ms: Option<u32>,
    /// How long a stop may take.
    #[schemars(range(min = 100, max = 60_000))]
    pub(super) stop_timeout_ms: Option<u32>,
    /// What happens to corrected batches where a subscriber does not keep up.
    pub(super) congestion: Option<Congestion>,
    /// Units that are taken, by their serials.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(super) units: Vec<String>,
    /// Other instances for the same units.
    pub(super) pair: PairKeys,
    /// How the folder of the documents is watched.
    pub(super) folder: FolderKeys,
    /// What speaks against a swap.
    pub(super) swap: SwapKeys,
    /// Pre-launch calibration, where the command does not say otherwise.
    pub(super) pre_launch: PreLaunchKeys,
    /// Navigation steps.
    pub(super) navigation: NavigationKeys,
    /// Metrics and health over HTTP.
    pub(super) metrics: MetricsKeys,
    /// The console in the browser.
    pub(super) web: WebKeys,
    /// How the Zenoh session is opened.
    pub(super) zenoh: ZenohKeys,
}

#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
#[schemars(inline)]
pub(super) enum InitialState {
    Running,
    Standby,
}

#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
#[schemars(inline)]
pub(super) enum DriftEstimate {
    Publish,
    Subtract,
}

#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
#[schemars(inline)]
pub(super) enum UncalibratedKey {
    PassThrough,
    Hold,
}

#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
#[schemars(inline)]
pub(super) enum Congestion {
    Drop,
    Block,
}

#[derive(Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
#[schemars(deny_unknown_fields)]
pub(super) struct PairKeys {
    /// Name of this instance, for people.
    pub(super) name: Option<String>,
    /// What it does while another one speaks.
    pub(super) mode: Option<ModeKey>,
    /// Of two that speak the one with the lower priority yields.
    pub(super) priority: Option<u8>,
    /// How late the other's output may be.
    #[schemars(range(min = 5, max = 10_000))]
    pub(super) takeover_ms: Option<u32>,
    /// How long this process may stand still before others close their connections to it, and how long a put of its own may block;
    /// left out: Zenoh's.
    #[schemars(range(min = 100, max = 60_000))]
    pub(super) lease_ms: Option<u32>,
}

#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
#[schemars(inline)]
pub(super) enum ModeKey {
    Standby,
    Active,
}

#[derive(Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
#[schemars(deny_unknown_fields)]
pub(super) struct FolderKeys {
    /// How long a file must be unchanged before it is read.
    #[schemars(range(min = 10, max = 60_000))]
    pub(super) settle_ms: Option<u32>,
    /// Interval at which the files are looked at although nothing was heard of them.
    #[schemars(range(min = 0.1, max = 600.0))]
    pub(super) poll_s: Option<f64>,
}

#[derive(Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
#[schemars(deny_unknown_fields)]
pub(super) struct SwapKeys {
    /// Greatest age of a document by its `created`; 0 for no limit.
    #[schemars(range(max = 36_500))]
    pub(super) max_age_days: Option<u32>,
    /// What follows where it is older.
    pub(super) age: Option<Severity>,
    /// What follows where a present temperature lies outside the document's fitted ranges.
    pub(super) outside_range: Option<Severity>,
    /// Greatest jump of the corrected angular rate about an axis of the case; 0 for no limit.
    #[schemars(range(min = 0.0, max = 1e6))]
    pub(super) max_jump_deg_per_h: Option<f64>,
    /// Greatest jump of the corrected specific force along an axis of the case; 0 for no limit.
    #[schemars(range(min = 0.0, max = 1e6))]
    pub(super) max_jump_mg: Option<f64>,
    /// What follows where the jump is greater.
    pub(super) jump: Option<Severity>,
    /// What follows where the document is of an older version.
    pub(super) old_schema: Option<Severity>,
    /// Time over which a swap is made where nothing else is asked for.
    #[schemars(range(max = 3_600_000))]
    pub(super) slew_ms: Option<u32>,
    /// What follows where the document was created before the one in force.
    pub(super) downgrade: Option<Severity>,
    /// Whether a document without a signature of a trusted key is refused.
    pub(super) require_signature: Option<bool>,
    /// Folder of the trusted public keys.
    #[schemars(length(min = 1))]
    pub(super) trusted_keys: Option<String>,
}

#[derive(Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
#[schemars(deny_unknown_fields)]
pub(super) struct PreLaunchKeys {
    /// How long it lasts.
    #[schemars(range(min = 60.0, max = 7200.0))]
    pub(super) duration_s: Option<f64>,
    /// Greatest change of the static bias that is accepted.
    #[schemars(range(min = 1e-6, max = 1e6))]
    pub(super) max_static_change_deg_per_h: Option<f64>,
    /// Greatest change of the magnetic bias that is accepted.
    #[schemars(range(min = 1e-6, max = 1e6))]
    pub(super) max_magnetic_change_deg_per_h: Option<f64>,
    /// Greatest difference of the times in the two modes, as a share of both.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub(super) max_imbalance: Option<f64>,
    /// Shortest time in each mode.
    #[schemars(range(min = 30.0, max = 7200.0))]
    pub(super) min_time_per_mode_s: Option<f64>,
    /// Smallest share of good ticks.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub(super) min_good_share: Option<f64>,
}

#[derive(Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
#[schemars(deny_unknown_fields)]
pub(super) struct NavigationKeys {
    /// Ticks in a navigation step.
    #[schemars(range(min = 1, max = isotherm_correction::navigation::MAX_STEP_TICKS))]
    pub(super) ticks: Option<u16>,
    /// Whether coning and sculling are compensated.
    pub(super) coning_sculling: Option<bool>,
}

#[derive(Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
#[schemars(deny_unknown_fields)]
pub(super) struct MetricsKeys {
    /// Address and port.
    pub(super) listen: Option<String>,
    /// Whether other machines may reach it.
    pub(super) allow_remote: Option<bool>,
}

#[derive(Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
#[schemars(deny_unknown_fields)]
pub(super) struct WebKeys {
    /// Whether the console is served.
    pub(super) enabled: Option<bool>,
    /// Whether it may change anything.
    pub(super) write: Option<bool>,
    /// Further names under which browsers may ask for it.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(super) hosts: Vec<String>,
    /// File of the token.
    #[schemars(length(min = 1))]
    pub(super) token_file: Option<String>,
}

#[derive(Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
#[schemars(deny_unknown_fields)]
pub(super) struct ZenohKeys {
    /// A Zenoh configuration file.
    #[schemars(length(min = 1))]
    pub(super) config: Option<String>,
    /// Endpoints to connect to.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(super) connect: Vec<String>,
    /// Endpoints to listen on.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(super) listen: Vec<String>,
    /// Prefix of every key.
    #[schemars(length(min = 1))]
    pub(super) namespace: Option<String>,
    /// Whether swaps and commands are taken only on keys that end in the name of who asks.
    pub(super) certified_names: Option<bool>,
}
