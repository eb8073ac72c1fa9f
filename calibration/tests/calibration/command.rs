//! How the program is called, and where the workspace is.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use serde_json::Value;

/// The workspace's root.
pub(crate) fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// A shipped document, by its name.
pub(crate) fn shipped(name: &str) -> PathBuf {
    root().join("config/calibration").join(name)
}

/// A folder of the test data, if it is on this machine.
pub(crate) fn data(folder: &str) -> Option<PathBuf> {
    let data = std::env::var_os("ISOTHERM_DATA").map_or_else(|| root().join("../shared/data"), PathBuf::from);
    let folder = data.join(folder);
    if !folder.exists() {
        println!("skipped: no {}", folder.display());
    }
    folder.exists().then_some(folder)
}

/// The program with these arguments.
pub(crate) fn program(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_isotherm-calibrate"));
    command.args(arguments);
    command
}

/// Runs the program.
pub(crate) fn calibrate(arguments: &[&str]) -> Output {
    program(arguments).output().unwrap()
}

/// Exit code, results, errors.
pub(crate) fn words(output: &Output) -> (Option<i32>, String, String) {
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (output.status.code(), text(&output.stdout), text(&output.stderr))
}

/// Runs the program, which must succeed, and gives its results.
#[track_caller]
pub(crate) fn succeeds(arguments: &[&str]) -> String {
    let (code, results, errors) = words(&calibrate(arguments));
    assert_eq!(code, Some(0), "{arguments:?}: {errors}");
    results
}

/// Runs the program, which must end with this code, and gives its errors.
#[track_caller]
pub(crate) fn fails(arguments: &[&str], code: i32) -> String {
    let (ended, _, errors) = words(&calibrate(arguments));
    assert_eq!(ended, Some(code), "{arguments:?}: {errors}");
    errors
}

/// Runs the program, which must succeed and print JSON.
#[track_caller]
pub(crate) fn json(arguments: &[&str]) -> Value {
    serde_json::from_str(&succeeds(arguments)).unwrap()
}
