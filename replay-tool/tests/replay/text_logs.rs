//! Text logs as others write them, through the command line: read right, or refused with line and column.

use std::fs;
use std::path::Path;

use serde_json::Value;

use crate::common::{replay, root, told};

/// One log of ten ticks in a few guises: time in ms, three rates in °/s, a temperature.
const ROWS: &str = "t;x;y;z;T\n\
    10;0.5;-1.25;2;20.5\n20;0.5;-1.25;2;20.5\n30;0.5;-1.25;2;20.5\n40;0.5;-1.25;2;20.5\n50;0.5;-1.25;2;20.5\n\
    60;0.5;-1.25;2;20.5\n70;0.5;-1.25;2;20.5\n80;0.5;-1.25;2;20.5\n90;0.5;-1.25;2;20.5\n100;0.5;-1.25;2;20.5\n";

/// A mapping for it, with further keys of the file and of its time.
fn mapping(file: &str, time: &str) -> String {
    format!(
        "version = 1\n[[file]]\nheader = true\n{file}\n[file.time]\ncolumn = \"t\"\nunit = \"ms\"\ntick_ms = 10\n{time}\n\
         [file.gyro]\noutput = \"mean\"\nsensors = [{{ column = \"x\", unit = \"deg_per_s\" }}, \
         {{ column = \"y\", unit = \"deg_per_s\" }}, {{ column = \"z\", unit = \"deg_per_s\" }}]\n\
         [[file.temperature]]\nchannel = \"imu\"\ncolumn = \"T\"\nunit = \"deg_c\"\n"
    )
}

/// Corrects a log: exit code, summary where there is one, errors.
fn correct(folder: &Path, mapping: &str, log: &[u8]) -> (Option<i32>, Value, String) {
    fs::write(folder.join("log.csv"), log).unwrap();
    fs::write(folder.join("m.toml"), mapping).unwrap();
    let calibration = root().join("config/calibration/chamber-mems.toml").canonicalize().unwrap();
    let arguments = ["correct", "log.csv", "-m", "m.toml", "-c", calibration.to_str().unwrap(), "--json"];
    let output = replay(folder, &arguments);
    let errors = String::from_utf8_lossy(&output.stderr).into_owned();
    (output.status.code(), serde_json::from_slice(&output.stdout).unwrap_or_default(), errors)
}

#[test]
fn the_same_log_in_every_guise_gives_the_same_figures() {
    let folder = tempfile::tempdir().unwrap();
    let semicolons = "delimiter = \"semicolon\"";
    let (code, expected, errors) = correct(folder.path(), &mapping(semicolons, ""), ROWS.as_bytes());
    assert_eq!((code, &expected["ticks"]), (Some(0), &Value::from(10)), "{errors}");
    let commas = format!("{semicolons}\ndecimal_mark = \",\"");
    let table = [
        ("a byte-order mark", semicolons, format!("\u{feff}{ROWS}")),
        ("decimal commas", &commas, ROWS.replace('.', ",")),
        ("line ends of Windows", semicolons, ROWS.replace('\n', "\r\n")),
        ("all of them", &commas, format!("\u{feff}{}", ROWS.replace('.', ",").replace('\n', "\r\n"))),
        ("tabs", "delimiter = \"tab\"", ROWS.replace(';', "\t")),
    ];
    for (name, file, log) in table {
        let (code, summary, errors) = correct(folder.path(), &mapping(file, ""), log.as_bytes());
        assert_eq!((code, &summary), (Some(0), &expected), "{name}: {errors}");
    }
}

#[test]
fn what_cannot_be_read_right_is_refused_with_line_and_column() {
    let folder = tempfile::tempdir().unwrap();
    let table = [
        ("a missing cell", ROWS.replace("30;0.5;-1.25;2;20.5", "30;0.5;-1.25")),
        ("an empty cell", ROWS.replace("30;0.5;-1.25", "30;;-1.25")),
        ("a truncated last line", ROWS.trim_end().trim_end_matches(";20.5").to_owned()),
        ("a gap", ROWS.replace("\n30;", "\n5030;")),
        ("time going back", ROWS.replace("\n30;", "\n5;")),
        ("time standing still", ROWS.replace("\n30;0.5", "\n20;0.75")),
        ("a decimal comma", ROWS.replacen("-1.25", "-1,25", 1)),
        ("a cell too many", ROWS.replacen("20.5", "20;5", 1)),
    ];
    let semicolons = mapping("delimiter = \"semicolon\"", "");
    let mut told = String::new();
    for (name, log) in &table {
        let (code, _, errors) = correct(folder.path(), &semicolons, log.as_bytes());
        assert_eq!(code, Some(1), "{name}: {errors}");
        told += &[name, errors.as_str()].join(": ");
    }
    let utf16: Vec<_> = "\u{feff}t;x\n".encode_utf16().flat_map(u16::to_le_bytes).collect();
    let (code, _, errors) = correct(folder.path(), &semicolons, &utf16);
    assert_eq!(code, Some(1), "{errors}");
    insta::assert_snapshot!(told + &errors);
}

#[test]
fn what_may_be_passed_over_is_counted_and_a_known_gap_is_announced() {
    let folder = tempfile::tempdir().unwrap();
    let skip = mapping("delimiter = \"semicolon\"\non_bad_row = \"skip\"", "");
    let damaged = ROWS.replace("30;0.5;-1.25;2;20.5", "30;0.5").replace("\n60;", "\n55 60;");
    let (code, summary, errors) = correct(folder.path(), &skip, damaged.as_bytes());
    assert_eq!((code, &summary["log"]["skipped_rows"]), (Some(3), &Value::from(2)), "{errors}");
    assert_eq!((&summary["ticks"], &summary["missed_ticks"]), (&Value::from(8), &Value::from(2)));

    let gap = mapping("delimiter = \"semicolon\"", "gap_after_ticks = 1.5");
    let log = ROWS.replace("\n80;", "\n5080;").replace("\n90;", "\n5090;").replace("\n100;", "\n5100;");
    let (code, summary, errors) = correct(folder.path(), &gap, log.as_bytes());
    assert_eq!((code, &summary["ticks"]), (Some(0), &Value::from(10)), "{errors}");
    assert_eq!((&summary["gaps"], &summary["missed_ticks"]), (&Value::from(1), &Value::from(500)));

    // A last line that ends in the middle of a number is used, and said.
    let (code, summary, errors) = correct(folder.path(), &gap, ROWS.trim_end().as_bytes());
    assert_eq!((code, &summary["log"]["unterminated_last_line"]), (Some(0), &Value::from(true)), "{errors}");
}

#[test]
fn a_mapping_beside_its_log_needs_no_option() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str| folder.path().join(name);
    fs::write(file("log.csv"), ROWS).unwrap();
    fs::write(file("log.mapping.toml"), mapping("delimiter = \"semicolon\"", "")).unwrap();
    fs::write(file("other.toml"), mapping("delimiter = \"comma\"", "")).unwrap();
    let info = |arguments: &[&str]| replay(folder.path(), &[&["info"], arguments].concat()).status.code();
    assert_eq!(info(&["log.csv"]), Some(0));
    assert_eq!(info(&["log.csv", "--mapping", "other.toml"]), Some(1), "an option overrules the file beside");
}

#[test]
fn play_refuses_a_log_before_it_opens_a_session() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    fs::write(path.join("log.csv"), ROWS.replacen("t;x", "t;u", 1)).unwrap();
    fs::write(path.join("m.toml"), mapping("delimiter = \"semicolon\"", "")).unwrap();
    fs::write(path.join("log.mcap"), b"\x89MCAP0\r\n").unwrap();
    let refused: [&[&str]; 9] = [
        &["log.csv", "-m", "m.toml", "-u", "A"],
        &["log.csv", "-m", "m.toml"],
        &["log.csv", "-m", "m.toml", "-u", "A", "-u", "B"],
        &["log.csv", "-u", "A"],
        &["log.mcap", "log.csv"],
        &["log.mcap", "-m", "m.toml"],
        &["log.mcap", "--batch", "4"],
        &["log.csv", "-m", "m.toml", "-u", "A", "--clock", "receive"],
        &["log.mcap", "--start", "5", "--end", "4"],
    ];
    let told = refused.map(|arguments| told(path, &[&["play"], arguments].concat()));
    insta::assert_snapshot!(told.concat());
}
