//! The calibration documents of a folder.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use isotherm_correction::calibration::Calibration;
use isotherm_protocol::document::{Document, Problem};
use isotherm_protocol::key::UnitId;

use crate::ServiceError;
use crate::text::{self, read_bounded};

/// A calibration as it is installed.
#[derive(Debug, Clone)]
pub struct Installable {
    /// The compiled calibration.
    pub calibration: Arc<Calibration>,
    /// First eight bytes of the SHA-256 of the document's text.
    pub digest: [u8; 8],
    /// Where it was read; `None` for one that never was a file.
    pub file: Option<PathBuf>,
}

/// Calibrations by unit.
#[derive(Debug, Clone, Default)]
pub struct Calibrations {
    by_unit: BTreeMap<UnitId, Installable>,
}

impl Calibrations {
    /// Reads every `*.toml` of a folder, hidden files and sub-folders excepted.
    ///
    /// Each document names its unit; the names of the files mean nothing. Where two documents name one unit, neither is
    /// taken: which of them holds is for the operator to say, not for the order of a directory listing. The second value
    /// is everything that is wrong, file by file in the order of their names.
    ///
    /// # Errors
    /// [`ServiceError::Read`] where the folder itself cannot be read.
    pub fn read(folder: &Path) -> Result<(Self, Vec<BadDocument>), ServiceError> {
        let read = |source| ServiceError::Read { path: folder.to_owned(), source };
        let mut files = Vec::new();
        for entry in std::fs::read_dir(folder).map_err(read)? {
            let path = entry.map_err(read)?.path();
            let hidden = path.file_name().is_none_or(|name| name.to_string_lossy().starts_with('.'));
            if !hidden && path.extension().is_some_and(|extension| extension == "toml") && path.is_file() {
                files.push(path);
            }
        }
        files.sort();

        let mut bad = Vec::new();
        let mut found: BTreeMap<UnitId, Vec<Installable>> = BTreeMap::new();
        for file in files {
            match read_document(&file) {
                Ok((unit, installable)) => found.entry(unit).or_default().push(installable),
                Err(problems) => bad.push(BadDocument { file, problems }),
            }
        }
        let mut calibrations = Self::default();
        for (unit, mut documents) in found {
            if documents.len() > 1 {
                bad.extend(rivals(&unit, &documents));
            } else if let Some(document) = documents.pop() {
                calibrations.by_unit.insert(unit, document);
            }
        }
        bad.sort_by(|a, b| a.file.cmp(&b.file));
        Ok((calibrations, bad))
    }

    /// Adds or replaces the calibration of one unit.
    pub fn insert(&mut self, unit: UnitId, calibration: Arc<Calibration>, digest: [u8; 8]) {
        self.by_unit.insert(unit, Installable { calibration, digest, file: None });
    }

    /// The calibration of one unit.
    #[must_use]
    pub fn get(&self, unit: &UnitId) -> Option<&Installable> {
        self.by_unit.get(unit)
    }

    /// How many units have one.
    #[must_use]
    pub fn len(&self) -> usize {
        self.by_unit.len()
    }

    /// Whether no unit has one.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.by_unit.is_empty()
    }

    /// The units that have one.
    pub fn units(&self) -> impl Iterator<Item = &UnitId> {
        self.by_unit.keys()
    }
}

/// A document that is not taken.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct BadDocument {
    /// Its file.
    pub file: PathBuf,
    /// Everything that is wrong with it.
    pub problems: Vec<Problem>,
}

/// Reads one document.
fn read_document(file: &Path) -> Result<(UnitId, Installable), Vec<Problem>> {
    let name = file.display().to_string();
    let whole = |message: String| vec![text::whole(&name, message)];
    let bytes = read_bounded(file).map_err(|error| whole(format!("cannot be read: {error}")))?;
    let parsed = Document::parse(text::text(&bytes, &name)?, Some(&name))?;
    for warning in &parsed.warnings {
        tracing::warn!("{warning}");
    }
    let unit = UnitId::new(&parsed.document.unit).map_err(|error| whole(format!("unit: {error}")))?;
    let digest = parsed.digest.first_chunk().copied().unwrap_or_default();
    Ok((unit, Installable { calibration: Arc::new(parsed.calibration), digest, file: Some(file.to_owned()) }))
}

/// One bad document for each that names the same unit.
fn rivals(unit: &UnitId, documents: &[Installable]) -> Vec<BadDocument> {
    let files: Vec<_> = documents.iter().filter_map(|document| document.file.clone()).collect();
    let rival = |file: &PathBuf| {
        let others: Vec<_> =
            files.iter().filter(|other| *other != file).map(|other| other.display().to_string()).collect();
        let message = format!(
            "unit {unit} is named by {} too: none of them is taken, remove all but one",
            others.join(", ")
        );
        let name = Some(file.display().to_string());
        let problem = Problem { file: name, line: 1, column: 1, key: "unit".to_owned(), message };
        BadDocument { file: file.clone(), problems: vec![problem] }
    };
    files.iter().map(rival).collect()
}
