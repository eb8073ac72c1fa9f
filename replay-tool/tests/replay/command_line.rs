//! The program as it is called: exit codes, what goes to which stream, examples of the help.

use std::fs;
use std::path::Path;
use std::process::Output;

use crate::common::{check, replay, root, stdout};

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
    check(&replay(folder.path(), &args), 0, "");
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
    check(&output, 0, "");
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
    check(&output, 0, "mean rate");
    assert_eq!(stdout(&output).lines().count(), 201);
}

#[test]
fn wire_frames_hold_the_same_ticks() {
    use isotherm_protocol::{codec, corrected::CorrectedBatch};
    let folder = simulated();
    check(&correct(folder.path(), &["--out", "c.bin", "--format", "wire"]), 0, "");
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
    check(&correct(folder.path(), &["--navigation-ticks", "0"]), 2, "--navigation-ticks");
}

#[test]
fn every_end_has_its_exit_code() {
    let folder = simulated();
    let path = folder.path();
    check(&replay(path, &[]), 2, "Usage");
    check(&replay(path, &["play", "mems.csv", "-m", "mems.mapping.toml", "-u", "a b"]), 2, "unit \"a b\"");
    check(
        &replay(path, &["play", "mems.csv", "-m", "mems.mapping.toml", "-u", "a", "--speed", "fast"]),
        2,
        "must be max",
    );
    check(&replay(path, &["simulate", "--preset", "none", "--out", "x.csv"]), 2, "presets are zeeman-rest");
    check(
        &replay(path, &["play", "mems.csv", "mems.csv", "-m", "mems.mapping.toml", "-u", "a"]),
        2,
        "2 log files",
    );
    check(
        &replay(path, &["play", "none.csv", "-m", "mems.mapping.toml", "-u", "a"]),
        1,
        "none.csv: cannot open",
    );

    fs::write(path.join("bad.toml"), "version = 1\nfiles = 2\n").unwrap();
    let output = replay(path, &["play", "mems.csv", "-m", "bad.toml", "-u", "a"]);
    check(&output, 78, "bad.toml:2:1: files: is not a known key: did you mean `file`?");
    check(&output, 78, "bad.toml:1:1: file: is missing");
    let bad = ["correct", "mems.csv", "-m", "mems.mapping.toml", "-c", "bad.toml"];
    check(&replay(path, &bad), 78, "bad.toml:");
    fs::write(path.join("scenario.toml"), "unit = 5\n").unwrap();
    check(&replay(path, &["simulate", "scenario.toml", "--out", "x.csv"]), 78, "scenario.toml:1:8: ");
}

#[test]
fn rows_that_cannot_be_read_refuse_or_count() {
    let folder = simulated();
    let path = folder.path();
    let log = fs::read_to_string(path.join("mems.csv")).unwrap();
    let mut lines: Vec<_> = log.lines().map(str::to_owned).collect();
    lines[500] = lines[500].replacen(',', ";", 3);
    fs::write(path.join("mems.csv"), lines.join("\n") + "\n").unwrap();
    check(&correct(path, &[]), 1, "mems.csv:501:");

    let mapping = fs::read_to_string(path.join("mems.mapping.toml")).unwrap();
    let skip = mapping.replace("header = true", "header = true\non_bad_row = \"skip\"");
    fs::write(path.join("mems.mapping.toml"), skip).unwrap();
    let output = correct(path, &["--json"]);
    check(&output, 3, "");
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
    assert_eq!(presets.lines().count(), 6);
    for name in presets.lines().map(|line| line.split_whitespace().next().unwrap()) {
        let out = ["--out", "x.csv.gz", "--overwrite"];
        let preset = ["simulate", "--preset", name, "--duration", "1"];
        check(&replay(folder.path(), &[&preset[..], &out].concat()), 0, "");
        // What is printed is the same scenario.
        let bytes = fs::read(folder.path().join("x.csv.gz")).unwrap();
        let printed = replay(folder.path(), &["simulate", "--print-preset", name, "--duration", "1"]);
        fs::write(folder.path().join("mine.toml"), stdout(&printed)).unwrap();
        check(&replay(folder.path(), &[&["simulate", "mine.toml"], &out[..]].concat()), 0, "");
        assert_eq!(fs::read(folder.path().join("x.csv.gz")).unwrap(), bytes, "{name}");
    }
    let output = replay(folder.path(), &["simulate", "--print-preset", "none"]);
    check(&output, 2, "there is no preset \"none\"");
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
    check(&output, 0, "");
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
    for nothing in [["--start", "1000"], ["--topic", "x/**"]] {
        check(&replay(folder.path(), &[&text[..], &nothing].concat()), 1, "nothing was played");
    }
}

#[test]
fn no_output_is_written_over_an_input() {
    let folder = simulated();
    let path = folder.path();
    let before = fs::read(path.join("mems.csv")).unwrap();
    check(&correct(path, &["--out", "mems.csv"]), 2, "mems.csv would be overwritten");
    check(&correct(path, &["--out", "./mems.mapping.toml"]), 2, "would be overwritten");
    let simulate = ["simulate", "--preset", "mems-chamber", "--duration", "1", "--out", "x.csv", "--truth"];
    check(&replay(path, &[&simulate[..], &["x.csv"]].concat()), 2, "x.csv would be overwritten");
    check(&replay(path, &[&simulate[..], &["x.mapping.toml"]].concat()), 2, "would be overwritten");
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
    check(
        &replay(path, &[&["convert"], &log[..1], &["-u", "MEMS-0001", "--out", "raw.mcap"]].concat()),
        0,
        "",
    );
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
    for (arguments, name) in kept {
        let words = format!("{name} exists: give another name, or --overwrite");
        check(&replay(path, &arguments), 2, &words);
        assert!(fs::read(path.join(name)).unwrap() == b"mine", "{arguments:?}");
        assert!(!path.join("y.csv").exists(), "all is refused, not one file of several");
        check(&replay(path, &[&arguments[..], &["--overwrite"]].concat()), 0, "");
        assert!(fs::read(path.join(name)).unwrap() != b"mine", "{arguments:?}");
        fs::write(path.join(name), "mine").unwrap();
    }
    check(&correct(path, &["--out", "/dev/null"]), 0, "");
}

#[test]
fn ticks_that_the_calibration_refuses_are_a_loss() {
    let folder = simulated();
    let laser = fs::canonicalize(root().join("config/calibration/ZLG-0001.toml")).unwrap();
    let correct = ["correct", "mems.csv", "-m", "mems.mapping.toml", "-c", laser.to_str().unwrap()];
    check(&replay(folder.path(), &correct), 3, "ticks refused: counts where the calibration has means");
}

#[test]
fn limits_of_options_are_said_before_anything_is_opened() {
    let folder = simulated();
    let play = ["play", "mems.csv", "-m", "mems.mapping.toml", "-u", "a"];
    let with = |more: &[&str]| replay(folder.path(), &[&play[..], more].concat());
    check(&with(&["--in-flight", "5"]), 2, "--in-flight is 5, must be at least 258 with --batch 1");
    check(&with(&["--listen", "nonsense"]), 2, "nonsense");
    check(&with(&["--zenoh-config", "mems.csv"]), 78, "mems.csv");
    check(
        &replay(folder.path(), &["simulate", "--preset", "mems-chamber", "--out", "x.csv", "--duration=nan"]),
        2,
        "",
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
            "",
        );
        let out = format!("{unit}.mcap");
        check(&replay(folder.path(), &["convert", &name, "--unit", unit, "--out", &out]), 0, "");
    }
    let words = "ZLG-0001.mcap, MEMS-0001.mcap has no unit NIX; it has MEMS-0001, ZLG-0001\n";
    for (command, more) in [
        ("play", &["--speed", "max"][..]),
        ("correct", &[]),
        ("info", &[]),
        ("list", &[]),
        ("cat", &[]),
        ("step", &[]),
        ("plot", &["--out", "x.html"]),
        ("convert", &["--out", "x.csv"]),
    ] {
        let given = ["--unit", "ZLG-0001", "--unit", "NIX"];
        let args = [&[command, "ZLG-0001.mcap", "MEMS-0001.mcap"], more, &given].concat();
        let output = replay(folder.path(), &args);
        check(&output, 1, words);
        let errors = String::from_utf8_lossy(&output.stderr);
        assert_eq!((errors.lines().count(), stdout(&output)), (1, String::new()), "{command}: {errors}");
    }
    let output = replay(folder.path(), &["diff", "ZLG-0001.mcap", "MEMS-0001.mcap", "--unit", "ZLG-0001"]);
    check(&output, 1, "MEMS-0001.mcap has no unit ZLG-0001; it has MEMS-0001");
    assert!(!folder.path().join("x.html").exists() && !folder.path().join("x.csv").exists());
}
