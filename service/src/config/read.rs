//! What a configuration's schema cannot say: paths, names, addresses, and what one key means for another.

use std::path::{Path, PathBuf};
use std::sync::LazyLock;

use isotherm_bus::{SessionOptions, endpoint};
use isotherm_correction::prelaunch::PreLaunchSettings;
use isotherm_document::{Form, Reader, element};
use isotherm_protocol::pair::is_name;

use super::Settings;
use super::metrics::LOOPBACK;
use super::pair::chunk;
use super::swap::Severity;

static FORM: LazyLock<Form> = LazyLock::new(Form::of::<Settings>);

/// Whether a path may be what a key states.
type Fits = fn(&Path) -> bool;

/// Reads a configuration; `None` where its text makes no sense. Relative paths count from `folder`.
pub(super) fn settings(r: &mut Reader<'_>, folder: &Path) -> Option<Settings> {
    let mut settings: Settings = r.read(&FORM)?;
    let Settings { calibrations, state, swap, web, zenoh, .. } = &mut settings;
    let any: Fits = |_| true;
    // These are made where they are missing.
    let may_be_folder: Fits = |path| path.is_dir() || !path.exists();
    let may_be_file: Fits = |path| path.is_file() || !path.exists();
    // With a state folder the folder of the documents may be missing: the last good sets hold until it is there.
    let documents = if state.is_some() { any } else { Path::is_dir };
    let paths: [(&str, &mut Option<PathBuf>, Fits, &str); 5] = [
        ("calibrations", calibrations, documents, "an existing folder"),
        ("state", state, may_be_folder, "a folder"),
        ("web.token_file", &mut web.token_file, may_be_file, "a file"),
        ("swap.trusted_keys", &mut swap.trusted_keys, Path::is_dir, "an existing folder"),
        ("zenoh.config", &mut zenoh.session.config, Path::is_file, "an existing file"),
    ];
    for (key, path, fits, what) in paths {
        let Some(path) = path else { continue };
        let stated = std::mem::replace(path, folder.join(&*path));
        if !fits(path) {
            let (stated, whole) = (stated.display(), path.display());
            r.refuse(key, format!("is \"{stated}\", must be {what}; looked for {whole}"));
        }
    }
    if swap.require_signature {
        if swap.trusted_keys.is_none() {
            let must = "is true: swap.trusted_keys must name the folder of the public keys";
            r.report("swap.require_signature", must);
        }
        // Where a signature is asked for, an old one must not do.
        if !r.has("swap.downgrade") {
            swap.downgrade = Severity::Refuse;
        }
    }
    settings.zenoh.session.lease = settings.pair.lease;
    names(r, &mut settings);
    if let Some(address) = settings.metrics.listen.filter(|address| !settings.metrics.admits(*address)) {
        r.report("metrics.listen", format!("is \"{address}\", must be {LOOPBACK}"));
    }
    session(r, &settings.zenoh.session);
    let PreLaunchSettings { duration, limits, .. } = &settings.pre_launch;
    if limits.time_per_mode > *duration {
        let [least_s, duration_s] =
            [limits.time_per_mode, *duration].map(|span| (span.as_s() * 1e3).round() / 1e3);
        let must_be = format!("is {least_s}, must be at most pre_launch.duration_s, {duration_s}");
        r.report("pre_launch.min_time_per_mode_s", must_be);
    }
    if let Err(reason) = settings.check_other() {
        r.report("pair.other", reason);
    }
    settings.listen_for_web();
    Some(settings)
}

/// What Zenoh does not take, each in its place.
fn session(r: &mut Reader<'_>, session: &SessionOptions) {
    let SessionOptions { config, connect, listen, namespace, .. } = session;
    let mut check = |key: &str, alone: SessionOptions| {
        if let Err(error) = alone.to_config() {
            r.report(key, error.to_string());
        }
    };
    check("zenoh.config", SessionOptions { config: config.clone(), ..SessionOptions::default() });
    check("zenoh.namespace", SessionOptions { namespace: namespace.clone(), ..SessionOptions::default() });
    for (key, texts) in [("zenoh.connect", connect), ("zenoh.listen", listen)] {
        for (index, text) in texts.iter().enumerate() {
            if let Err(reason) = endpoint(text) {
                r.report(&element(key, index), format!("is {text:?}, {reason}"));
            }
        }
    }
}

/// Serials, the instance's name, hosts.
fn names(r: &mut Reader<'_>, settings: &mut Settings) {
    for (index, pattern) in settings.units.iter().enumerate() {
        if chunk(pattern).is_none() {
            let must_be = "a serial, such as \"ZLG-0042\"; * matches any characters: \"ZLG-*\"";
            r.report(&element("units", index), format!("is {pattern:?}, must be {must_be}"));
        }
    }
    if settings.units.is_empty() {
        r.report("units", "is empty, must have at least one pattern: [\"*\"] takes every unit");
    }
    if let Some(name) = settings.pair.name.as_ref().filter(|name| !is_name(name)) {
        let must_be = "1 to 32 letters A-Z a-z, digits, '.', '_' and '-'";
        r.report("pair.name", format!("is {name:?}, must be {must_be}"));
    }
    if let Some(other) = &settings.pair.other {
        match endpoint(other) {
            Ok(other) => settings.pair.other = Some(other),
            Err(reason) => r.report("pair.other", format!("is {other:?}, {reason}")),
        }
    }
    for host in &settings.web.hosts {
        let fits = |c: char| c.is_ascii_alphanumeric() || "-._[]:".contains(c);
        let bare = !host.contains(':') || host.starts_with('[');
        if host.is_empty() || !bare || !host.chars().all(fits) {
            let must_be = "names or addresses without a port, such as \"bench.example\"";
            r.report("web.hosts", format!("has {host:?}, must be {must_be}"));
        }
    }
}
