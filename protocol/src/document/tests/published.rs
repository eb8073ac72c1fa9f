//! What is generated from the types and committed: the schema and the reference of keys.

use std::path::PathBuf;

use super::super::{reference, schema};
use crate::overlay::overlay_schema;

/// Compares a committed file with what the types give; `ISOTHERM_BLESS=1` writes it anew.
#[track_caller]
fn compare(path: &str, expected: &str) {
    let path: PathBuf = [env!("CARGO_MANIFEST_DIR"), "..", path].iter().collect();
    if std::env::var_os("ISOTHERM_BLESS").is_some() {
        std::fs::write(&path, expected).unwrap();
    }
    let committed = std::fs::read_to_string(&path).unwrap_or_default();
    assert!(
        committed == expected,
        "{} is not what the types give: run the tests with ISOTHERM_BLESS=1",
        path.display()
    );
}

#[test]
fn the_schema_is_that_of_the_types() {
    compare("config/calibration.schema.json", &(serde_json::to_string_pretty(&schema()).unwrap() + "\n"));
}

#[test]
fn the_schema_of_the_overlay_is_that_of_the_types() {
    let schema = serde_json::to_string_pretty(&overlay_schema()).unwrap();
    compare("config/overlay.schema.json", &(schema + "\n"));
}

#[test]
fn the_reference_is_that_of_the_types() {
    compare("docs/calibration-document.md", &reference());
}
