//! Examples in the help of every sub-command, run as they are printed.

use std::path::Path;
use std::process::{Command, Output};

use crate::common::{replay, root, stderr, stdout};

/// Whether a line needs a service: the system tests run these, with one.
fn needs_service(line: &str) -> bool {
    let records = line.starts_with("isotherm-replay record ") && !line.contains("--no-service");
    records || line.starts_with("isotherm-replay play ")
}

/// Names of all sub-commands.
fn commands(folder: &Path) -> Vec<String> {
    let help = stdout(&replay(folder, &["--help"]));
    let listed = help.lines().skip_while(|line| *line != "Commands:").skip(1);
    let listed = listed.take_while(|line| !line.is_empty());
    // A name stands two places in; what stands further in is its description going on.
    let names =
        listed.filter(|line| !line.starts_with("   ")).filter_map(|line| line.split_whitespace().next());
    names.filter(|name| *name != "help").map(str::to_owned).collect()
}

/// The lines of a help text that are to be typed: two places in, behind the word "Example".
fn examples(help: &str) -> Vec<&str> {
    let behind = help.lines().skip_while(|line| !line.starts_with("Example"));
    behind.filter_map(|line| line.strip_prefix("  ")).map(str::trim).collect()
}

/// A folder that has the project's configuration, as its root has it.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let config = std::fs::canonicalize(root().join("config")).unwrap();
    std::os::unix::fs::symlink(config, folder.path().join("config")).unwrap();
    folder
}

/// Types a line into a shell that finds the program.
fn typed(folder: &Path, line: &str) -> Output {
    let program = Path::new(env!("CARGO_BIN_EXE_isotherm-replay"));
    let found = std::env::var_os("PATH").unwrap_or_default();
    let found = std::env::split_paths(&found);
    let path =
        std::env::join_paths(program.parent().map(Path::to_path_buf).into_iter().chain(found)).unwrap();
    Command::new("sh").args(["-c", line]).current_dir(folder).env("PATH", path).output().unwrap()
}

#[test]
fn every_command_has_an_example_that_works_as_printed() {
    let place = folder();
    let commands = commands(place.path());
    for known in ["play", "correct", "convert", "simulate", "list", "cat", "completions", "man"] {
        assert!(commands.iter().any(|name| name == known), "{commands:?}");
    }
    // The last two are those of every program (`isotherm_cli::program`), whose name they do not know.
    for command in commands.into_iter().filter(|name| !["completions", "man"].contains(&name.as_str())) {
        let help = stdout(&replay(place.path(), &[&command, "--help"]));
        let lines = examples(&help);
        let begin = format!("isotherm-replay {command} ");
        assert!(lines.iter().any(|line| line.starts_with(&begin)), "{command} has no example:\n{help}");
        let folder = folder();
        for line in lines.iter().filter(|line| !needs_service(line)) {
            let output = typed(folder.path(), line);
            let errors = String::from_utf8_lossy(&output.stderr);
            assert!(output.status.success(), "{line}: {}: {errors}", output.status);
        }
    }
}

#[test]
fn an_example_that_does_not_work_is_found() {
    let help =
        "Usage:\n  isotherm-replay x\n\nExample:\n  isotherm-replay none\n  true\n\n    further in\nother\n";
    assert_eq!(examples(help), ["isotherm-replay none", "true", "further in"]);
    let folder = folder();
    let failed = typed(folder.path(), "isotherm-replay convert none.csv --out x.csv");
    assert!(failed.status.code() == Some(1) && stderr(&failed).contains("none.csv"), "{failed:?}");
}
