//! The service configuration: TOML text in, checked [`Settings`] out, or every problem at once.
//!
//! `config/service.toml` documents every key with its default. Relative paths count from the configuration file.

mod effective;
mod keys;
mod metrics;
mod pair;
mod read;
mod swap;
mod web;

use std::net::{IpAddr, Ipv4Addr, SocketAddr};
use std::path::{Path, PathBuf};
use std::time::Duration;

use isotherm_bus::SessionOptions;
use isotherm_correction::prelaunch::PreLaunchSettings;
use isotherm_correction::unit::UnitSettings;
use isotherm_document::{Problem, Reader};
use isotherm_protocol::digest::Digest;
use zenoh::qos::CongestionControl;

use crate::ServiceError;
use isotherm_document::file::{self, read_bounded};
pub use metrics::MetricsSettings;
pub use pair::{PairSettings, chunk};
pub use swap::{FolderSettings, Severity, SwapSettings};
pub use web::WebSettings;

/// Where the console in the browser is, unless `[metrics]` says otherwise.
const USUAL_LISTENER: SocketAddr = SocketAddr::new(IpAddr::V4(Ipv4Addr::LOCALHOST), 9464);

/// Everything that an operator can set, checked.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// Folder of the calibration documents; without one every unit is uncalibrated.
    pub calibrations: Option<PathBuf>,
    /// Whether a bad calibration document keeps the service from starting.
    pub strict_start: bool,
    /// How that folder is watched.
    pub folder: FolderSettings,
    /// Folder in which the audit file and every accepted document are kept; without one they go with the process.
    pub state: Option<PathBuf>,
    /// What speaks against a swap.
    pub swap: SwapSettings,
    /// Most units at a time (1…16384); further ones are refused.
    pub max_units: usize,
    /// Settings of every unit's state machine.
    pub unit: UnitSettings,
    /// What a pre-launch calibration is asked to do where the command does not say otherwise.
    pub pre_launch: PreLaunchSettings,
    /// How long (10 ms…60 s) a unit's gyro topic must be silent before what it holds back is flushed; at least twice
    /// the pairing window and four times the usual distance of its messages.
    pub tail_flush: Duration,
    /// Interval of the status messages (100 ms…60 s).
    pub status_interval: Duration,
    /// How long a stop may take (100 ms…60 s).
    pub stop_timeout: Duration,
    /// What happens to corrected batches where a subscriber does not keep up.
    pub congestion: CongestionControl,
    /// Serials of the units that are taken, with `*` for any characters; not empty.
    pub units: Vec<String>,
    /// Other instances for the same units.
    pub pair: PairSettings,
    /// Where metrics and health are served.
    pub metrics: MetricsSettings,
    /// The console in the browser, beside the metrics.
    pub web: WebSettings,
    /// How to open the Zenoh session.
    pub session: SessionOptions,
    /// Whether swaps and commands are taken only on keys that end in the name of who asks, which access control vouches for.
    pub certified_names: bool,
    /// SHA-256 of the configuration's text; `None` without one.
    pub digest: Option<Digest>,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            calibrations: None,
            strict_start: false,
            folder: FolderSettings::default(),
            state: None,
            swap: SwapSettings::default(),
            max_units: 64,
            unit: UnitSettings::default(),
            pre_launch: PreLaunchSettings::default(),
            tail_flush: Duration::from_millis(500),
            status_interval: Duration::from_secs(1),
            stop_timeout: Duration::from_secs(3),
            congestion: CongestionControl::Drop,
            units: vec![pair::ALL_UNITS.to_owned()],
            pair: PairSettings::default(),
            metrics: MetricsSettings::default(),
            web: WebSettings::default(),
            session: SessionOptions::default(),
            certified_names: false,
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
        file::text(&bytes, &path.display().to_string())
            .and_then(|text| Self::parse(text, path))
            .map(|settings| Self { digest: Some(Digest::of(&bytes)), ..settings })
            .map_err(ServiceError::Configuration)
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
