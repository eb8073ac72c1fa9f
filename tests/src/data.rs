//! Where the real logs are.

use std::path::PathBuf;

/// The folder of real logs: `ISOTHERM_DATA`, or `../shared/data` beside the checkout. `None`, and a plain word of it,
/// where there is none.
#[must_use]
pub fn folder() -> Option<PathBuf> {
    let beside = PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../shared/data"));
    let folder = std::env::var_os("ISOTHERM_DATA").map_or(beside, PathBuf::from);
    if folder.join("README.md").is_file() {
        return Some(folder);
    }
    println!("skipped: no data (looked in {}; set ISOTHERM_DATA)", folder.display());
    None
}

/// The root of the checkout.
#[must_use]
pub fn root() -> PathBuf {
    PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/.."))
}
