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

/// Standard output as text.
pub(crate) fn stdout(output: &Output) -> String {
    String::from_utf8(output.stdout.clone()).unwrap()
}

/// Standard error as text.
pub(crate) fn stderr(output: &Output) -> String {
    String::from_utf8(output.stderr.clone()).unwrap()
}

/// Checks the exit code.
pub(crate) fn check(output: &Output, code: i32) {
    assert_eq!(output.status.code(), Some(code), "{}", stderr(output));
}

/// A command line, what it said on standard error and its exit code, for a snapshot.
pub(crate) fn told(folder: &Path, args: &[&str]) -> String {
    let output = replay(folder, args);
    let code = output.status.code().unwrap();
    format!("$ isotherm-replay {}\n{}exit code {code}\n\n", args.join(" "), stderr(&output))
}
