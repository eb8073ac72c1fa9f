//! `thermal` as its user calls it: logs in files, folders and recordings.

use std::path::Path;
use std::process::{Command, Output};
use std::time::SystemTime;

use isotherm_calibration::document::Written;
use isotherm_correction::thermal::Feature;
use isotherm_correction::units::Span;
use isotherm_log::part::{LogFiles, Part};
use isotherm_log::recording::{RecordingOptions, RecordingWriter};
use isotherm_protocol::history::WallTime;

use super::service::text_log;
use crate::command::ended;

fn calibrate(folder: &Path, args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_isotherm-calibrate")).current_dir(folder).args(args).output().unwrap()
}

/// What the command says, with its exit code.
fn said(folder: &Path, args: &[&str]) -> String {
    ended(&calibrate(folder, &[&["thermal"], args].concat()))
}

/// A part of the text log as a recording.
fn record(log: &Path, mapping: &isotherm_log::mapping::Mapping, unit: &str, part: [f64; 2], out: &Path) {
    let unit = isotherm_log::offline::unit_id(unit).unwrap();
    let mapping = Box::new(mapping.clone());
    let files = LogFiles::Text { paths: vec![log.to_path_buf()], mapping, unit, batch_ticks: 64 };
    let [start, end] = part.map(Span::from_s);
    let mut messages = files.open(&Part { start, end: Some(end), ..Part::default() }).unwrap();
    let mut writer =
        RecordingWriter::create(out, RecordingOptions { chunk_bytes: 20_000, ..RecordingOptions::default() })
            .unwrap();
    while let Some(message) = messages.next_message().unwrap() {
        writer.write(&message).unwrap();
    }
    writer.finish().unwrap();
}

/// The date (UTC).
fn today() -> String {
    WallTime::from(SystemTime::now()).to_string()[..10].to_owned()
}

#[test]
fn folders_recordings_and_several_units() {
    let began = today();
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let (log, mapping) = text_log(at);
    let text = ["--mapping", "mapping.toml", "--unit", "UNIT"];
    let with = |more: &[&'static str]| [more, &text].concat();

    // A folder of a text log is the log, and its digest that of its files.
    std::fs::create_dir(at.join("chamber")).unwrap();
    std::fs::copy(&log, at.join("chamber/log.csv")).unwrap();
    for (log, out) in [("chamber", "of-folder.toml"), ("log.csv", "of-file.toml")] {
        let done = calibrate(at, &with(&["thermal", log, "--out", out]));
        assert!(done.status.success(), "{}", ended(&done));
    }
    let read = |name: &str| std::fs::read_to_string(at.join(name)).unwrap();
    let curve = |text: &str| text[text.find("[[gyro.sensor]]").unwrap()..].to_owned();
    assert_eq!(curve(&read("of-folder.toml")), curve(&read("of-file.toml")));
    let document = |name: &str| Written::read(&at.join(name)).unwrap().document;
    let logs = |name: &str| document(name).origin.unwrap().log.into_iter().map(|log| log.name);
    assert!(logs("of-folder.toml").eq(["chamber"]));

    // Nobody has said which unit a text log is of.
    let mut told = said(at, &["log.csv", "--mapping", "mapping.toml", "--out", "of-whom.toml"]);
    assert!(!at.join("of-whom.toml").exists());
    // A document says when it was made: today, or as it is told.
    let created = |name: &str| document(name).created.unwrap().to_string();
    assert!((began.clone()..=today()).contains(&created("of-file.toml")), "{}", created("of-file.toml"));
    let old = ["log.csv", "--calibration", "of-file.toml", "--created", "2024-02-29", "--out", "old.toml"];
    said(at, &with(&old));
    assert_eq!(created("old.toml"), "2024-02-29");
    let args = ["log.csv", "--calibration", "old.toml", "--mapping", "mapping.toml", "--out", "new.toml"];
    said(at, &args);
    assert!((began..=today()).contains(&created("new.toml")), "it is a new one");

    // So is a folder with a recording in pieces.
    std::fs::create_dir(at.join("pieces")).unwrap();
    record(&log, &mapping, "A", [0.0, 2000.0], &at.join("pieces/run-9.mcap"));
    record(&log, &mapping, "A", [2000.0, 1e6], &at.join("pieces/run-10.mcap"));
    record(&log, &mapping, "A", [0.0, 1e6], &at.join("whole.mcap"));
    record(&log, &mapping, "B", [0.0, 1e6], &at.join("other.mcap"));
    let json = |args: &[&str]| -> serde_json::Value {
        let done = calibrate(at, &[&["thermal", "--json"], args].concat());
        assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
        serde_json::from_slice(&done.stdout).unwrap()
    };
    assert_eq!(json(&["pieces"])["coefficients"], json(&["whole.mcap"])["coefficients"]);

    // Units: all of them, or the one that is wanted.
    let both = json(&["whole.mcap", "other.mcap"]);
    assert_eq!(both["batch"]["units"].as_array().unwrap().len(), 2);
    assert_eq!(both["reports"][1]["unit"], "B");
    assert_eq!(json(&["other.mcap", "--unit", "B"])["unit"], "B");
    std::fs::write(at.join("a.toml"), read("of-file.toml").replace("\"UNIT\"", "\"A\"")).unwrap();
    told += &said(at, &["whole.mcap", "other.mcap", "--calibration", "a.toml", "--out", "of-a.toml"]);
    assert!(logs("of-a.toml").eq(["whole.mcap"]));
    told += &said(at, &["whole.mcap", "other.mcap", "--unit", "B"]);

    // What cannot be is said.
    std::fs::create_dir(at.join("empty")).unwrap();
    let of_another = ["log.csv", "--mapping", "mapping.toml", "--unit", "B", "--calibration", "a.toml"];
    let refusals: [&[&str]; 9] = [
        &of_another,
        &["empty"],
        &["whole.mcap", "other.mcap", "--unit", "C"],
        &["whole.mcap", "./whole.mcap"],
        &["whole.mcap", "--judge", "whole.mcap"],
        &["whole.mcap", "--latitude", "55", "--heading", "30"],
        &["whole.mcap", "--axis", "z", "--rate", "0", "--rate", "20"],
        &["whole.mcap", "--axis", "z", "--rate", "20"],
        &["whole.mcap", "--axis", "z", "--rate", "0.1"],
    ];
    told += &refusals.map(|args| said(at, args)).concat();
    // Another part of the same log may judge.
    told +=
        &said(at, &["whole.mcap", "--duration", "1500", "--judge", "whole.mcap", "--judge-start", "1500"]);

    // A recording that a kill cut short is taken to where it is whole.
    let bytes = std::fs::read(at.join("whole.mcap")).unwrap();
    std::fs::write(at.join("cut.mcap"), &bytes[..bytes.len() * 9 / 10]).unwrap();
    told += &said(at, &["cut.mcap"]);

    // A run that goes one way only: every sensor is refused, which is no part, and no document says so.
    std::fs::write(at.join("b.toml"), read("of-file.toml").replace("\"UNIT\"", "\"B\"")).unwrap();
    let mut one_way =
        vec!["other.mcap", "--duration", "2800", "--method", "sequential", "--calibration", "b.toml"];
    one_way.extend(["--accept-partial", "--out", "none.toml", "--html", "none.html"]);
    told += &said(at, &one_way);
    assert!(!at.join("none.toml").exists() && at.join("none.html").exists());

    a_dead_gyro_is_left_out(at, &read("log.csv"));

    // Of several units one is not judged: it is fitted, and that is said.
    told += &said(
        at,
        &["whole.mcap", "other.mcap", "--duration", "5000", "--judge", "other.mcap", "--judge-start", "5000"],
    );
    insta::assert_snapshot!(told);
}

/// One gyro is dead: the others are written, and the command says whether that is enough.
fn a_dead_gyro_is_left_out(at: &Path, log: &str) {
    let dead = log.lines().enumerate().map(|(row, line)| {
        let mut cells: Vec<&str> = line.split(',').collect();
        if row > 0 {
            cells[2] = "0";
        }
        cells.join(",") + "\n"
    });
    std::fs::write(at.join("dead.csv"), dead.collect::<String>()).unwrap();
    for (accept, wanted) in [(&[][..], 1), (&["--accept-partial"], 0)] {
        let out = format!("part-{wanted}.toml");
        let log = ["thermal", "dead.csv", "--mapping", "mapping.toml", "--unit", "UNIT"];
        let done = calibrate(at, &[&log[..], &["--out", &out, "--json"], accept].concat());
        let report: serde_json::Value = serde_json::from_slice(&done.stdout).unwrap();
        let accepted = [0, 1, 2].map(|gyro| report["verdicts"][gyro]["accepted"].as_bool().unwrap());
        assert_eq!((done.status.code(), accepted), (Some(wanted), [true, false, true]), "{report}");
        let gyros = Written::read(&at.join(&out)).unwrap().document.gyro.sensor;
        assert_eq!([0, 1].map(|gyro| gyros[gyro].terms.curve(Feature::One).is_some()), [true, false]);
    }
}
