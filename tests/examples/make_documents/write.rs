//! From a document to its file, and what can go wrong on the way.

use std::path::{Path, PathBuf};

use isotherm_protocol::document::{
    CURRENT_SCHEMA, Created, Document, Gyro, GyroOutput, Orientation, Problem, Temperature,
};
use isotherm_simulator::ScenarioErrors;
use thiserror::Error;

/// Command that makes the documents, as a reader would type it.
pub(crate) const COMMAND: &str = "cargo run --release -p isotherm-tests --example make_documents";
/// Date of the documents: fixed, so that the same sources give the same bytes.
const CREATED: &str = "2026-11-21";

/// Why a document could not be made.
#[derive(Debug, Error)]
pub(crate) enum Failure {
    /// A scenario of another kind of unit.
    #[error("scenario of {unit} holds another kind of unit than its document is for")]
    WrongUnit {
        /// Serial.
        unit: String,
    },
    /// A scenario that cannot run.
    #[error(transparent)]
    Scenario(#[from] ScenarioErrors),
    /// The fit has no solution.
    #[error("the fit of {of} has no solution")]
    NoSolution {
        /// What was to be fitted.
        of: String,
    },
    /// A log that cannot be read.
    #[error("{}: {message}", path.display())]
    Log {
        /// The log.
        path: PathBuf,
        /// What is wrong.
        message: String,
    },
    /// The document is refused by its own reader.
    #[error("{}", list(.0))]
    Refused(Vec<Problem>),
    /// The core refuses the document's parts.
    #[error("compile: {0}")]
    Compile(String),
    /// The serialiser refuses the document.
    #[error("serialise: {0}")]
    Serialise(String),
    /// A file cannot be written.
    #[error("{}: {source}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
}

fn list(problems: &[Problem]) -> String {
    problems.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n")
}

/// An empty document for a unit, to be filled.
pub(crate) fn document(unit: &str) -> Document {
    Document {
        schema: CURRENT_SCHEMA,
        unit: unit.into(),
        created: CREATED.parse().ok().and_then(Created::new),
        note: None,
        origin: None,
        auxiliary: Vec::new(),
        temperature: Temperature { assumed_deg_c: 25.0, filter: None, channel: Vec::new() },
        gyro: Gyro {
            output: GyroOutput::Mean,
            sensor: Vec::new(),
            orientation: Orientation { rows: Vec::new(), weights: None, thermal: None, parity: None },
        },
        accel: None,
        mode_reversal: None,
        self_test: None,
    }
}

/// Writes a document to `folder`, named after its unit unless a name is given; says what it did.
///
/// # Errors
/// A document that its own reader refuses or doubts, or a file that cannot be written.
pub(crate) fn write(mut document: Document, folder: &Path, name: &str) -> Result<(), Failure> {
    if let Some(origin) = &mut document.origin {
        origin.tool = Some(concat!("isotherm-tests make_documents ", env!("CARGO_PKG_VERSION")).into());
        origin.command = Some(COMMAND.into());
    }
    let body = document.to_toml().map_err(|error| Failure::Serialise(error.to_string()))?;
    let text = format!("#:schema ../calibration.schema.json\n\n# Made by: {COMMAND}\n\n{body}");
    let parsed = Document::parse(&text, Some(name)).map_err(Failure::Refused)?;
    if !parsed.warnings.is_empty() {
        return Err(Failure::Refused(parsed.warnings));
    }
    let path = folder.join(name);
    let before = std::fs::read_to_string(&path).unwrap_or_default();
    std::fs::write(&path, &text).map_err(|source| Failure::File { path, source })?;
    println!("{name}: {}", if before == text { "unchanged" } else { "written" });
    Ok(())
}
