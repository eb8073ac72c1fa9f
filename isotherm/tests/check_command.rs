//! `isotherm check` at its boundary: exit codes, what goes to stdout and what to stderr.

#![expect(clippy::unwrap_used, reason = "a test may panic, its helpers included")]

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use serde_json::Value;
use tempfile::TempDir;

fn check(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_isotherm")).arg("check").args(arguments).output().unwrap()
}

fn config(name: &str) -> String {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../config").join(name).to_str().unwrap().to_owned()
}

fn write(folder: &TempDir, name: &str, text: &str) -> String {
    let path: PathBuf = folder.path().join(name);
    std::fs::write(&path, text).unwrap();
    path.to_str().unwrap().to_owned()
}

/// What a run said on standard error, but for where its files are.
fn errors(folder: &TempDir, output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).replace(folder.path().to_str().unwrap(), "FOLDER")
}

fn lines(bytes: &[u8]) -> Vec<String> {
    String::from_utf8_lossy(bytes).lines().map(ToOwned::to_owned).collect()
}

/// Every file below the shipped configuration that `check` knows.
fn shipped() -> Vec<String> {
    let mut files = vec![config("service.toml")];
    for folder in ["zenoh", "calibration"] {
        for entry in std::fs::read_dir(config(folder)).unwrap() {
            files.push(entry.unwrap().path().to_str().unwrap().to_owned());
        }
    }
    files
}

#[test]
fn every_shipped_file_is_good() {
    let files = shipped();
    let output = check(&["--json"].into_iter().chain(files.iter().map(String::as_str)).collect::<Vec<_>>());
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    let found: Value = serde_json::from_slice(&output.stdout).unwrap();
    let found = found["files"].as_array().unwrap();
    assert_eq!(found.len(), files.len());
    for (file, found) in files.iter().zip(found) {
        let kind = match file {
            file if file.ends_with("service.toml") => "service",
            file if file.ends_with("json5") => "zenoh",
            _ => "calibration",
        };
        assert_eq!((found["file"].as_str(), found["kind"].as_str()), (Some(&**file), Some(kind)));
    }
}

#[test]
fn every_problem_of_every_bad_file_goes_to_stderr_with_its_place() {
    let folder = TempDir::new().unwrap();
    let service = write(&folder, "s.toml", "max_units = 0\npairing_window = 5\n");
    let calibration = write(&folder, "c.toml", "schema = 1\nunit = \"a b\"\n");
    let zenoh = write(&folder, "z.json5", "{\n  mode: \"peer\",\n  listen: [\n}\n");
    let good = config("service.toml");
    let output = check(&[&service, &calibration, &zenoh, &good]);
    assert_eq!(output.status.code(), Some(78));
    insta::assert_snapshot!(errors(&folder, &output));
    assert_eq!(lines(&output.stdout).len(), 1, "the good file has its line");
}

#[test]
fn a_folder_of_calibrations_that_is_not_there_is_a_problem_with_state_or_without() {
    let folder = TempDir::new().unwrap();
    for state in ["", "state = \"state\"\n"] {
        let service = write(&folder, "s.toml", &format!("{state}calibrations = \"unis\"\n"));
        let output = check(&[&service]);
        assert_eq!(output.status.code(), Some(78));
        let problems = lines(&output.stderr);
        assert!(problems.len() == 1 && problems[0].contains("calibrations: "), "{problems:?}");
        let looked_for = folder.path().join("unis");
        assert!(problems[0].contains(looked_for.to_str().unwrap()), "{problems:?}");
        // The service does not start either: there is nothing to go on with.
        let serve = Command::new(env!("CARGO_BIN_EXE_isotherm"))
            .args(["serve", "--config", &service, "--listen", "127.0.0.1:0"])
            .output()
            .unwrap();
        assert_eq!(serve.status.code(), Some(78), "{}", String::from_utf8_lossy(&serve.stderr));
    }
}

#[test]
fn a_service_with_a_configuration_or_a_state_folder_that_is_none_is_not_started_again() {
    let folder = TempDir::new().unwrap();
    let file = write(&folder, "k.toml", "");
    let missing = folder.path().join("none.toml").display().to_string();
    for arguments in [["--config", &missing], ["--state", &file]] {
        let serve = Command::new(env!("CARGO_BIN_EXE_isotherm"))
            .args(["serve", "--listen", "127.0.0.1:0"])
            .args(arguments)
            .output()
            .unwrap();
        assert_eq!(serve.status.code(), Some(78), "{}", String::from_utf8_lossy(&serve.stderr));
    }
}

#[test]
fn only_one_instance_of_a_pair_connects_to_the_other() {
    let folder = TempDir::new().unwrap();
    write(&folder, "zenoh.json5", "{ connect: { endpoints: ['tcp/127.0.0.1:7'] } }");
    let pair = "[pair]\nother = \"127.0.0.1:7\"\n";
    let service = write(&folder, "file.toml", &format!("{pair}[zenoh]\nconfig = \"zenoh.json5\"\n"));
    let output = check(&[&service]);
    assert_eq!((output.status.code(), lines(&output.stderr).len()), (Some(78), 1));
    let service = write(&folder, "plain.toml", pair);
    assert_eq!(check(&[&service]).status.code(), Some(0));
    let serve = Command::new(env!("CARGO_BIN_EXE_isotherm"))
        .args(["serve", "--config", &service, "--listen", "127.0.0.1:0", "--connect", "127.0.0.1:7"])
        .output()
        .unwrap();
    assert_eq!(serve.status.code(), Some(78), "{}", String::from_utf8_lossy(&serve.stderr));
}

#[test]
fn a_zenoh_configuration_with_a_strange_key_or_value_is_bad() {
    let folder = TempDir::new().unwrap();
    for (name, text) in
        [("key.json5", "{ modus: 'peer' }"), ("value.json5", "{ mode: 'pear' }"), ("empty.json5", "")]
    {
        let file = write(&folder, name, text);
        let output = check(&[&file]);
        assert_eq!(output.status.code(), Some(78), "{text}");
        let problems = lines(&output.stderr);
        assert_eq!(problems.len(), 1, "{problems:?}");
        assert!(problems[0].starts_with(&format!("{file}:1:")), "{problems:?}");
    }
}

#[test]
fn what_cannot_be_read_is_a_failure_and_a_wrong_call_is_usage() {
    let folder = TempDir::new().unwrap();
    let missing = folder.path().join("none.toml");
    let output = check(&[missing.to_str().unwrap()]);
    assert_eq!(output.status.code(), Some(1));
    assert!(lines(&output.stderr)[0].starts_with(missing.to_str().unwrap()), "{:?}", output.stderr);
    assert_eq!(check(&[folder.path().to_str().unwrap()]).status.code(), Some(1), "an empty folder");
    let output = check(&["--trusted-keys", missing.to_str().unwrap(), &config("service.toml")]);
    assert_eq!(output.status.code(), Some(1), "{output:?}");
    assert_eq!(check(&[]).status.code(), Some(2));
    let pipe = folder.path().join("pipe.toml");
    assert!(Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    for path in [folder.path(), &pipe] {
        let output = check(&[path.to_str().unwrap()]);
        let told = lines(&output.stderr);
        assert!(output.status.code() == Some(1) && told.len() == 1, "{told:?}");
        assert!(told[0].starts_with(pipe.to_str().unwrap()) && told[0].contains("pipe"), "{told:?}");
    }
}

#[test]
fn every_document_of_a_folder_is_checked() {
    let output = check(&["--json", &config("calibration")]);
    let found: Value = serde_json::from_slice(&output.stdout).unwrap();
    let there = std::fs::read_dir(config("calibration")).unwrap().count();
    assert_eq!(found["files"].as_array().unwrap().len(), there);
    let folder = TempDir::new().unwrap();
    write(&folder, ".hidden.toml", "no");
    write(&folder, "a.toml", "schema = 1\n");
    assert_eq!(check(&[folder.path().to_str().unwrap()]).status.code(), Some(78));
}

#[test]
fn the_kind_can_be_forced() {
    let folder = TempDir::new().unwrap();
    let file = write(&folder, "defaults.toml", "[zenoh]\n");
    assert_eq!(check(&[&file]).status.code(), Some(0), "a service configuration");
    assert_eq!(check(&["--kind", "calibration", &file]).status.code(), Some(78));
}

#[test]
fn json_says_the_same_for_programs() {
    let folder = TempDir::new().unwrap();
    let bad = write(&folder, "bad.toml", "max_units = 0");
    let output = check(&["--json", &bad, &config("calibration/example-full.toml")]);
    assert_eq!(output.status.code(), Some(78));
    assert!(output.stderr.is_empty());
    let found: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(found["good"], false);
    let [first, second] = found["files"].as_array().unwrap().as_slice() else { panic!("{found}") };
    assert_eq!((&first["good"], &first["kind"]), (&Value::from(false), &Value::from("service")));
    assert_eq!(
        (&first["problems"][0]["line"], &first["problems"][0]["column"]),
        (&Value::from(1), &Value::from(13))
    );
    assert_eq!((&second["good"], &second["kind"]), (&Value::from(true), &Value::from("calibration")));
    assert_eq!(second["digest"].as_str().unwrap().len(), 64);
    assert!(second["unit"].is_string());
}

#[test]
fn documents_of_one_folder_that_name_one_unit_are_bad() {
    let (folder, other) = (TempDir::new().unwrap(), TempDir::new().unwrap());
    let text = std::fs::read_to_string(config("calibration/ZLG-0001.toml")).unwrap();
    let (a, b) = (write(&folder, "a.toml", &text), write(&folder, "b.toml", &text));
    let output = check(&[&a, &b]);
    assert_eq!(output.status.code(), Some(78));
    insta::assert_snapshot!(errors(&folder, &output));
    assert!(lines(&output.stdout).is_empty());
    // One file given twice, and a candidate elsewhere, are no rivals.
    assert_eq!(check(&[&a, &a, &write(&other, "a.toml", &text)]).status.code(), Some(0));
}

#[test]
fn an_overlay_is_checked_as_what_it_is() {
    let folder = TempDir::new().unwrap();
    let text = format!(
        "schema = 1\noverlay_of = \"{}\"\nunit = \"ZLG-0001\"\n\n[[gyro]]\nname = \"x\"\n\
         static_bias_change_deg_per_h = 0.031\nstatic_bias_sigma_deg_per_h = 0.004\n",
        "27fb".repeat(16)
    );
    // Several of one unit lie in one folder: they are results, no rivals.
    let (a, b) = (write(&folder, "a.toml", &text), write(&folder, "b.toml", &format!("{text}# again\n")));
    let output = check(&["--json", &a, &b]);
    assert_eq!(output.status.code(), Some(0), "{output:?}");
    let found: Value = serde_json::from_slice(&output.stdout).unwrap();
    let [first, second] = found["files"].as_array().unwrap().as_slice() else { panic!("{found}") };
    assert_eq!((&first["kind"], &first["unit"]), (&Value::from("overlay"), &Value::from("ZLG-0001")));
    assert_ne!(first["digest"], second["digest"]);
    // A service takes none of them from its folder.
    let in_folder = check(&[folder.path().to_str().unwrap()]);
    assert_eq!((in_folder.status.code(), lines(&in_folder.stdout).len()), (Some(78), 0));
    assert!(lines(&in_folder.stderr).iter().all(|line| line.contains("isotherm swap")), "{in_folder:?}");

    let broken = write(&folder, "broken.toml", &text.replace("unit = \"ZLG-0001\"", "units = \"ZLG-0001\""));
    let output = check(&[&broken]);
    assert_eq!(output.status.code(), Some(78));
    let summary = first["summary"].as_str().unwrap();
    insta::assert_snapshot!(format!("{summary}\n{}", errors(&folder, &output)));
}

#[test]
fn what_is_nothing_or_no_text_is_bad() {
    let folder = TempDir::new().unwrap();
    let empty = write(&folder, "empty.toml", "# nothing\n");
    let output = check(&[&empty]);
    assert_eq!(output.status.code(), Some(78));
    let mut told = errors(&folder, &output);
    assert_eq!(check(&["--kind", "service", &empty]).status.code(), Some(0));
    assert_eq!(check(&["--kind", "calibration", &empty]).status.code(), Some(78));

    for name in ["binary.toml", "binary.json5"] {
        let binary = folder.path().join(name);
        std::fs::write(&binary, [0x7f, b'E', 0xff, 0]).unwrap();
        let output = check(&[binary.to_str().unwrap()]);
        assert_eq!(output.status.code(), Some(78));
        told += &errors(&folder, &output);
    }
    insta::assert_snapshot!(told);
}

#[test]
fn streams_that_are_full_are_no_panic() {
    let full = || std::fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
    let isotherm = || Command::new(env!("CARGO_BIN_EXE_isotherm"));
    let good = config("service.toml");
    let unsaid = isotherm().args(["check", "/nonexistent"]).stderr(full()).status().unwrap();
    assert_eq!(unsaid.code(), Some(1));
    for arguments in [["check", &good], ["completions", "bash"]] {
        let unwritten = isotherm().args(arguments).stdout(full()).output().unwrap();
        assert_eq!(unwritten.status.code(), Some(1));
        assert_eq!(lines(&unwritten.stderr).len(), 1, "{unwritten:?}");
    }
}
