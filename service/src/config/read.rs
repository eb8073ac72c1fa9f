//! What a configuration's schema cannot say: paths, names, addresses, and what one key means for another.

use std::path::{Path, PathBuf};
use std::sync::LazyLock;

use isotherm_bus::endpoint;
use isotherm_document::{Form, Reader, element};
use isotherm_protocol::pair::is_name;

use super::Settings;
use super::metrics::LOOPBACK;
use super::pair::chunk;
use super::swap::Severity;

static FORM: LazyLock<Form> = LazyLock::new(Form::of::<Settings>);

/// Reads a configuration; `None` where its text makes no sense. Relative paths count from `folder`.
pub(super) fn settings(r: &mut Reader<'_>, folder: &Path) -> Option<Settings> {
    let mut settings: Settings = r.read(&FORM)?;
    let Settings { calibrations, state, swap, web, zenoh, .. } = &mut settings;
    // With a state folder the folder of the documents may be missing: the last good sets hold until it is there.
    if state.is_none() {
        existing(r, "calibrations", calibrations.as_deref(), folder, Path::is_dir, "folder");
    }
    existing(r, "swap.trusted_keys", swap.trusted_keys.as_deref(), folder, Path::is_dir, "folder");
    existing(r, "zenoh.config", zenoh.session.config.as_deref(), folder, Path::is_file, "file");
    let paths: [&mut Option<PathBuf>; 5] =
        [calibrations, state, &mut swap.trusted_keys, &mut web.token_file, &mut zenoh.session.config];
    paths.into_iter().flatten().for_each(|path| *path = folder.join(&*path));
    if swap.require_signature {
        if swap.trusted_keys.is_none() {
            r.report(
                "swap",
                "require_signature is set: trusted_keys must name the folder of the public keys",
            );
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
    if !r.is_damaged("zenoh")
        && let Err(error) = settings.zenoh.session.to_config()
    {
        r.report("zenoh", error.to_string());
    }
    if let Err(reason) = settings.check_other() {
        r.report("pair.other", reason);
    }
    settings.listen_for_web();
    Some(settings)
}

/// A path that must lead to something.
fn existing(
    r: &mut Reader<'_>,
    key: &str,
    path: Option<&Path>,
    folder: &Path,
    is_there: fn(&Path) -> bool,
    what: &str,
) {
    let Some(path) = path else { return };
    let whole = folder.join(path);
    if !is_there(&whole) {
        r.refuse(
            key,
            format!("is \"{}\", must be an existing {what}; looked for {}", path.display(), whole.display()),
        );
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
