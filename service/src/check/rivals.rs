//! Calibration documents of one folder that name the same unit: the service would take none of them.

use std::collections::BTreeMap;
use std::fs::canonicalize;
use std::path::PathBuf;

use isotherm_protocol::document::Problem;

use super::{FileKind, Finding};

/// Refuses every good document beside which, in the same folder, another one names its unit.
///
/// Documents of one unit in different folders are a comparison, and one file given twice is one file. Overlays of a unit
/// are results, one beside the other.
pub(super) fn refuse(findings: &mut [Finding]) {
    let mut found: BTreeMap<(PathBuf, String), BTreeMap<PathBuf, Vec<usize>>> = BTreeMap::new();
    let documents = |(_, finding): &(usize, &Finding)| finding.kind == Some(FileKind::Calibration);
    for (index, finding) in findings.iter().enumerate().filter(documents) {
        let unit = finding.summary.as_ref().and_then(|summary| summary.unit.clone());
        if let (Some(unit), Ok(path)) = (unit, canonicalize(&finding.file)) {
            let folder = path.parent().map_or_else(PathBuf::new, PathBuf::from);
            found.entry((folder, unit)).or_default().entry(path).or_default().push(index);
        }
    }
    for ((_, unit), files) in found.into_iter().filter(|(_, files)| files.len() > 1) {
        for (file, indices) in &files {
            let others = files.keys().filter(|other| *other != file).filter_map(|other| other.file_name());
            let others: Vec<_> = others.map(|name| name.to_string_lossy()).collect();
            let message = format!(
                "unit {unit} is also named by {}: the service uses neither; remove all but one",
                others.join(", ")
            );
            for index in indices {
                let Some(finding) = findings.get_mut(*index) else { continue };
                let file = Some(finding.file.clone());
                let key = "unit".to_owned();
                finding.refuse(Problem { file, line: 1, column: 1, key, message: message.clone() });
            }
        }
    }
}
