//! How each kind of file is recognised and checked.

use std::path::Path;

use isotherm_bus::Json5Problem;
use isotherm_document::{Reader, parse_toml};
use isotherm_protocol::digest::Digest;
use isotherm_protocol::document::{Channel, Document, Parsed, Problem};
use isotherm_protocol::overlay::{Overlay, ParsedOverlay, is_overlay};
use isotherm_protocol::signature::TrustedKeys;

use super::signer::{Signer, signer};
use super::{FileKind, Finding, Summary};
use crate::config::Settings;
use crate::signing::doubts;
use isotherm_document::file::text;
use isotherm_document::unplaced;

/// Top-level keys that only a calibration document has.
const CALIBRATION_KEYS: [&str; 6] = ["schema", "unit", "gyro", "accel", "temperature", "mode_reversal"];

/// What is said of a file that may be anything.
const NO_KEYS: &str = "has no keys: state its kind with --kind";

/// Longest message of the JSON5 parser that is passed on; long enough for Zenoh's lists of known keys.
const MAX_MESSAGE_CHARS: usize = 1000;

/// Checks what was read of one file; with the keys that are trusted, if who signed it is to be verified.
pub(super) fn check_file(
    path: &Path,
    read: std::io::Result<Vec<u8>>,
    forced: Option<FileKind>,
    trusted: Option<&TrustedKeys>,
) -> Finding {
    let file = path.display().to_string();
    let bytes = match read {
        Ok(bytes) => bytes,
        Err(error) => return Finding::unreadable(path, error.to_string()),
    };
    let recognised = recognise(path, &bytes);
    let kind = forced.or(recognised.ok());
    let checked = text(&bytes, Some(&file)).and_then(|text| match kind {
        Some(FileKind::Calibration) => check_calibration(text, &file, trusted),
        Some(FileKind::Overlay) => check_overlay(text, &file, trusted),
        Some(FileKind::Service) => check_service(text, path),
        Some(FileKind::Zenoh) => check_zenoh(text, &file),
        None => Err(vec![unplaced(Some(&file), recognised.err().unwrap_or_default().to_owned())]),
    });
    let (problems, warnings, summary) = match checked {
        Ok((summary, warnings)) => (Vec::new(), warnings, Some(summary)),
        Err(problems) => (problems, Vec::new(), None),
    };
    Finding { file, kind, good: summary.is_some(), unreadable: None, problems, warnings, summary }
}

/// Problems, or a summary with warnings.
type Checked = Result<(Summary, Vec<Problem>), Vec<Problem>>;

/// JSON by its extension; an overlay, then a calibration document, by a key that only it has; else a service configuration,
/// unless there are no keys at all: a calibration document that was cut to nothing must not pass for a configuration of defaults.
///
/// `Err`: what it is else.
fn recognise(path: &Path, bytes: &[u8]) -> Result<FileKind, &'static str> {
    let extension = path.extension().map(|extension| extension.to_string_lossy().to_ascii_lowercase());
    if matches!(extension.as_deref(), Some("json" | "json5")) {
        return Ok(FileKind::Zenoh);
    }
    let text = String::from_utf8_lossy(bytes);
    if is_overlay(&text) {
        return Ok(FileKind::Overlay);
    }
    // What has errors of syntax is recognised by what could be read nevertheless.
    let (root, errors) = parse_toml(&text);
    let root = root.get_ref();
    let is_list = |key: &str| root.get(key).is_some_and(|value| value.get_ref().is_array());
    if is_list("file") {
        Err("is a column mapping: `isotherm-replay info LOG --mapping FILE` checks it")
    } else if is_list("unit") {
        Err("is a mapping of topics: `isotherm-ros check FILE` checks it")
    } else if CALIBRATION_KEYS.iter().any(|key| root.contains_key(*key)) {
        Ok(FileKind::Calibration)
    } else if root.is_empty() && errors.is_empty() {
        Err(NO_KEYS)
    } else {
        Ok(FileKind::Service)
    }
}

fn check_calibration(text: &str, file: &str, trusted: Option<&TrustedKeys>) -> Checked {
    let signer = signer(text, trusted).map_err(|error| error.problem(Some(file)));
    let (parsed, signer) = signed(Document::parse(text, Some(file)), signer)?;
    let Parsed { document, calibration, digest, warnings } = parsed;
    let words = format!(
        "calibration of unit {}: {} gyros, {} accelerometers, {}, sha256 ",
        document.unit,
        calibration.gyro_count(),
        calibration.accel_count(),
        temperatures(&document.temperature.channel),
    );
    Ok((summary(&words, document.unit, digest, signer), warnings))
}

/// An overlay by itself: whether it fits its base shows only beside that.
fn check_overlay(text: &str, file: &str, trusted: Option<&TrustedKeys>) -> Checked {
    let signer = signer(text, trusted).map_err(|error| error.problem(Some(file)));
    let (parsed, signer) = signed(Overlay::parse(text, Some(file)), signer)?;
    let ParsedOverlay { overlay, digest, .. } = parsed;
    let gyros: Vec<_> = overlay.gyro.iter().map(|gyro| gyro.name.as_str()).collect();
    let words = format!(
        "overlay for unit {}: changes {} of the document with sha256 {}, sha256 ",
        overlay.unit,
        gyros.join(", "),
        overlay.overlay_of.get(..16).unwrap_or_default(),
    );
    Ok((summary(&words, overlay.unit, digest, signer), Vec::new()))
}

/// What was parsed, with its signer; the problems of both.
fn signed<T>(
    parsed: Result<T, Vec<Problem>>,
    signer: Result<Option<Signer>, Problem>,
) -> Result<(T, Option<Signer>), Vec<Problem>> {
    match (parsed, signer) {
        (Ok(parsed), Ok(signer)) => Ok((parsed, signer)),
        (Ok(_), Err(problem)) => Err(vec![problem]),
        // The signature's line is the last.
        (Err(problems), signer) => Err(problems.into_iter().chain(signer.err()).collect()),
    }
}

/// The summary of a document of either kind; `words` end before the digest.
fn summary(words: &str, unit: String, digest: Digest, signature: Option<Signer>) -> Summary {
    let digest = digest.to_string();
    let short = digest.get(..16).unwrap_or_default();
    let by = signature.as_ref().map_or_else(String::new, |signer| format!(", {signer}"));
    Summary { summary: format!("{words}{short}{by}"), unit: Some(unit), digest: Some(digest), signature }
}

/// The range over all temperature channels, e.g. `-55…85 °C in 3 channels`.
fn temperatures(channels: &[Channel]) -> String {
    let lowest = channels.iter().map(|channel| channel.range_deg_c[0]).fold(f64::INFINITY, f64::min);
    let highest = channels.iter().map(|channel| channel.range_deg_c[1]).fold(f64::NEG_INFINITY, f64::max);
    if channels.is_empty() {
        return "no temperature channels".to_owned();
    }
    let plural = if channels.len() == 1 { "" } else { "s" };
    format!("{lowest}…{highest} °C in {} channel{plural}", channels.len())
}

fn check_service(text: &str, path: &Path) -> Checked {
    let settings = Settings::parse(text, path)?;
    if let Some(folder) = settings.calibrations.as_deref().filter(|folder| !folder.is_dir()) {
        // A service with last good sets goes on without it; whoever checks wants to know.
        let file = path.display().to_string();
        let mut reader = Reader::new(text, Some(&file));
        let words = format!("must be an existing folder; looked for {}", folder.display());
        reader.report("calibrations", words);
        return Err(reader.into_problems().unwrap_or_default());
    }
    // What the service would say of its keys at the start.
    let warnings = doubts(&settings.swap)?;
    let calibrations = settings
        .calibrations
        .as_deref()
        .map_or_else(|| "none".to_owned(), |folder| folder.display().to_string());
    let words =
        format!("service configuration: calibrations {calibrations}, at most {} units", settings.max_units);
    Ok((Summary { summary: words, unit: None, digest: None, signature: None }, warnings))
}

fn check_zenoh(text: &str, file: &str) -> Checked {
    match zenoh::Config::from_json5(text) {
        Ok(config) => {
            let value = |key: &str| config.get_json(key).unwrap_or_else(|_| "null".to_owned());
            let words = format!(
                "Zenoh configuration: mode {}, listen {}, connect {}",
                value("mode"),
                value("listen/endpoints"),
                value("connect/endpoints")
            );
            Ok((Summary { summary: words, unit: None, digest: None, signature: None }, Vec::new()))
        }
        Err(error) => {
            let Json5Problem { place, message } = Json5Problem::of(&error);
            let (line, column) = place.unwrap_or((1, 1));
            let message: String =
                message.chars().filter(|c| !c.is_control()).take(MAX_MESSAGE_CHARS).collect();
            Err(vec![Problem { line, column, ..unplaced(Some(file), message) }])
        }
    }
}
