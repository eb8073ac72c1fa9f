//! How each kind of file is recognised and checked.

use std::path::Path;

use isotherm_protocol::document::{Channel, Document, Parsed, Problem};
use toml::de::DeTable;

use super::{FileKind, Finding, Summary};
use crate::calibrations::read_bounded;
use crate::config::Settings;

/// Top-level keys that only a calibration document has.
const CALIBRATION_KEYS: [&str; 6] = ["schema", "unit", "gyro", "accel", "temperature", "mode_reversal"];

/// Checks one file.
pub(super) fn check_file(path: &Path, forced: Option<FileKind>) -> Finding {
    let file = path.display().to_string();
    let bytes = match read_bounded(path) {
        Ok(bytes) => bytes,
        Err(error) => {
            return Finding {
                file,
                kind: None,
                good: false,
                unreadable: Some(error.to_string()),
                problems: Vec::new(),
                warnings: Vec::new(),
                summary: None,
            };
        }
    };
    let kind = forced.unwrap_or_else(|| recognise(path, &bytes));
    let checked = match kind {
        FileKind::Calibration => check_calibration(&bytes, &file),
        FileKind::Service => check_service(&bytes, path),
        FileKind::Zenoh => check_zenoh(&bytes, path),
    };
    let (problems, warnings, summary) = match checked {
        Ok((summary, warnings)) => (Vec::new(), warnings, Some(summary)),
        Err(problems) => (problems, Vec::new(), None),
    };
    Finding { file, kind: Some(kind), good: summary.is_some(), unreadable: None, problems, warnings, summary }
}

/// Problems, or a summary with warnings.
type Checked = Result<(Summary, Vec<Problem>), Vec<Problem>>;

/// JSON by its extension; a calibration document by a key that only it has; else a service configuration.
fn recognise(path: &Path, bytes: &[u8]) -> FileKind {
    let extension = path.extension().map(|extension| extension.to_string_lossy().to_ascii_lowercase());
    if matches!(extension.as_deref(), Some("json" | "json5")) {
        return FileKind::Zenoh;
    }
    let text = String::from_utf8_lossy(bytes);
    // What has errors of syntax is recognised by what could be read nevertheless.
    let (root, _) = DeTable::parse_recoverable(&text);
    let root = root.get_ref();
    if CALIBRATION_KEYS.iter().any(|key| root.contains_key(*key)) {
        FileKind::Calibration
    } else {
        FileKind::Service
    }
}

fn check_calibration(bytes: &[u8], file: &str) -> Checked {
    let Parsed { document, calibration, digest, warnings } = Document::parse_bytes(bytes, Some(file))?;
    let digest = digest.iter().fold(String::new(), |text, byte| text + &format!("{byte:02x}"));
    let words = format!(
        "calibration of unit {}: {} gyros, {} accelerometers, {}, sha256 {}",
        document.unit,
        calibration.gyro_count(),
        calibration.accel_count(),
        temperatures(&document.temperature.channel),
        digest.get(..16).unwrap_or_default(),
    );
    Ok((Summary { summary: words, unit: Some(document.unit), digest: Some(digest) }, warnings))
}

/// The range over all temperature channels, e.g. `-55…85 °C in 3 channels`.
fn temperatures(channels: &[Channel]) -> String {
    let lowest = channels.iter().map(|channel| channel.range_deg_c[0]).fold(f64::INFINITY, f64::min);
    let highest = channels.iter().map(|channel| channel.range_deg_c[1]).fold(f64::NEG_INFINITY, f64::max);
    let plural = if channels.len() == 1 { "" } else { "s" };
    format!("{lowest}…{highest} °C in {} channel{plural}", channels.len())
}

fn check_service(bytes: &[u8], path: &Path) -> Checked {
    let settings = Settings::parse(&String::from_utf8_lossy(bytes), path)?;
    let calibrations = settings
        .calibrations
        .as_deref()
        .map_or_else(|| "none".to_owned(), |folder| folder.display().to_string());
    let words =
        format!("service configuration: calibrations {calibrations}, at most {} units", settings.max_units);
    Ok((Summary { summary: words, unit: None, digest: None }, Vec::new()))
}

fn check_zenoh(bytes: &[u8], path: &Path) -> Checked {
    let text = String::from_utf8_lossy(bytes);
    match zenoh::Config::from_json5(&text) {
        Ok(config) => {
            let value = |key: &str| config.get_json(key).unwrap_or_else(|_| "null".to_owned());
            let words = format!(
                "Zenoh configuration: mode {}, listen {}, connect {}",
                value("mode"),
                value("listen/endpoints"),
                value("connect/endpoints")
            );
            Ok((Summary { summary: words, unit: None, digest: None }, Vec::new()))
        }
        Err(error) => {
            let message = isotherm_bus::words(&error);
            let (line, column) = position(&message).unwrap_or((1, 1));
            let file = Some(path.display().to_string());
            let message = message.lines().map(str::trim).collect::<Vec<_>>().join(" ");
            Err(vec![Problem { file, line, column, key: String::new(), message }])
        }
    }
}

/// The place in a message of the JSON5 parser: ` --> 3:7`, or `line: 3, column: 7`.
fn position(message: &str) -> Option<(usize, usize)> {
    let number = |text: &str| {
        text.trim_start().chars().take_while(char::is_ascii_digit).collect::<String>().parse().ok()
    };
    if let Some((_, place)) = message.split_once("--> ") {
        let (line, column) = place.split_once(':')?;
        return Some((number(line)?, number(column)?));
    }
    let (_, place) = message.split_once("line: ")?;
    let (_, column) = place.split_once("column: ")?;
    Some((number(place)?, number(column)?))
}
