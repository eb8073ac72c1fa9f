//! Offline correction: a log through the same stream that the service uses.
//!
//! | file | holds |
//! |---|---|
//! | [`Loaded`] | a calibration, and a stream with it |
//! | [`correct`], [`UnitPlan`] | the units of a recording, all at once |
//! | [`rows`] | corrected ticks as a file |
//! | [`sums`] | their figures |

mod parallel;
mod published;
pub mod rows;
pub mod sums;
mod unit;

use std::path::Path;
use std::sync::Arc;

use isotherm_correction::unit::UnitSettings;
use isotherm_document::file::read_bounded;
use isotherm_protocol::document::{Document, Parsed, Problem};
use isotherm_protocol::key::UnitId;
use isotherm_protocol::stream::{UnitStream, unfit};

pub use parallel::{Made, RunOptions, correct};
pub use unit::{Basis, Form, Output, UnitPlan, UnitReport};

use crate::error::Error;

/// A calibration document that was read from a file.
#[derive(Debug, Clone)]
pub struct Loaded {
    /// The calibration.
    pub calibration: Arc<isotherm_correction::calibration::Calibration>,
    /// Head of the SHA-256 of the document's text.
    pub digest: [u8; 8],
    /// Serial of the unit it is for.
    pub unit: UnitId,
    /// What is doubtful about it, though valid.
    pub warnings: Vec<Problem>,
}

/// Reads a calibration document.
///
/// # Errors
/// [`Error::File`], [`Error::Calibration`] with every problem.
pub fn read_document(path: &Path) -> Result<Parsed, Error> {
    let bytes =
        read_bounded(path).map_err(|source| Error::file(path, "read the calibration document", source))?;
    let name = path.display().to_string();
    Document::parse_bytes(&bytes, Some(&name))
        .map_err(|problems| Error::Calibration(problems.iter().map(ToString::to_string).collect()))
}

/// Reads a calibration document, to correct by it.
///
/// # Errors
/// Those of [`read_document`], [`Error::Unit`].
pub fn load_calibration(path: &Path) -> Result<Loaded, Error> {
    Loaded::of(read_document(path)?)
}

impl Loaded {
    /// Of a document that was read.
    ///
    /// # Errors
    /// [`Error::Unit`].
    pub(crate) fn of(parsed: Parsed) -> Result<Self, Error> {
        Ok(Self {
            calibration: Arc::new(parsed.calibration),
            digest: parsed.digest.head(),
            unit: unit_id(&parsed.document.unit)?,
            warnings: parsed.warnings,
        })
    }

    /// The stream of a unit with it, as the service has it after its start; corrected ticks are kept.
    #[must_use]
    pub fn stream(&self, settings: UnitSettings) -> UnitStream {
        self.installed(UnitStream::new(self.unit.clone(), settings).keeping_ticks())
    }

    pub(crate) fn installed(&self, mut stream: UnitStream) -> UnitStream {
        stream.install(Arc::clone(&self.calibration), self.digest);
        stream
    }
}

/// A serial from its text.
///
/// # Errors
/// [`Error::Unit`].
pub fn unit_id(serial: &str) -> Result<UnitId, Error> {
    UnitId::new(serial).map_err(|source| Error::Unit { serial: serial.to_owned(), source })
}

/// Counters of a unit that are not zero.
fn counters(stream: &UnitStream) -> impl Iterator<Item = (String, u64)> + use<> {
    let counters = stream.counters().into_iter();
    counters.filter(|counter| counter.value > 0).map(|counter| (counter.name, counter.value))
}

/// What a stream has refused or passed over, in words for whoever reads only the summary. Of so many readings the caller itself has made
/// no numbers: they are none of the log's.
#[must_use]
pub fn troubles(stream: &UnitStream, left_out: u64) -> Vec<String> {
    /// Counters of what is as it should be, or that the summary and its flags show anyway.
    const EXPECTED: [&str; 8] = [
        "gyro_ticks_in",
        "accel_ticks_in",
        "temperature_readings_in",
        "ticks_out",
        "gaps",
        "ticks_missed",
        "ticks_interpolated",
        "switches_restored",
    ];
    let channels: Vec<_> = stream.unit().channels().map(|channel| channel.name.to_string()).collect();
    let of_log = |(name, value): (String, u64)| match name.as_str() {
        name if EXPECTED.contains(&name) => None,
        "not_finite_readings" if value <= left_out => None,
        "not_finite_readings" => Some((name, value - left_out)),
        _ => Some((name, value)),
    };
    let words = counters(stream).filter_map(of_log).map(|(name, value)| match name.as_str() {
        "temperature_unknown_channel" => format!(
            "{value} temperature readings are of channels that the calibration does not have; it has: {}",
            if channels.is_empty() { "none".to_owned() } else { channels.join(", ") }
        ),
        name if unfit::COUNTERS.contains(&name) => {
            let calibration = stream.unit().calibration();
            let why = calibration.and_then(|(calibration, _)| unfit::words(name, calibration));
            format!("{value} ticks of {} refused: {}", unfit_kinds(stream), why.unwrap_or_default())
        }
        "not_finite_readings" => format!("{value} sensor readings are not numbers"),
        "overrange_readings" => format!("{value} sensor readings are at or beyond the input range"),
        "temperature_rejected" => {
            format!("{value} temperature readings are not numbers, out of range, or spikes")
        }
        "temperature_late" => {
            format!("{value} temperature readings came too late for their ticks")
        }
        "temperature_out_of_order" => {
            format!("{value} temperature readings are not newer than the one before")
        }
        _ => format!("{value} {}", name.replace('_', " ")),
    });
    words.collect()
}

/// What unfit ticks are of. One counter has them all; those in and out tell where only one kind can be meant.
fn unfit_kinds(stream: &UnitStream) -> &'static str {
    let counters = stream.unit().counters();
    if counters.accel_ticks_in == 0 {
        "gyros"
    } else if counters.ticks_out == counters.gyro_ticks_in {
        "accelerometers"
    } else {
        "gyros and accelerometers"
    }
}
