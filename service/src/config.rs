//! The service configuration: TOML text in, checked [`Settings`] out, or every problem at once.
//!
//! `config/service.toml` documents every key with its default. Relative paths count from the configuration file.

mod effective;
mod metrics;
mod operation;
mod swap;
mod walk;

use std::path::{Path, PathBuf};
use std::time::Duration;

use isotherm_bus::SessionOptions;
use isotherm_correction::navigation::{MAX_STEP_TICKS, NavigationStep};
use isotherm_correction::prelaunch::PreLaunchSettings;
use isotherm_correction::unit::{Uncalibrated, UnitSettings};
use isotherm_correction::units::Span;
use isotherm_protocol::digest::Digest;
use isotherm_protocol::document::Problem;
use zenoh::qos::CongestionControl;

use crate::ServiceError;
use crate::text::{self, read_bounded};
use walk::{Table, Walk};

pub use metrics::MetricsSettings;
pub use swap::{FolderSettings, Severity, SwapSettings};

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
    /// Where metrics and health are served.
    pub metrics: MetricsSettings,
    /// How to open the Zenoh session.
    pub session: SessionOptions,
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
            metrics: MetricsSettings::default(),
            session: SessionOptions::default(),
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
        text::text(&bytes, &path.display().to_string())
            .and_then(|text| Self::parse(text, path))
            .map(|settings| Self { digest: Some(Digest::of(&bytes)), ..settings })
            .map_err(ServiceError::Configuration)
    }

    /// Reads the text of a configuration; `path` names it in problems, and its folder is where relative paths count from.
    ///
    /// # Errors
    /// Every problem, in the order of the text.
    pub fn parse(text: &str, path: &Path) -> Result<Self, Vec<Problem>> {
        let mut walk = Walk::new(text, path);
        let settings =
            walk.document(text, |walk, root| Self::read(walk, root, path.parent().unwrap_or(Path::new(""))));
        walk.finish(settings)
    }

    /// Walks the document; what is wrong is replaced by the default and reported.
    fn read(walk: &mut Walk<'_>, mut root: Table<'_>, folder: &Path) -> Self {
        let default = Self::default();
        let settings = Self {
            calibrations: read_calibrations(walk, &mut root, folder),
            strict_start: root.boolean(walk, "strict_start").unwrap_or(default.strict_start),
            folder: FolderSettings::read(walk, &mut root),
            state: root.new_path(walk, "state", folder),
            swap: SwapSettings::read(walk, &mut root, folder),
            max_units: root
                .integer(walk, "max_units", 1, 16_384)
                .map_or(default.max_units, |units| units as usize),
            unit: UnitSettings {
                pairing_window: root
                    .integer(walk, "pairing_window_ms", 1, 10_000)
                    .map_or(default.unit.pairing_window, Span::from_ms),
                temperature_delay: root
                    .integer(walk, "temperature_delay_ms", 0, 10_000)
                    .map_or(default.unit.temperature_delay, Span::from_ms),
                uncalibrated: root
                    .choice(
                        walk,
                        "uncalibrated",
                        &[("pass-through", Uncalibrated::PassThrough), ("hold", Uncalibrated::Hold)],
                    )
                    .unwrap_or(default.unit.uncalibrated),
                in_standby: root
                    .choice(walk, "initial_state", &[("running", false), ("standby", true)])
                    .unwrap_or(default.unit.in_standby),
                subtract_drift: root
                    .choice(walk, "drift_estimate", &[("publish", false), ("subtract", true)])
                    .unwrap_or(default.unit.subtract_drift),
                reference_delay: root
                    .integer(walk, "reference_delay_ms", 0, 60_000)
                    .map_or(default.unit.reference_delay, Span::from_ms),
                navigation: read_navigation(walk, &mut root),
            },
            pre_launch: operation::read_pre_launch(walk, &mut root),
            tail_flush: milliseconds(walk, &mut root, "tail_flush_ms", 10, default.tail_flush),
            status_interval: milliseconds(
                walk,
                &mut root,
                "status_interval_ms",
                100,
                default.status_interval,
            ),
            stop_timeout: milliseconds(walk, &mut root, "stop_timeout_ms", 100, default.stop_timeout),
            congestion: root
                .choice(
                    walk,
                    "congestion",
                    &[("drop", CongestionControl::Drop), ("block", CongestionControl::Block)],
                )
                .unwrap_or(default.congestion),
            metrics: MetricsSettings::read(walk, &mut root),
            session: read_session(walk, &mut root, folder),
            digest: None,
        };
        root.finish(walk);
        settings
    }
}

/// Reads the folder of the documents. With a state folder it may be missing: the last good sets hold until it is there.
fn read_calibrations(walk: &mut Walk<'_>, root: &mut Table<'_>, folder: &Path) -> Option<PathBuf> {
    if root.has("state") {
        return root.new_path(walk, "calibrations", folder);
    }
    root.path(walk, "calibrations", folder, Path::is_dir, "an existing folder")
}

/// Reads a duration of at most a minute.
fn milliseconds(
    walk: &mut Walk<'_>,
    table: &mut Table<'_>,
    key: &'static str,
    min: u32,
    default: Duration,
) -> Duration {
    table.integer(walk, key, min, 60_000).map_or(default, |ms| Duration::from_millis(ms.into()))
}

/// Reads `[navigation]`.
fn read_navigation(walk: &mut Walk<'_>, root: &mut Table<'_>) -> NavigationStep {
    let mut table = root.table(walk, "navigation");
    let ticks = table.integer(walk, "ticks", 1, MAX_STEP_TICKS.into()).unwrap_or(1);
    let coning_sculling = table.boolean(walk, "coning_sculling").unwrap_or(false);
    table.finish(walk);
    u16::try_from(ticks)
        .ok()
        .and_then(|ticks| NavigationStep::new(ticks, coning_sculling).ok())
        .unwrap_or_default()
}

/// Reads `[zenoh]` and tries the configuration that it stands for.
fn read_session(walk: &mut Walk<'_>, root: &mut Table<'_>, folder: &Path) -> SessionOptions {
    let mut table = root.table(walk, "zenoh");
    let session = SessionOptions {
        config: table.path(walk, "config", folder, Path::is_file, "an existing file"),
        connect: table.strings(walk, "connect"),
        listen: table.strings(walk, "listen"),
        namespace: table.string(walk, "namespace").map(ToOwned::to_owned),
    };
    if let Err(error) = session.to_config() {
        table.report(walk, &error);
    }
    table.finish(walk);
    session
}

#[cfg(test)]
mod tests;
