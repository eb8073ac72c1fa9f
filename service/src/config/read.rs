//! From the keys of the configuration to the settings that they stand for.

use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::sync::LazyLock;
use std::time::Duration;

use isotherm_bus::SessionOptions;
use isotherm_correction::navigation::NavigationStep;
use isotherm_correction::prelaunch::{PreLaunchLimits, PreLaunchSettings};
use isotherm_correction::unit::{Uncalibrated, UnitSettings};
use isotherm_correction::units::{AngularRate, Span, SpecificForce};
use isotherm_document::{Form, Reader, element};
use isotherm_protocol::pair::{Mode, is_name};
use zenoh::qos::CongestionControl;

use super::keys::{
    Congestion, DriftEstimate, FolderKeys, InitialState, Keys, MetricsKeys, ModeKey, NavigationKeys,
    PairKeys, PreLaunchKeys, SwapKeys, UncalibratedKey, WebKeys, ZenohKeys,
};
use super::pair::{ALL_UNITS, PairSettings, chunk};
use super::swap::{DAY_S, Severity};
use super::{FolderSettings, MetricsSettings, Settings, SwapSettings, WebSettings};

static FORM: LazyLock<Form> = LazyLock::new(Form::of::<Keys>);

/// Reads a configuration; `None` where its text makes no sense. Relative paths count from `folder`.
pub(super) fn settings(r: &mut Reader<'_>, folder: &Path) -> Option<Settings> {
    let keys: Keys = r.read(&FORM)?;
    let default = Settings::default();
    let state = keys.state.map(|path| folder.join(path));
    let mut settings = Settings {
        // With a state folder the folder of the documents may be missing: the last good sets hold until it is there.
        calibrations: match &state {
            Some(_) => keys.calibrations.map(|path| folder.join(path)),
            None => existing(r, "calibrations", keys.calibrations, folder, Path::is_dir, "folder"),
        },
        strict_start: keys.strict_start.unwrap_or(default.strict_start),
        folder: watched(&keys.folder),
        state,
        swap: swap(r, keys.swap, folder),
        max_units: keys.max_units.map_or(default.max_units, |units| units as usize),
        unit: UnitSettings {
            pairing_window: keys.pairing_window_ms.map_or(default.unit.pairing_window, Span::from_ms),
            temperature_delay: keys
                .temperature_delay_ms
                .map_or(default.unit.temperature_delay, Span::from_ms),
            uncalibrated: keys.uncalibrated.map_or(default.unit.uncalibrated, |key| match key {
                UncalibratedKey::PassThrough => Uncalibrated::PassThrough,
                UncalibratedKey::Hold => Uncalibrated::Hold,
            }),
            in_standby: keys
                .initial_state
                .map_or(default.unit.in_standby, |state| state == InitialState::Standby),
            subtract_drift: keys
                .drift_estimate
                .map_or(default.unit.subtract_drift, |estimate| estimate == DriftEstimate::Subtract),
            reference_delay: keys.reference_delay_ms.map_or(default.unit.reference_delay, Span::from_ms),
            navigation: navigation(&keys.navigation),
        },
        pre_launch: pre_launch(&keys.pre_launch),
        tail_flush: keys.tail_flush_ms.map_or(default.tail_flush, milliseconds),
        status_interval: keys.status_interval_ms.map_or(default.status_interval, milliseconds),
        stop_timeout: keys.stop_timeout_ms.map_or(default.stop_timeout, milliseconds),
        congestion: keys.congestion.map_or(default.congestion, |congestion| match congestion {
            Congestion::Drop => CongestionControl::Drop,
            Congestion::Block => CongestionControl::Block,
        }),
        units: units(r, keys.units),
        certified_names: keys.zenoh.certified_names.unwrap_or(default.certified_names),
        session: session(r, keys.zenoh, keys.pair.lease_ms, folder),
        pair: pair(r, keys.pair),
        metrics: metrics(r, keys.metrics),
        web: web(r, keys.web, folder),
        digest: None,
    };
    settings.listen_for_web();
    Some(settings)
}

fn milliseconds(ms: u32) -> Duration {
    Duration::from_millis(ms.into())
}

/// A path that must lead to something.
fn existing(
    r: &mut Reader<'_>,
    key: &str,
    path: Option<String>,
    folder: &Path,
    is_there: fn(&Path) -> bool,
    what: &str,
) -> Option<PathBuf> {
    let text = path?;
    let path = folder.join(&text);
    if !is_there(&path) {
        r.refuse(key, format!("is {text:?}, must be an existing {what}; looked for {}", path.display()));
    }
    Some(path)
}

fn units(r: &mut Reader<'_>, patterns: Vec<String>) -> Vec<String> {
    for (index, pattern) in patterns.iter().enumerate() {
        if chunk(pattern).is_none() {
            let must_be = "a serial, such as \"ZLG-0042\"; * matches any characters: \"ZLG-*\"";
            r.report(&element("units", index), format!("is {pattern:?}, must be {must_be}"));
        }
    }
    if patterns.is_empty() { vec![ALL_UNITS.to_owned()] } else { patterns }
}

fn pair(r: &mut Reader<'_>, keys: PairKeys) -> PairSettings {
    let default = PairSettings::default();
    if let Some(name) = keys.name.as_ref().filter(|name| !is_name(name)) {
        r.report(
            "pair.name",
            format!("is {name:?}, must be 1 to 32 letters A-Z a-z, digits, '.', '_' and '-'"),
        );
    }
    PairSettings {
        name: keys.name,
        mode: keys.mode.map_or(default.mode, |mode| match mode {
            ModeKey::Standby => Mode::Standby,
            ModeKey::Active => Mode::Active,
        }),
        priority: keys.priority.unwrap_or(default.priority),
        takeover: keys.takeover_ms.map_or(default.takeover, milliseconds),
    }
}

fn watched(keys: &FolderKeys) -> FolderSettings {
    let default = FolderSettings::default();
    FolderSettings {
        settle: keys.settle_ms.map_or(default.settle, milliseconds),
        poll: keys.poll_s.map_or(default.poll, Duration::from_secs_f64),
    }
}

fn swap(r: &mut Reader<'_>, keys: SwapKeys, folder: &Path) -> SwapSettings {
    let default = SwapSettings::default();
    let limit = |limit: Option<f64>| limit.filter(|limit| *limit > 0.0);
    let require_signature = keys.require_signature.unwrap_or(default.require_signature);
    if require_signature && keys.trusted_keys.is_none() {
        r.report("swap", "require_signature is set: trusted_keys must name the folder of the public keys");
    }
    let days = keys.max_age_days.filter(|days| *days > 0);
    SwapSettings {
        max_age: days.map(|days| Duration::from_secs(u64::from(days) * DAY_S)),
        age: keys.age.unwrap_or(default.age),
        outside_range: keys.outside_range.unwrap_or(default.outside_range),
        max_jump_rad_per_s: limit(keys.max_jump_deg_per_h).map(rad_per_s),
        max_jump_m_per_s2: limit(keys.max_jump_mg)
            .map(|limit| SpecificForce::from_g(limit * 1e-3).as_m_per_s2()),
        jump: keys.jump.unwrap_or(default.jump),
        old_schema: keys.old_schema.unwrap_or(default.old_schema),
        // Where a signature is asked for, an old one must not do.
        downgrade: keys.downgrade.unwrap_or(if require_signature {
            Severity::Refuse
        } else {
            default.downgrade
        }),
        slew: keys.slew_ms.map_or(default.slew, Span::from_ms),
        require_signature,
        trusted_keys: existing(r, "swap.trusted_keys", keys.trusted_keys, folder, Path::is_dir, "folder"),
    }
}

fn rad_per_s(deg_per_h: f64) -> f64 {
    AngularRate::from_deg_per_h(deg_per_h).as_rad_per_s()
}

fn pre_launch(keys: &PreLaunchKeys) -> PreLaunchSettings {
    let default = PreLaunchSettings::default();
    let limits = default.limits;
    PreLaunchSettings {
        duration: keys.duration_s.map_or(default.duration, Span::from_s),
        place: None,
        limits: PreLaunchLimits {
            static_bias_change_rad_per_s: keys
                .max_static_change_deg_per_h
                .map_or(limits.static_bias_change_rad_per_s, rad_per_s),
            magnetic_bias_change_rad_per_s: keys
                .max_magnetic_change_deg_per_h
                .map_or(limits.magnetic_bias_change_rad_per_s, rad_per_s),
            mode_imbalance: keys.max_imbalance.unwrap_or(limits.mode_imbalance),
            time_per_mode: keys.min_time_per_mode_s.map_or(limits.time_per_mode, Span::from_s),
            good_share: keys.min_good_share.unwrap_or(limits.good_share),
            rest: limits.rest,
        },
    }
}

fn navigation(keys: &NavigationKeys) -> NavigationStep {
    NavigationStep::new(keys.ticks.unwrap_or(1), keys.coning_sculling.unwrap_or(false)).unwrap_or_default()
}

fn metrics(r: &mut Reader<'_>, keys: MetricsKeys) -> MetricsSettings {
    let allow_remote = keys.allow_remote.unwrap_or_default();
    let settings = MetricsSettings { listen: None, allow_remote };
    let listen = keys.listen.and_then(|text| {
        let address = text.parse::<SocketAddr>().ok().filter(|address| settings.admits(*address));
        if address.is_none() {
            let must_be = if allow_remote {
                "an address and a port, such as \"0.0.0.0:9464\""
            } else {
                "a loopback address and a port, such as \"127.0.0.1:9464\"; any other needs allow_remote = true"
            };
            r.report("metrics.listen", format!("is {text:?}, must be {must_be}"));
        }
        address
    });
    MetricsSettings { listen, ..settings }
}

fn web(r: &mut Reader<'_>, keys: WebKeys, folder: &Path) -> WebSettings {
    for host in &keys.hosts {
        let fits = |c: char| c.is_ascii_alphanumeric() || "-._[]:".contains(c);
        let bare = !host.contains(':') || host.starts_with('[');
        if host.is_empty() || !bare || !host.chars().all(fits) {
            let words =
                format!("has {host:?}, must be names or addresses without a port, such as \"bench.example\"");
            r.report("web.hosts", words);
        }
    }
    WebSettings {
        enabled: keys.enabled.unwrap_or_default(),
        write: keys.write.unwrap_or_default(),
        hosts: keys.hosts,
        token_file: keys.token_file.map(|path| folder.join(path)),
    }
}

/// Reads `[zenoh]` and tries the configuration that it stands for.
fn session(r: &mut Reader<'_>, keys: ZenohKeys, lease_ms: Option<u32>, folder: &Path) -> SessionOptions {
    let session = SessionOptions {
        config: existing(r, "zenoh.config", keys.config, folder, Path::is_file, "file"),
        connect: keys.connect,
        listen: keys.listen,
        namespace: keys.namespace,
        lease: lease_ms.map(milliseconds),
    };
    if !r.is_damaged("zenoh")
        && let Err(error) = session.to_config()
    {
        r.report("zenoh", error.to_string());
    }
    session
}
