//! The calibration document: TOML text in, a validated calibration out, or every error at once.
//!
//! A document states the coefficients of one unit in the units of its catalogue (°/h, ″, ppm, °C), with the unit
//! of measure in every key. `docs/calibration-document.md` lists the keys; `config/calibration.schema.json` lets
//! editors complete and check them; `config/calibration/` holds examples. The first two are generated from the
//! types here.
//!
//! ```
//! use isotherm_protocol::document::Document;
//!
//! let problems = Document::parse("schema = 1\nunit = \"ZLG 42\"\n", Some("zlg-42.toml")).unwrap_err();
//! let unit = problems.iter().find(|problem| problem.key == "unit").unwrap();
//! assert!(unit.to_string().starts_with("zlg-42.toml:2:8: unit: is \"ZLG 42\" (a string), must be 1 to 64 letters"));
//! ```
//!
//! How a text becomes a calibration:
//!
//! 1. size, UTF-8, TOML syntax: an error here ends the matter, for nothing after it can be trusted;
//! 2. every key is read by the schema of its type; what is wrong is replaced by a harmless stand-in;
//! 3. the checks between keys (`check`), then the core's own, on everything that is not a stand-in.

mod check;
mod convert;
mod correction_change;
mod curve;
mod defaults;
mod defects;
mod difference;
mod measure;
mod nominal;
mod terms;
#[cfg(test)]
mod tests;
mod types;
mod warnings;

use std::sync::LazyLock;

use isotherm_correction::calibration::Calibration;
pub use isotherm_document::Problem;
use isotherm_document::{Form, Reader, file, published, unplaced};
use serde_json::Value as Json;

pub use correction_change::{Side, correction_change, turn_rad};
pub use curve::{Curve, Shape};
pub use difference::{difference, lost_sections};
pub use measure::{Argument, BaseUnit, Unit};
pub use terms::{Accels, Gyros, Regressor, SensorKind, StatedTerm, Terms};
pub use types::{
    Accel, AccelBiasSigma, AccelOrientation, AccelOutput, AccelParity, AccelSensor, AccelSigma, Auxiliary,
    AxesHysteresis, Channel, Created, Document, Drift, Filter, FitWindow, Gyro, GyroBiasSigma,
    GyroOrientation, GyroOutput, GyroParity, GyroSensor, GyroSigma, Log, Measure, ModeReversal, Orientation,
    OrientationThermal, Origin, Residual, Sample, SelfTest, SelfTestCounter, SelfTestVoltage, Servo,
    ServoKind, Temperature, Trend,
};

use crate::digest::Digest;

/// Oldest version of the document's form that is still read.
///
/// Policy: `schema` is the first key of every document. A reader accepts every version from [`MIN_SCHEMA`] to
/// [`CURRENT_SCHEMA`] and refuses others by number, reading nothing else of them. A new optional key whose absence
/// means what it meant before leaves the version as it is: an older reader refuses the unknown key by name. A key that
/// is removed, renamed or given another meaning or unit makes a new version, and the older one goes on being read,
/// with its own meaning, until a release says at the top of its changelog that it is dropped.
pub const MIN_SCHEMA: u32 = 1;
/// The version that is written.
pub const CURRENT_SCHEMA: u32 = 1;

/// Longest document that is read, in bytes.
pub const MAX_DOCUMENT_BYTES: usize = isotherm_document::MAX_BYTES;

static FORM: LazyLock<Form> =
    LazyLock::new(|| Form::of::<Document>().versions("schema", [MIN_SCHEMA, CURRENT_SCHEMA]));

/// JSON schema (draft 07) of the document, as published in `config/calibration.schema.json`.
#[must_use]
pub fn schema() -> Json {
    published::<Document>()
}

/// A problem with what stands at a key of a document's text, or around it; with the text as a whole where it has nothing of it.
#[must_use]
pub fn problem_at(text: &str, file: &str, key: &str, message: String) -> Problem {
    let mut reader = Reader::new(text, Some(file));
    // For the places alone.
    let _ = reader.read::<Document>(&FORM);
    reader.warning(key, message)
}

/// A document that holds, and what was made of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Parsed {
    /// What stands in the document, defaults filled in.
    pub document: Document,
    /// The calibration.
    pub calibration: Calibration,
    /// SHA-256 of the text's bytes.
    pub digest: Digest,
    /// What is doubtful, though valid.
    pub warnings: Vec<Problem>,
}

impl Document {
    /// Reads a document; `file` is the name that its problems are to carry.
    ///
    /// # Errors
    /// Every [`Problem`], in the order of the text.
    pub fn parse(text: &str, file: Option<&str>) -> Result<Parsed, Vec<Problem>> {
        let mut reader = Reader::new(text, file);
        let Some(mut document) = reader.read::<Self>(&FORM) else {
            return reader.finish(None);
        };
        if let Some(origin) = &mut document.origin {
            origin.details = reader.free_table("origin.details");
        }
        defaults::complete(&reader, &mut document);
        check::check(&mut reader, &document);
        let compiled = Calibration::new(&document.to_parts());
        if let Err(defects) = &compiled {
            defects::report(&mut reader, defects);
        }
        let warnings = warnings::warnings(&reader, &document);
        match (reader.into_problems(), compiled) {
            (None, Ok(calibration)) => {
                Ok(Parsed { document, calibration, digest: Digest::of(text.as_bytes()), warnings })
            }
            (Some(problems), _) => Err(problems),
            // Every defect rests on a stand-in, and every stand-in has its problem: not to be reached, but if it is,
            // the document is refused with what the core said.
            (None, Err(defects)) => {
                Err(defects.iter().map(|defect| unplaced(file, format!("{defect:?}"))).collect())
            }
        }
    }

    /// Reads a document from bytes that may not be UTF-8.
    ///
    /// # Errors
    /// Every [`Problem`], in the order of the text; the first bytes that are not UTF-8 are the only one.
    pub fn parse_bytes(bytes: &[u8], name: Option<&str>) -> Result<Parsed, Vec<Problem>> {
        Self::parse(file::text(bytes, name)?, name)
    }

    /// Writes the document as text that [`Document::parse`] reads back as an equal document.
    ///
    /// # Errors
    /// What the TOML writer refuses: `origin.details` may hold nothing that TOML cannot state.
    pub fn to_toml(&self) -> Result<String, toml::ser::Error> {
        toml::to_string(self)
    }
}
