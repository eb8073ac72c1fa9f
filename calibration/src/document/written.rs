//! A calibration document on its way to a file: what is judged is what its own reader makes of the text.

use std::path::Path;
use std::sync::Arc;

use isotherm_correction::calibration::{Calibration, Defect};
use isotherm_log::file::{read_small_text, write_whole};
use isotherm_log::offline::{Loaded, unit_id};
use isotherm_protocol::document::{Document, Parsed, Problem};

use crate::error::Error;

/// Line that lets editors check a document.
const SCHEMA_LINE: &str = "#:schema ../calibration.schema.json\n\n";

/// A document beside its text and the calibration that the service makes of it.
#[derive(Debug, Clone)]
pub struct Written {
    /// Name of the file that it was read from; empty where it is new.
    pub name: String,
    /// The text.
    pub text: String,
    /// The document as it is read back from the text.
    pub document: Document,
    /// Its calibration.
    pub loaded: Loaded,
}

impl Written {
    /// Writes a document out and reads it back.
    ///
    /// # Errors
    /// [`Error::Document`] with every problem that its reader has with it.
    pub fn of(document: &Document) -> Result<Self, Error> {
        let body = document.to_toml().map_err(|error| Error::document(&error))?;
        let text = format!("{SCHEMA_LINE}{body}");
        let parsed = Document::parse(&text, None).map_err(|found| Error::Document(words(&found)))?;
        Self::from_parts(String::new(), text, parsed)
    }

    /// The calibration of a document that is only worked with, and never written.
    ///
    /// # Errors
    /// [`Error::Document`] with everything that is wrong with it.
    pub fn compiled(document: &Document) -> Result<Loaded, Error> {
        let defects = |found: Vec<Defect>| Error::Document(found.iter().map(Defect::to_string).collect());
        let calibration = Calibration::new(&document.to_parts()).map_err(defects)?;
        Ok(Loaded {
            calibration: Arc::new(calibration),
            digest: [0; 8],
            unit: unit_id(&document.unit)?,
            warnings: Vec::new(),
        })
    }

    /// Reads a document from a file.
    ///
    /// # Errors
    /// [`Error::Log`] where it cannot be read, with every problem of it.
    pub fn read(path: &Path) -> Result<Self, Error> {
        let text = read_small_text(path, "read the calibration document")?;
        let parsed = Document::parse(&text, Some(&path.display().to_string()))
            .map_err(|found| isotherm_log::error::Error::Calibration(words(&found)))?;
        Self::from_parts(name_of(path), text, parsed)
    }

    fn from_parts(name: String, text: String, parsed: Parsed) -> Result<Self, Error> {
        let loaded = Loaded {
            calibration: Arc::new(parsed.calibration),
            digest: parsed.digest.head(),
            unit: unit_id(&parsed.document.unit)?,
            warnings: parsed.warnings,
        };
        Ok(Self { name, text, document: parsed.document, loaded })
    }

    /// Writes it to a file; one that is there only where that is allowed.
    ///
    /// # Errors
    /// [`Error::Log`] where that cannot be done.
    pub fn save(&self, path: &Path, overwrite: bool) -> Result<(), Error> {
        write_file(path, self.text.as_bytes(), overwrite)
    }
}

/// Writes a file; one that is there only where that is allowed.
///
/// # Errors
/// [`Error::Log`] where that cannot be done.
pub fn write_file(path: &Path, bytes: &[u8], overwrite: bool) -> Result<(), Error> {
    write_whole(path, bytes, overwrite).map_err(|source| Error::file(path, "write", source))
}

/// The name of a file without its folder.
pub fn name_of(path: &Path) -> String {
    path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned()
}

fn words(problems: &[Problem]) -> Vec<String> {
    problems.iter().map(ToString::to_string).collect()
}
