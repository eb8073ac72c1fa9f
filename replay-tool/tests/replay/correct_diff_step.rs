//! `correct` of recordings, `diff` and `step` as they are called.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;
use std::process::Output;

use isotherm_log::mapping::Mapping;
use isotherm_log::offline::unit_id;
use isotherm_log::part::{LogFiles, Part};
use isotherm_log::recording::{RecordingOptions, RecordingWriter};
use serde_json::Value;

use crate::common::{replay, root, told};

fn stdout(output: &Output) -> String {
    String::from_utf8(output.stdout.clone()).unwrap()
}

/// Checks the exit code; what was said on stderr.
fn ended(output: &Output, code: i32) -> String {
    let errors = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(code), "{}\n{errors}", stdout(output));
    errors
}

fn document() -> String {
    fs::read_to_string(root().join("config/calibration/MEMS-0001.toml")).unwrap()
}

/// A folder with a simulated log of twenty seconds, as text and as a recording of raw messages, and its document.
fn simulated() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let args = ["simulate", "--preset", "mems-chamber", "--duration", "20", "--out", "mems.csv"];
    ended(&replay(folder.path(), &args), 0);
    fs::write(folder.path().join("mems.toml"), document()).unwrap();
    let files = LogFiles::Text {
        paths: vec![folder.path().join("mems.csv")],
        mapping: Box::new(Mapping::load(&folder.path().join("mems.mapping.toml")).unwrap()),
        unit: unit_id("MEMS-0001").unwrap(),
        batch_ticks: 7,
    };
    let mut messages = files.open(&Part::default()).unwrap();
    let path = folder.path().join("raw.mcap");
    let mut writer = RecordingWriter::create(&path, RecordingOptions::default()).unwrap();
    while let Some(message) = messages.next_message().unwrap() {
        writer.write(&message).unwrap();
    }
    writer.finish().unwrap();
    folder
}

/// `correct` of the text log with a document, to a file.
fn correct(folder: &Path, document: &str, out: &str) {
    let args =
        ["correct", "mems.csv", "--mapping", "mems.mapping.toml", "--calibration", document, "--out", out];
    ended(&replay(folder, &args), 0);
}

#[test]
fn one_coefficient_changed_in_its_last_digit_is_found_at_the_first_tick_that_it_changes() {
    let folder = simulated();
    let from = "coefficients_deg_per_h = [90.0,";
    let text = document();
    assert!(text.contains(from));
    fs::write(
        folder.path().join("b.toml"),
        text.replacen(from, "coefficients_deg_per_h = [90.00000000000001,", 1),
    )
    .unwrap();
    correct(folder.path(), "mems.toml", "a.csv");
    correct(folder.path(), "b.toml", "b.csv");
    let rows = |name: &str| -> Vec<String> {
        let text = fs::read_to_string(folder.path().join(name)).unwrap();
        text.lines().skip(1).map(str::to_owned).collect()
    };
    let (a, b) = (rows("a.csv"), rows("b.csv"));
    let different = a.iter().zip(&b).filter(|(a, b)| a != b).count();
    let first = a.iter().zip(&b).position(|(a, b)| a != b).expect("some tick changes");

    let output = replay(folder.path(), &["diff", "a.csv", "b.csv", "--json"]);
    ended(&output, 1);
    let report: Value = serde_json::from_str(&stdout(&output)).unwrap();
    let account = &report["units"]["unit"];
    assert_eq!(account["different"], different);
    assert_eq!(account["first"]["sequence"], first);
    let field = &account["first"]["fields"][0];
    assert_eq!(field["field"], "delta_angle_x_rad");
    let cell = |row: &str| row.split(',').nth(5).unwrap().to_owned();
    assert_eq!((&field["a"], &field["b"]), (&Value::from(cell(&a[first])), &Value::from(cell(&b[first]))));
    assert!(
        field["a_bits"].as_str().unwrap().starts_with("0x") && field["equivalent"]["deg_per_h"].is_number()
    );

    let output = replay(folder.path(), &["diff", "a.csv", "b.csv", "--around", "2"]);
    ended(&output, 1);
    assert!(!stdout(&output).contains("unit unit"));
    insta::assert_snapshot!(stdout(&output));
    let allowed = ["diff", "a.csv", "b.csv", "--tolerance-angle", "1e-12"];
    let output = replay(folder.path(), &allowed);
    ended(&output, 0);
    assert!(!stdout(&output).contains("identical"), "{}", stdout(&output));
    let output = replay(folder.path(), &[&allowed[..], &["--json"]].concat());
    let report: Value = serde_json::from_str(&stdout(&output)).unwrap();
    assert_eq!((&report["identical"], &report["within_tolerance"]), (&false.into(), &true.into()));
    assert_eq!(report["units"]["unit"]["within_tolerance"], different);
    // A CSV of raw ticks.
    ended(&replay(folder.path(), &["diff", "a.csv", "mems.csv"]), 1);
    let output = replay(folder.path(), &["diff", "a.csv", "a.csv", "--json"]);
    ended(&output, 0);
    let report: Value = serde_json::from_str(&stdout(&output)).unwrap();
    assert_eq!(report["units"]["unit"]["different"], 0);
}

#[test]
fn units_that_nothing_is_known_of_are_left_out_and_the_others_corrected() {
    let folder = simulated();
    let text = Mapping::load(&folder.path().join("mems.mapping.toml")).unwrap();
    let serials: Vec<String> = (0..40).map(|number| format!("BARE-{number}")).collect();
    let mut writer =
        RecordingWriter::create(&folder.path().join("many.mcap"), RecordingOptions::default()).unwrap();
    let units = serials.iter().map(String::as_str).chain(["MEMS-0001"]);
    for unit in units {
        let files = LogFiles::Text {
            paths: vec![folder.path().join("mems.csv")],
            mapping: Box::new(text.clone()),
            unit: isotherm_protocol::key::UnitId::new(unit).unwrap(),
            batch_ticks: 64,
        };
        let mut messages = files.open(&Part::default()).unwrap();
        while let Some(message) = messages.next_message().unwrap() {
            writer.write(&message).unwrap();
        }
    }
    writer.finish().unwrap();
    let many = ["correct", "many.mcap", "--calibration", "mems.toml", "--out", "many.csv"];
    let left_out = ended(&replay(folder.path(), &many), 3);
    correct(folder.path(), "mems.toml", "text.csv");
    ended(&replay(folder.path(), &["diff", "text.csv", "many.csv"]), 0);
    // One that is asked for by name must be there.
    insta::assert_snapshot!(left_out + &told(folder.path(), &["correct", "many.mcap", "--unit", "BARE-3"]));
}

#[test]
fn a_recording_of_raw_messages_is_corrected_with_a_document_as_its_text_is() {
    let folder = simulated();
    correct(folder.path(), "mems.toml", "text.csv");
    let raw = |more: &[&str]| {
        let args = ["correct", "raw.mcap"].into_iter().chain(more.iter().copied()).collect::<Vec<_>>();
        replay(folder.path(), &args)
    };
    insta::assert_snapshot!(ended(&raw(&[]), 2));
    for (out, file) in
        [("raw.csv", "raw.csv"), ("folder/", "folder/MEMS-0001.csv"), ("made.mcap", "made.mcap")]
    {
        let output = raw(&["--calibration", "mems.toml", "--out", out]);
        ended(&output, 0);
        assert!(stdout(&output).contains("2000"), "{}", stdout(&output));
        let output = replay(folder.path(), &["diff", "text.csv", file]);
        ended(&output, 0);
    }
    // Of a text log too.
    let log = [
        "correct",
        "mems.csv",
        "--mapping",
        "mems.mapping.toml",
        "--calibration",
        "mems.toml",
        "--out",
        "of-text.mcap",
    ];
    ended(&replay(folder.path(), &log), 0);
    ended(&replay(folder.path(), &["diff", "text.csv", "of-text.mcap"]), 0);
    // Either is drawn beside the log.
    let plot = [
        "plot",
        "mems.csv",
        "--mapping",
        "mems.mapping.toml",
        "--calibration",
        "mems.toml",
        "--json",
        "--out",
    ];
    let output = replay(folder.path(), &[&plot[..], &["both.html", "--beside", "text.csv"]].concat());
    ended(&output, 0);
    let summary: Value = serde_json::from_str(&stdout(&output)).unwrap();
    let difference = &summary["differences"]["log"];
    let ticks = (difference["common_ticks"].as_u64(), difference["differing_ticks"].as_u64());
    assert_eq!(ticks, (Some(2000), Some(0)), "{summary}");
    let wire = raw(&["--calibration", "mems.toml", "--format", "wire", "--out", "raw.wire"]);
    ended(&wire, 0);
    ended(&replay(folder.path(), &["diff", "made.mcap", "raw.wire"]), 0);
    // The document went along.
    let mut reader = isotherm_log::recording::RecordingReader::open(
        &[folder.path().join("made.mcap")],
        std::sync::Arc::default(),
    )
    .unwrap();
    while reader.next_message().unwrap().is_some() {}
    let attached: BTreeSet<_> = reader.take_attachments().into_iter().map(|file| file.bytes).collect();
    assert_eq!(attached, BTreeSet::from([document().into_bytes()]));
}

#[test]
fn a_part_is_corrected_as_in_the_whole() {
    let folder = simulated();
    correct(folder.path(), "mems.toml", "whole.csv");
    let told = |args: &[&str], code: i32| -> Value {
        let part = ["--calibration", "mems.toml", "--start", "5", "--duration", "3"];
        let part = if args[0] == "diff" { &[][..] } else { &part };
        let output = replay(folder.path(), &[args, part, &["--json"]].concat());
        ended(&output, code);
        serde_json::from_str(&stdout(&output)).unwrap()
    };
    for (log, out, least) in
        [("mems.csv", "part.csv", 300), ("mems.csv", "part.mcap", 300), ("raw.mcap", "part-of-raw.csv", 290)]
    {
        told(&["correct", log, "--out", out], 0);
        let summary = told(&["diff", "whole.csv", out], 1);
        let account = summary["units"].as_object().unwrap().values().next().unwrap();
        assert!(account["ticks"].as_u64().unwrap() >= least, "{out}: {summary}");
        assert_eq!(account["different"], 0, "{out}: {summary}");
    }
    let page = told(&["plot", "mems.csv", "--beside", "whole.csv", "--out", "part.html"], 0);
    let difference = &page["differences"]["log"];
    assert!(difference["common_ticks"].as_u64().unwrap() >= 299, "{page}");
    assert_eq!(difference["differing_ticks"], 0, "{page}");
    // What comes before it has been gone through.
    let first = told(&["step", "mems.csv", "--from", "0", "--count", "1"], 0);
    assert!(first["number"].as_u64().unwrap() > 1000, "{first}");
}

#[test]
fn what_does_not_go_together_is_refused() {
    let folder = simulated();
    fs::write(folder.path().join("other.toml"), document().replace("MEMS-0001", "MEMS-0002")).unwrap();
    let header = fs::read_to_string(folder.path().join("mems.csv")).unwrap();
    fs::write(folder.path().join("empty.csv"), header.lines().next().unwrap()).unwrap();
    let text = ["mems.csv", "--mapping", "mems.mapping.toml"];
    let refused = [
        &["correct", text[0], text[1], text[2]][..],
        &["correct", text[0], text[1], text[2], "--calibration", "mems.toml", "--ignore-swaps"],
        &["correct", "mems.csv", "--calibration", "mems.toml", "--unit", "MEMS-0002"],
        &["correct", "mems.csv", "--calibration", "mems.toml", "--unit", "MEMS-0002", "--out", "other.mcap"],
        &["plot", "mems.csv", "--calibration", "mems.toml", "--unit", "MEMS-0002", "--out", "other.html"],
        &["step", "mems.csv", "--calibration", "mems.toml", "--unit", "MEMS-0002"],
        &["correct", "empty.csv", "--mapping", text[2], "--calibration", "mems.toml", "--out", "none.csv"],
        &["correct", "empty.csv", "--mapping", text[2], "--calibration", "mems.toml", "--out", "none.mcap"],
        &["plot", "empty.csv", "--mapping", text[2], "--calibration", "mems.toml", "--out", "none.html"],
        &["correct", "raw.mcap", "--calibration", "other.toml"],
        &["correct", "raw.mcap", "--calibration", "mems.toml", "--calibration", "mems.toml"],
        &["correct", "raw.mcap", "--mapping", "mems.mapping.toml"],
        &["correct", "raw.mcap", "--calibration", "mems.toml", "--out", "raw.mcap"],
        &["diff", "raw.mcap", "raw.mcap"],
        &["step", "raw.mcap"],
        &["step", "raw.mcap", "--calibration", "other.toml"],
        &["step", "mems.csv", "--calibration", "mems.toml", "--from", "2000"],
        &["step", "mems.csv", "--calibration", "mems.toml", "--start", "100"],
        &["cat", "mems.csv", "--topic", "imu/NOPE/**"],
    ];
    insta::assert_snapshot!(refused.map(|args| told(folder.path(), args)).concat());
    for name in ["none.csv", "none.mcap", "none.html"] {
        assert!(!folder.path().join(name).exists(), "{name}");
    }
}

#[test]
fn events_are_stepped_through_one_by_one() {
    let folder = simulated();
    let step = |more: &[&str]| {
        let args = ["step", "mems.csv", "--mapping", "mems.mapping.toml", "--calibration", "mems.toml"];
        let output = replay(folder.path(), &args.into_iter().chain(more.iter().copied()).collect::<Vec<_>>());
        ended(&output, 0);
        stdout(&output)
    };
    insta::assert_snapshot!(step(&["--from", "100", "--count", "1"]));
    let lines = step(&["--json"]);
    let events: Vec<Value> = lines.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let frames = events.iter().filter(|event| event["what"]["kind"] == "frame").count();
    assert!(frames >= 4000, "{frames}");
    let sequences: Vec<u64> = events
        .iter()
        .flat_map(|event| event["out"].as_array().unwrap())
        .map(|tick| tick["sequence"].as_u64().unwrap())
        .collect();
    assert!(sequences.iter().copied().eq(0..2000), "every tick once, in order");
    let numbers = events.iter().map(|event| event["number"].as_u64().unwrap());
    assert!(numbers.eq(1..=events.len() as u64));
    let recording =
        ["step", "raw.mcap", "--calibration", "mems.toml", "--from", "50", "--count", "2", "--json"];
    let output = replay(folder.path(), &recording);
    ended(&output, 0);
    let first: Value = serde_json::from_str(stdout(&output).lines().next().unwrap()).unwrap();
    assert_eq!(
        (&first["what"]["first_sequence"], &first["what"]["ticks"]),
        (&Value::from(49), &Value::from(7))
    );
}
