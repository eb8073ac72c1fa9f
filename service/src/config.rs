//! The service configuration: TOML text in, checked [`Settings`] out, or every problem at once.
//!
//! `config/service.toml` documents every key with its default. Relative paths count from the configuration file.

mod effective;
mod keys;
mod metrics;
mod pair;
mod read;
mod swap;
mod units;
mod web;

use std::net::{IpAddr, Ipv4Addr, SocketAddr};
use std::path::{Path, PathBuf};
use std::time::Duration;

use isotherm_bus::SessionOptions;
use isotherm_correction::prelaunch::PreLaunchSettings;
use isotherm_correction::unit::UnitSettings;
use isotherm_document::{Problem, Reader};
use isotherm_protocol::digest::Digest;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use zenoh::qos::CongestionControl;

use crate::ServiceError;
use isotherm_document::file::{self, read_bounded};
use keys::{PreLaunchKeys, SessionKeys, UnitKeys};
pub use metrics::MetricsSettings;
pub use pair::{PairSettings, chunk};
pub(crate) use pair::{chunks, includes};
pub use swap::{FolderSettings, Severity, SwapSettings};
use units::{As, Congestion, Ms, PathText};
pub use web::WebSettings;

/// Where the console in the browser is, unless `[metrics]` says otherwise.
const USUAL_LISTENER: SocketAddr = SocketAddr::new(IpAddr::V4(Ipv4Addr::LOCALHOST), 9464);

/// Everything that an operator can set, checked: key for key what stands in `config/service.toml`, in its order. A key that is left out
/// has its default.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
#[schemars(deny_unknown_fields, title = "Isotherm service configuration")]
pub struct Settings {
    /// Folder of the calibration documents; without one every unit is uncalibrated.
    #[serde(with = "As::<PathText>")]
    #[schemars(with = "Option<String>", length(min = 1))]
    pub calibrations: Option<PathBuf>,
    /// Whether a bad calibration document keeps the service from starting.
    pub strict_start: bool,
    /// Folder in which the audit file and every accepted document are kept; without one they go with the process.
    #[serde(with = "As::<PathText>")]
    #[schemars(with = "Option<String>", length(min = 1))]
    pub state: Option<PathBuf>,
    /// Settings of every unit's state machine.
    #[serde(flatten, with = "UnitKeys")]
    #[schemars(with = "UnitKeys")]
    pub unit: UnitSettings,
    /// Most units at a time; further ones are refused.
    #[schemars(with = "u32", range(min = 1, max = 16_384))]
    pub max_units: usize,
    /// How long a unit's gyro topic must be silent before what it holds back is flushed; twice the pairing window or four times the usual
    /// distance of its messages, where that is longer.
    #[serde(rename = "tail_flush_ms", with = "As::<Ms>")]
    #[schemars(with = "u32", range(min = 10, max = 60_000))]
    pub tail_flush: Duration,
    /// Interval of the status messages.
    #[serde(rename = "status_interval_ms", with = "As::<Ms>")]
    #[schemars(with = "u32", range(min = 100, max = 60_000))]
    pub status_interval: Duration,
    /// How long a stop may take.
    #[serde(rename = "stop_timeout_ms", with = "As::<Ms>")]
    #[schemars(with = "u32", range(min = 100, max = 60_000))]
    pub stop_timeout: Duration,
    /// What happens to corrected batches where a subscriber does not keep up.
    #[serde(with = "As::<Congestion>")]
    #[schemars(with = "Congestion")]
    pub congestion: CongestionControl,
    /// Serials of the units that are taken, with `*` for any characters; not empty.
    pub units: Vec<String>,
    /// Other instances for the same units.
    pub pair: PairSettings,
    /// How the folder of the documents is watched.
    pub folder: FolderSettings,
    /// What speaks against a swap.
    pub swap: SwapSettings,
    /// What a pre-launch calibration is asked to do where the command does not say otherwise.
    #[serde(with = "PreLaunchKeys")]
    #[schemars(with = "PreLaunchKeys")]
    pub pre_launch: PreLaunchSettings,
    /// Where metrics and health are served.
    pub metrics: MetricsSettings,
    /// The console in the browser, beside the metrics.
    pub web: WebSettings,
    /// The Zenoh session.
    pub zenoh: ZenohSettings,
    /// SHA-256 of the configuration's text; `None` without one.
    #[serde(skip)]
    pub digest: Option<Digest>,
}

/// The Zenoh session.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
#[schemars(deny_unknown_fields)]
pub struct ZenohSettings {
    /// How to open it.
    #[serde(flatten, with = "SessionKeys")]
    #[schemars(with = "SessionKeys")]
    pub session: SessionOptions,
    /// Whether swaps and commands are taken only on keys that end in the name of who asks, which access control vouches for.
    pub certified_names: bool,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            calibrations: None,
            strict_start: false,
            state: None,
            unit: UnitSettings::default(),
            max_units: 64,
            tail_flush: Duration::from_millis(500),
            status_interval: Duration::from_secs(1),
            stop_timeout: Duration::from_secs(3),
            congestion: CongestionControl::Drop,
            units: vec![pair::ALL_UNITS.to_owned()],
            pair: PairSettings::default(),
            folder: FolderSettings::default(),
            swap: SwapSettings::default(),
            pre_launch: PreLaunchSettings::default(),
            metrics: MetricsSettings::default(),
            web: WebSettings::default(),
            zenoh: ZenohSettings::default(),
            digest: None,
        }
    }
}

impl Settings {
    /// Reads a configuration file.
    ///
    /// # Errors
    /// [`ServiceError::Read`], or [`ServiceError::Configuration`] with every problem.
    pub fn load(path: &Path) -> Result<Self, ServiceError> {
        let read = |source| ServiceError::Read { path: path.to_owned(), source };
        let bytes = read_bounded(path).map_err(read)?;
        file::text(&bytes, Some(&path.display().to_string()))
            .and_then(|text| Self::parse(text, path))
            .map(|settings| Self { digest: Some(Digest::of(&bytes)), ..settings })
            .map_err(ServiceError::Configuration)
    }

    /// The configuration of a file, else the default, with what the command line puts in its place.
    ///
    /// # Errors
    /// As [`Settings::load`].
    pub fn given(
        config: Option<&Path>,
        calibrations: Option<&PathBuf>,
        state: Option<&PathBuf>,
        metrics: Option<SocketAddr>,
    ) -> Result<Self, ServiceError> {
        let mut settings = config.map_or_else(|| Ok(Self::default()), Self::load)?;
        settings.calibrations = calibrations.cloned().or(settings.calibrations);
        settings.state = state.cloned().or(settings.state);
        settings.metrics.listen = metrics.or(settings.metrics.listen);
        Ok(settings)
    }

    /// Whether this one leaves the connection to the other instance to that, as `pair.other` says.
    ///
    /// # Errors
    /// What is wrong with the address.
    pub(crate) fn check_other(&self) -> Result<(), String> {
        let Some(other) = &self.pair.other else { return Ok(()) };
        // Addresses that cannot be read are reported elsewhere.
        if self.zenoh.session.listens_on().unwrap_or_default().contains(other) {
            return Err(format!(
                "is {other:?}, where this instance listens: give the address of the other one"
            ));
        }
        if self.zenoh.session.connects_to().unwrap_or_default().contains(other) {
            return Err(format!(
                "is {other:?}, which this instance connects to: only one of the two may connect"
            ));
        }
        Ok(())
    }

    /// Where the console in the browser is served and no address is given, the usual one on loopback.
    pub(crate) fn listen_for_web(&mut self) {
        if self.web.enabled {
            self.metrics.listen.get_or_insert(USUAL_LISTENER);
        }
    }

    /// Reads the text of a configuration; `path` names it in problems, and its folder is where relative paths count from.
    ///
    /// # Errors
    /// Every problem, in the order of the text.
    pub fn parse(text: &str, path: &Path) -> Result<Self, Vec<Problem>> {
        let file = path.display().to_string();
        let mut reader = Reader::new(text, Some(&file));
        let settings = read::settings(&mut reader, path.parent().unwrap_or(Path::new("")));
        reader.finish(settings)
    }
}

#[cfg(test)]
mod tests;
