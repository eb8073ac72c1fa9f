//! The program as it is called: exit codes, what goes to which stream, examples of the help.

use std::fs;
use std::os::unix::ffi::OsStrExt;
use std::path::Path;
use std::process::{Command, Output, Stdio};

use crate::common::{self, check, replay, root, stderr, stdout, told};

/// A folder with a simulated log of ten seconds.
fn simulated() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let args = [
        "simulate",
        "--preset",
        "mems-chamber",
        "--duration",
        "10",
        "--out",
        "mems.csv",
        "--truth",
        "truth.csv",
    ];
    check(&replay(folder.path(), &args), 0);
    folder
}

/// The calibration document for it.
fn calibration() -> String {
    root().join("config/calibration/MEMS-0001.toml").display().to_string()
}

/// `correct` with further arguments.
fn correct(folder: &Path, more: &[&str]) -> Output {
    let calibration = calibration();
    let mut args =
        vec!["correct", "mems.csv", "--mapping", "mems.mapping.toml", "--calibration", &calibration];
    args.extend(more);
    replay(folder, &args)
}

#[test]
fn a_simulated_log_is_corrected_and_summed_up() {
    let folder = simulated();
    let output = correct(folder.path(), &["--out", "corrected.csv", "--json"]);
    check(&output, 0);
    let summary: serde_json::Value = serde_json::from_str(&stdout(&output)).unwrap();
    assert_eq!((summary["ticks"].as_u64(), summary["missed_ticks"].as_u64()), (Some(1000), Some(0)));
    assert_eq!(summary["log"]["skipped_rows"], 0);
    // From the text: serde_json's own reading of a number may be off by its last bit.
    let printed = stdout(&output);
    let forces =
        printed.split("\"mean_specific_force_m_per_s2\":[").nth(1).unwrap().split(']').next().unwrap();
    let force: f64 = forces.split(',').nth(2).unwrap().parse().unwrap();
    assert!((force.abs() - 9.8).abs() < 0.1, "{force}");

    let csv = fs::read_to_string(folder.path().join("corrected.csv")).unwrap();
    let mut lines = csv.lines();
    let header: Vec<_> = lines.next().unwrap().split(',').collect();
    assert_eq!((header.len(), header[5]), (20, "delta_angle_x_rad"));
    let sum: f64 = lines.map(|line| line.split(',').nth(10).unwrap().parse::<f64>().unwrap()).sum();
    assert_eq!((sum / 10.0).to_bits(), force.to_bits(), "the file holds what the summary sums, to the bit");
    assert_eq!(fs::read_to_string(folder.path().join("truth.csv")).unwrap().lines().count(), 1001);
}

#[test]
fn standard_output_holds_the_ticks_alone() {
    let folder = simulated();
    let output = correct(folder.path(), &["--out", "-", "--duration", "2"]);
    check(&output, 0);
    assert!(!output.stderr.is_empty(), "the summary");
    assert_eq!(stdout(&output).lines().count(), 201);
}

#[test]
fn wire_frames_hold_the_same_ticks() {
    use isotherm_protocol::{codec, corrected::CorrectedBatch};
    let folder = simulated();
    check(&correct(folder.path(), &["--out", "c.bin", "--format", "wire"]), 0);
    let bytes = fs::read(folder.path().join("c.bin")).unwrap();
    let (mut rest, mut sequence) = (bytes.as_slice(), 0);
    while let Some((length, after)) = rest.split_first_chunk() {
        let (frame, after) = after.split_at(u32::from_le_bytes(*length) as usize);
        let batch: CorrectedBatch = codec::decode(frame).unwrap();
        for tick in &batch.ticks {
            assert_eq!(tick.sequence, sequence);
            sequence += 1;
        }
        rest = after;
    }
    assert_eq!(sequence, 1000);
}

#[test]
fn navigation_steps_are_those_of_the_service() {
    let folder = simulated();
    let output = correct(folder.path(), &["--navigation-ticks", "10", "--coning-sculling", "--json"]);
    let summary: serde_json::Value = serde_json::from_str(&stdout(&output)).unwrap();
    assert_eq!((summary["ticks"].as_u64(), summary["outputs"].as_u64()), (Some(1000), Some(100)));
    let output = correct(folder.path(), &["--navigation-ticks", "0"]);
    check(&output, 2);
    assert!(stderr(&output).contains("--navigation-ticks"));
}

#[test]
fn every_end_has_its_exit_code() {
    let folder = simulated();
    let path = folder.path();
    let output = replay(path, &[]);
    check(&output, 2);
    assert!(stderr(&output).contains("Usage"));
    fs::write(path.join("bad.toml"), "version = 1\nfiles = 2\n").unwrap();
    fs::write(path.join("scenario.toml"), "unit = 5\n").unwrap();
    let ended = [
        &["play", "mems.csv", "-m", "mems.mapping.toml", "-u", "a b"][..],
        &["play", "mems.csv", "-m", "mems.mapping.toml", "-u", "a", "--speed", "fast"],
        &["simulate", "--preset", "none", "--out", "x.csv"],
        &["play", "mems.csv", "mems.csv", "-m", "mems.mapping.toml", "-u", "a"],
        &["play", "none.csv", "-m", "mems.mapping.toml", "-u", "a"],
        &["play", "mems.csv", "-m", "bad.toml", "-u", "a"],
        &["correct", "mems.csv", "-m", "mems.mapping.toml", "-c", "bad.toml"],
        &["simulate", "scenario.toml", "--out", "x.csv"],
    ];
    insta::assert_snapshot!(ended.map(|args| told(path, args)).concat());
}

#[test]
fn rows_that_cannot_be_read_refuse_or_count() {
    let folder = simulated();
    let path = folder.path();
    let log = fs::read_to_string(path.join("mems.csv")).unwrap();
    let mut lines: Vec<_> = log.lines().map(str::to_owned).collect();
    lines[500] = lines[500].replacen(',', ";", 3);
    fs::write(path.join("mems.csv"), lines.join("\n") + "\n").unwrap();
    let output = correct(path, &[]);
    check(&output, 1);
    insta::assert_snapshot!(stderr(&output));

    let mapping = fs::read_to_string(path.join("mems.mapping.toml")).unwrap();
    let skip = mapping.replace("header = true", "header = true\non_bad_row = \"skip\"");
    fs::write(path.join("mems.mapping.toml"), skip).unwrap();
    let output = correct(path, &["--json"]);
    check(&output, 3);
    let summary: serde_json::Value = serde_json::from_str(&stdout(&output)).unwrap();
    assert_eq!((summary["ticks"].as_u64(), summary["missed_ticks"].as_u64()), (Some(999), Some(1)));
    assert_eq!(summary["log"]["skipped_rows"], 1);
}

#[test]
fn completions_and_presets_go_to_standard_output() {
    let folder = tempfile::tempdir().unwrap();
    for shell in ["bash", "zsh", "fish"] {
        assert!(stdout(&replay(folder.path(), &["completions", shell])).contains("isotherm-replay"));
    }
    let presets = stdout(&replay(folder.path(), &["simulate", "--list-presets"]));
    assert_eq!(presets.lines().count(), 7);
    for name in presets.lines().map(|line| line.split_whitespace().next().unwrap()) {
        let out = ["--out", "x.csv.gz", "--overwrite"];
        let preset = ["simulate", "--preset", name, "--duration", "1"];
        check(&replay(folder.path(), &[&preset[..], &out].concat()), 0);
        // What is printed is the same scenario.
        let bytes = fs::read(folder.path().join("x.csv.gz")).unwrap();
        let printed = replay(folder.path(), &["simulate", "--print-preset", name, "--duration", "1"]);
        fs::write(folder.path().join("mine.toml"), stdout(&printed)).unwrap();
        check(&replay(folder.path(), &[&["simulate", "mine.toml"], &out[..]].concat()), 0);
        assert_eq!(fs::read(folder.path().join("x.csv.gz")).unwrap(), bytes, "{name}");
    }
    insta::assert_snapshot!(told(folder.path(), &["simulate", "--print-preset", "none"]));
}

/// The example of the page on scenarios.
#[test]
fn the_scenario_of_the_page_runs() {
    let page = include_str!("../../../docs/scenario.md");
    let example = page.split("```toml\n").nth(1).unwrap().split("```").next().unwrap();
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("mine.toml"), example).unwrap();
    let short = ["simulate", "mine.toml", "--duration", "2", "--out", "mine.csv", "--json"];
    let output = replay(folder.path(), &short);
    check(&output, 0);
    let made: serde_json::Value = serde_json::from_str(&stdout(&output)).unwrap();
    assert_eq!((made["unit"].as_str(), made["ticks"].as_u64()), (Some("MINE-0001"), Some(200)));
}

#[test]
fn playing_needs_a_service_unless_told_otherwise() {
    let folder = simulated();
    let output = replay(
        folder.path(),
        &["play", "mems.csv", "-m", "mems.mapping.toml", "-u", "MEMS-0001", "--connect", "tcp/127.0.0.1:1"],
    );
    assert_eq!(output.status.code(), Some(1), "{}", String::from_utf8_lossy(&output.stderr));
}

#[test]
fn playing_nothing_fails() {
    let folder = simulated();
    let text = ["play", "mems.csv", "-u", "MEMS-0001", "--no-acknowledge", "--listen", "127.0.0.1:0"];
    let nothing = [["--start", "1000"], ["--topic", "x/**"]];
    let told = nothing.map(|none| told(folder.path(), &[&text[..], &none].concat()));
    insta::assert_snapshot!(told.concat());
}

#[test]
fn no_output_is_written_over_an_input() {
    let folder = simulated();
    let path = folder.path();
    let before = fs::read(path.join("mems.csv")).unwrap();
    let mut told = String::new();
    for out in ["mems.csv", "./mems.mapping.toml"] {
        let output = correct(path, &["--out", out]);
        check(&output, 2);
        told += &stderr(&output);
    }
    let simulate = ["simulate", "--preset", "mems-chamber", "--duration", "1", "--out", "x.csv", "--truth"];
    for truth in ["x.csv", "x.mapping.toml"] {
        told += &common::told(path, &[&simulate[..], &[truth]].concat());
    }
    told += &common::told(path, &["import", "mems.csv", "--out", "y.html", "--plot", "y.html"]);
    insta::assert_snapshot!(told);
    assert_eq!(fs::read(path.join("mems.csv")).unwrap(), before);
    assert!(!path.join("x.csv").exists());
}

#[test]
fn what_is_there_already_is_kept_unless_it_may_be_replaced() {
    let folder = simulated();
    let path = folder.path();
    let calibration = calibration();
    let log = ["mems.csv", "-c", &calibration];
    for name in ["x.csv", "x.mcap", "x.html", "z.mapping.toml"] {
        fs::write(path.join(name), "mine").unwrap();
    }
    fs::create_dir(path.join("units")).unwrap();
    check(&replay(path, &[&["convert"], &log[..1], &["-u", "MEMS-0001", "--out", "raw.mcap"]].concat()), 0);
    fs::write(path.join("units/MEMS-0001.csv"), "mine").unwrap();
    let preset = ["simulate", "--preset", "mems-chamber", "--duration", "1"];
    let kept: [(Vec<&str>, &str); 7] = [
        ([&["correct"], &log[..], &["--out", "x.csv"]].concat(), "x.csv"),
        ([&["correct"], &log[..], &["--out", "x.mcap"]].concat(), "x.mcap"),
        (["correct", "raw.mcap", "-c", &calibration, "--out", "units/"].to_vec(), "units/MEMS-0001.csv"),
        ([&["plot"], &log[..], &["--out", "x.html"]].concat(), "x.html"),
        ([&preset[..], &["--out", "x.csv"]].concat(), "x.csv"),
        // A log whose mapping would replace another one, or its truth.
        ([&preset[..], &["--out", "z.csv"]].concat(), "z.mapping.toml"),
        ([&preset[..], &["--out", "y.csv", "--truth", "x.html"]].concat(), "x.html"),
    ];
    let mut told = String::new();
    for (arguments, name) in kept {
        let output = replay(path, &arguments);
        check(&output, 2);
        told += &stderr(&output);
        assert!(fs::read(path.join(name)).unwrap() == b"mine", "{arguments:?}");
        assert!(!path.join("y.csv").exists(), "all is refused, not one file of several");
        check(&replay(path, &[&arguments[..], &["--overwrite"]].concat()), 0);
        assert!(fs::read(path.join(name)).unwrap() != b"mine", "{arguments:?}");
        fs::write(path.join(name), "mine").unwrap();
    }
    insta::assert_snapshot!(told);
    check(&correct(path, &["--out", "/dev/null"]), 0);
}

#[test]
fn ticks_that_the_calibration_refuses_are_a_loss() {
    let folder = simulated();
    let laser = fs::canonicalize(root().join("config/calibration/ZLG-0001.toml")).unwrap();
    let correct = ["correct", "mems.csv", "-m", "mems.mapping.toml", "-c", laser.to_str().unwrap()];
    let all = told(folder.path(), &correct).replace(laser.to_str().unwrap(), "ZLG-0001.toml");
    // All gyro ticks are corrected by a document without accelerometers.
    let document = fs::read_to_string(calibration()).unwrap();
    fs::write(folder.path().join("gyros.toml"), document.split("\n[accel]").next().unwrap()).unwrap();
    let accels = ["correct", "mems.csv", "-m", "mems.mapping.toml", "-c", "gyros.toml", "--out", "out.csv"];
    let accels = told(folder.path(), &accels);
    // So of a recording, and into one.
    let laser = fs::read_to_string(laser).unwrap().replace("\"ZLG-0001\"", "\"MEMS-0001\"");
    fs::write(folder.path().join("laser.toml"), laser).unwrap();
    check(&replay(folder.path(), &["convert", "mems.csv", "-u", "MEMS-0001", "--out", "mems.mcap"]), 0);
    let of_recordings = [
        &["correct", "mems.mcap", "-c", "laser.toml"][..],
        &["correct", "mems.csv", "-c", "laser.toml", "--out", "out.mcap"],
    ];
    insta::assert_snapshot!(all + &accels + &of_recordings.map(|args| told(folder.path(), args)).concat());
}

#[test]
fn what_nobody_reads_any_more_ends_a_command_and_a_full_disk_fails_it() {
    let folder = simulated();
    let calibration = calibration();
    let program = || {
        let mut program = Command::new(env!("CARGO_BIN_EXE_isotherm-replay"));
        program.current_dir(folder.path()).stderr(Stdio::piped());
        program
    };
    for arguments in [
        &["correct", "mems.csv", "-c", &calibration, "--out", "-"][..],
        &["step", "mems.csv", "-c", &calibration, "--json"],
        &["cat", "mems.csv"],
    ] {
        let mut child = program().args(arguments).stdout(Stdio::piped()).spawn().unwrap();
        drop(child.stdout.take());
        let output = child.wait_with_output().unwrap();
        check(&output, 0);
        assert_eq!(stderr(&output), "", "{arguments:?}");
    }
    for arguments in [&["--help"][..], &["list", "mems.csv"], &["cat", "mems.csv"]] {
        let full = fs::File::options().write(true).open("/dev/full").unwrap();
        check(&program().args(arguments).stdout(full).output().unwrap(), 1);
    }
}

#[test]
fn names_that_are_no_text_or_move_the_cursor_do_no_harm() {
    let folder = tempfile::tempdir().unwrap();
    let no_text = std::ffi::OsStr::from_bytes(b"\xff.csv");
    let program = env!("CARGO_BIN_EXE_isotherm-replay");
    let output = Command::new(program).args(["info".as_ref(), no_text, "--nonsense".as_ref()]).output();
    check(&output.unwrap(), 2);
    let short = ["simulate", "--preset", "mems-chamber", "--duration", "1", "--out", "\u{1b}[2J.csv"];
    let output = replay(folder.path(), &short);
    check(&output, 0);
    assert!(stdout(&output).contains("\\u001b[2J.csv") && !stdout(&output).contains('\u{1b}'));
}

#[test]
fn limits_of_options_are_said_before_anything_is_opened() {
    let folder = simulated();
    let play = ["play", "mems.csv", "-m", "mems.mapping.toml", "-u", "a"];
    let wrong = [["--in-flight", "5"], ["--listen", "nonsense"], ["--zenoh-config", "mems.csv"]];
    let told = wrong.map(|more| told(folder.path(), &[&play[..], &more].concat()));
    insta::assert_snapshot!(told.concat());
    check(
        &replay(folder.path(), &["simulate", "--preset", "mems-chamber", "--out", "x.csv", "--duration=nan"]),
        2,
    );
}

#[test]
fn a_unit_that_a_recording_does_not_have_is_said_with_those_that_it_has() {
    let folder = tempfile::tempdir().unwrap();
    for (unit, preset) in [("ZLG-0001", "zeeman-sine"), ("MEMS-0001", "mems-chamber")] {
        let name = format!("{unit}.csv");
        check(
            &replay(folder.path(), &["simulate", "--preset", preset, "--duration", "2", "--out", &name]),
            0,
        );
        let out = format!("{unit}.mcap");
        check(&replay(folder.path(), &["convert", &name, "--unit", unit, "--out", &out]), 0);
    }
    let told = [
        ("play", &["--speed", "max"][..]),
        ("correct", &[]),
        ("info", &[]),
        ("list", &[]),
        ("cat", &[]),
        ("step", &[]),
        ("plot", &["--out", "x.html"]),
        ("convert", &["--out", "x.csv"]),
        ("diff", &[]),
    ]
    .map(|(command, more)| {
        let unit = if command == "diff" {
            &["--unit", "ZLG-0001"][..]
        } else {
            &["--unit", "ZLG-0001", "--unit", "NIX"]
        };
        told(folder.path(), &[&[command, "ZLG-0001.mcap", "MEMS-0001.mcap"], more, unit].concat())
    });
    insta::assert_snapshot!(told.concat());
    assert!(!folder.path().join("x.html").exists() && !folder.path().join("x.csv").exists());
}

#[test]
fn a_signal_leaves_nothing_behind_that_is_not_whole() {
    let folder = tempfile::tempdir().unwrap();
    let arguments = ["simulate", "--preset", "mems-chamber", "--duration", "10000000", "--out", "long.csv"];
    let mut child = Command::new(env!("CARGO_BIN_EXE_isotherm-replay"))
        .current_dir(folder.path())
        .args(arguments)
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    while !folder.path().join("long.csv.partial").exists() {
        assert_eq!(child.try_wait().unwrap(), None);
        std::thread::yield_now();
    }
    let asked = Command::new("kill").args(["-INT", &child.id().to_string()]).status();
    assert!(asked.unwrap().success());
    assert_eq!(child.wait().unwrap().code(), Some(1));
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
}
