//! How the program is called, and where the workspace is.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::Once;

use isotherm_correction::sample::CorrectedTick;
use isotherm_log::offline::rows::read_tick;
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

/// What the program said, with its exit code: for a snapshot.
pub(crate) fn ended(output: &Output) -> String {
    let (code, results, errors) = words(output);
    format!("exit code {}\n{errors}{results}\n", code.unwrap())
}

/// The same of a run of it, but for where its files are.
pub(crate) fn told(folder: &Path, arguments: &[&str]) -> String {
    ended(&calibrate(arguments)).replace(folder.to_str().unwrap(), "FOLDER")
}

/// The headings of a page: for a snapshot.
pub(crate) fn headings(page: impl AsRef<Path>) -> String {
    let html = std::fs::read_to_string(page).unwrap();
    let parts = html.split("<h2>").skip(1).filter_map(|part| part.split_once("</h2>"));
    parts.map(|(heading, _)| heading.to_owned() + "\n").collect()
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

/// What `isotherm-replay correct` makes of a log of one unit with a document, tick by tick as it wrote them.
#[track_caller]
pub(crate) fn replayed(log: &[&str], document: &str, more: &[&str]) -> Vec<CorrectedTick> {
    static BUILD: Once = Once::new();
    let own = Path::new(env!("CARGO_BIN_EXE_isotherm-calibrate"));
    // `cargo test` builds the programs of the tested package only; built with all, so that features are the same.
    BUILD.call_once(|| {
        let target = own.parent().unwrap();
        let mut cargo = Command::new(env!("CARGO"));
        cargo.args(["build", "--quiet", "--workspace", "--bins", "--target-dir"]);
        cargo.arg(target.parent().unwrap()).current_dir(root());
        // What `cargo test` says of this package would look like a change to build scripts that ask for it.
        for (name, _) in std::env::vars_os() {
            if name.to_str().is_some_and(|n| n.starts_with("CARGO_PKG_") || n.starts_with("CARGO_MANIFEST_"))
            {
                cargo.env_remove(name);
            }
        }
        if target.ends_with("release") {
            cargo.arg("--release");
        }
        assert!(cargo.status().unwrap().success(), "the programs build");
    });
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("corrected.csv");
    let mut replay = Command::new(own.with_file_name("isotherm-replay"));
    replay.arg("correct").args(log).args(["--calibration", document, "--out"]).arg(&out).args(more);
    let (code, _, errors) = words(&replay.output().unwrap());
    assert_eq!(code, Some(0), "{errors}");
    let text = std::fs::read_to_string(&out).unwrap();
    text.lines().skip(1).map(|row| read_tick(row).unwrap()).collect()
}
