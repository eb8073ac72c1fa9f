//! What the tests of the program share.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// The workspace's root.
pub(crate) fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// A ready mapping.
pub(crate) fn mapping(name: &str) -> PathBuf {
    root().join("config/mappings").join(name)
}

/// Runs the program in a folder.
pub(crate) fn replay(folder: &Path, args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_isotherm-replay")).current_dir(folder).args(args).output().unwrap()
}
