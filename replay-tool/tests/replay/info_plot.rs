//! `info` and `plot` as their users run them: on simulated logs, and on the real ones where the data are there.

use std::path::Path;

use serde_json::Value;

use crate::common::{check, mapping, replay, root, stdout, told};
use crate::imports::{log, noise};
use crate::real_logs::data;

/// Runs a command that must go well, and reads what it printed as JSON.
fn json(folder: &Path, args: &[&str]) -> Value {
    let output = replay(folder, args);
    let words = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{args:?}: {words}");
    serde_json::from_slice(&output.stdout).unwrap()
}

/// A topic of the only unit.
fn topic(info: &Value, unit: &str, key: &str) -> Value {
    let topics = info["units"][unit]["topics"].as_array().unwrap();
    topics.iter().find(|topic| topic["key"] == format!("imu/{unit}/{key}").as_str()).unwrap().clone()
}

/// What `info` says of a log that a ready mapping reads.
fn info_of(mapping_name: &str, log: &Path) -> Value {
    let mapping = mapping(mapping_name);
    let [log, mapping] = [log, &mapping].map(|path| path.to_str().unwrap().to_owned());
    json(&root(), &["info", &log, "--mapping", &mapping, "--unit", "U", "--json"])
}

/// What the tables of a page have a row for: for a snapshot.
fn rows(folder: &Path, page: &str) -> String {
    let html = std::fs::read_to_string(folder.join(page)).unwrap();
    let heads = html.split("<tr><th").skip(1).filter_map(|part| part.split_once("</th>")?.0.split_once('>'));
    heads.map(|(_, row)| row.to_owned() + "\n").collect()
}

#[test]
fn with_data_info_tells_what_the_real_logs_hold() {
    if let Some(log) = data("rlg-static/rlg-static.imu.gz") {
        let info = info_of("rlg-static.toml", &log);
        let gyro = topic(&info, "U", "raw/gyro");
        assert_eq!(
            (gyro["ticks"].as_u64(), gyro["order"]["gaps"]["count"].as_u64()),
            (Some(184_718), Some(0))
        );
        assert_eq!(gyro["rate"]["nominal_hz"].as_f64(), Some(100.0));
        assert_eq!(gyro["duration_s"].as_f64(), Some(1847.17));
    }
    if let Some(log) = data("chamber-mems/chamber.tsv") {
        let info = info_of("chamber-mems.toml", &log);
        let gyro = topic(&info, "U", "raw/gyro");
        assert_eq!(gyro["ticks"].as_u64(), Some(8400));
        assert!((gyro["rate"]["nominal_hz"].as_f64().unwrap() - 1.979).abs() < 0.001, "{gyro}");
        let temperature = &info["units"]["U"]["temperatures"]["imu"];
        assert_eq!(temperature["readings"].as_u64(), Some(8400));
        assert!((temperature["min"].as_f64().unwrap() + 17.603).abs() < 1e-3, "{temperature}");
        assert!((temperature["max"].as_f64().unwrap() - 73.967).abs() < 1e-3, "{temperature}");
    }
    if let Some(log) = data("tumble-mems") {
        let info = info_of("tumble-mems.toml", &log);
        assert_eq!(topic(&info, "U", "raw/accel")["ticks"].as_u64(), Some(51_175));
        assert_eq!(info["files"].as_array().unwrap().len(), 2, "the folder's files are named");
    }
}

#[test]
fn with_data_the_chamber_log_is_drawn_raw_and_corrected() {
    let Some(log) = data("chamber-mems/chamber.tsv") else { return };
    let folder = tempfile::tempdir().unwrap();
    let files = [log, mapping("chamber-mems.toml"), root().join("config/calibration/chamber-mems.toml")];
    let [log, mapping, calibration] = files.map(|path| path.canonicalize().unwrap().display().to_string());
    let args =
        ["plot", &log, "--mapping", &mapping, "--calibration", &calibration, "--out", "c.html", "--json"];
    let summary = json(folder.path(), &args);
    let unit = &summary["units"]["log"][0];
    assert_eq!((unit["raw_ticks"].as_u64(), unit["corrected_ticks"].as_u64()), (Some(8400), Some(8400)));
    assert_eq!(unit["marks"].as_u64(), Some(0), "long batches of other streams are no jumps of the clock");
    let html = std::fs::read_to_string(folder.path().join("c.html")).unwrap();
    assert!(!html.contains("http:") && !html.contains("src="));
    assert_eq!(summary["bytes"].as_u64(), Some(html.len() as u64));
    insta::assert_snapshot!(rows(folder.path(), "c.html"));
}

#[test]
fn a_simulated_log_with_modes_is_told_and_drawn() {
    let folder = tempfile::tempdir().unwrap();
    let run = |args: &[&str]| replay(folder.path(), args);
    let simulated = run(&["simulate", "--preset", "zeeman-sine", "--duration", "30", "--out", "z.csv"]);
    assert!(simulated.status.success());
    let info =
        json(folder.path(), &["info", "z.csv", "--mapping", "z.mapping.toml", "--unit", "Z", "--json"]);
    let gyro = topic(&info, "Z", "raw/gyro");
    assert_eq!((gyro["ticks"].as_u64(), gyro["rate"]["nominal_hz"].as_f64()), (Some(6000), Some(200.0)));
    let modes = &info["units"]["Z"]["modes"];
    assert_eq!((modes["changes"].as_u64(), modes["switch_commands"].as_u64()), (Some(2), Some(2)));
    assert_eq!(modes["between_changes"]["p50_ns"].as_u64(), Some(12_000_000_000));

    let tables = run(&["info", "z.csv", "--mapping", "z.mapping.toml"]);
    let text = String::from_utf8(tables.stdout).unwrap();
    assert!(text.contains("12.000000 s"), "{text}");

    // Counts, of which nothing is known, in a panel of their own; then by nominal scale.
    let plotted = run(&["plot", "z.csv", "--mapping", "z.mapping.toml", "--out", "raw.html"]);
    assert!(plotted.status.success());
    let calibration = root().join("config/calibration/ZLG-0001.toml").canonicalize().unwrap();
    let calibration = calibration.to_str().unwrap();
    let both =
        ["plot", "z.csv", "--mapping", "z.mapping.toml", "--beside", "z.csv", "--calibration", calibration];
    let summary = json(folder.path(), &[&both[..], &["--out", "both.html", "--json"]].concat());
    let difference = &summary["differences"]["log"];
    assert_eq!(
        (difference["common_ticks"].as_u64(), difference["differing_ticks"].as_u64()),
        (Some(6000), Some(0)),
        "a log does not differ from itself"
    );
    insta::assert_snapshot!(["raw.html", "both.html"].map(|page| rows(folder.path(), page)).join("\n"));
}

#[test]
fn a_document_for_other_sensors_scales_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let full = root().join("config/calibration/example-full.toml");
    std::fs::copy(full, path.join("full.toml")).unwrap();
    check(&replay(path, &["simulate", "--preset", "skewed-six", "--duration", "2", "--out", "six.csv"]), 0);
    let said = told(path, &["plot", "six.csv", "--calibration", "full.toml", "--out", "six.html"]);
    insta::assert_snapshot!(said + &rows(path, "six.html"));
}

#[test]
fn a_page_is_not_written_over_its_log() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("log.csv"), "1\n").unwrap();
    let output = replay(folder.path(), &["plot", "log.csv", "--mapping", "m.toml", "--out", "log.csv"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(std::fs::read(folder.path().join("log.csv")).unwrap() == b"1\n");
}

#[test]
fn topics_are_listed_and_their_messages_printed() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let common = ["log.mcap", "--topic", "imu/*/raw/*"];
    check(&replay(path, &["simulate", "--preset", "mems-chamber", "--duration", "5", "--out", "log.csv"]), 0);
    let mapped = ["log.csv", "-m", "log.mapping.toml", "-u", "M-1"];
    check(&replay(path, &[&["convert", "--out", "log.mcap"], &mapped[..]].concat()), 0);
    for log in [&common[..], &mapped] {
        let output = replay(path, &[&["list", "--json"], log].concat());
        check(&output, 0);
        let said: Value = serde_json::from_str(&stdout(&output)).unwrap();
        assert!(said["topics"]["imu/M-1/raw/gyro"]["messages"].as_u64() > Some(1), "{said}");
        assert_eq!(said["topics"].as_object().unwrap().len(), 3, "{said}");
    }
    // A text log has one unit, whose serial nothing depends on here.
    for command in ["list", "cat"] {
        assert!(stdout(&replay(path, &[command, "log.csv"])).contains("imu/log/raw/gyro"), "{command}");
    }
    let table = stdout(&replay(path, &["list", "log.mcap", "--topic", "imu/*/raw/temp"]));
    assert!(table.contains("imu/M-1/raw/temp") && !table.contains("gyro"), "{table}");
    let output = replay(path, &["cat", "log.mcap", "--topic", "imu/M-1/raw/gyro", "--limit", "2"]);
    check(&output, 0);
    let lines: Vec<Value> = stdout(&output).lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    assert_eq!(lines.len(), 2);
    assert_eq!(lines[0]["topic"], "imu/M-1/raw/gyro");
    assert_eq!(lines[0]["message"]["ticks"][1]["sequence"], 1);
    insta::assert_snapshot!(told(path, &["cat", "log.mcap", "--topic", "imu//gyro"]));
}

#[test]
fn info_says_in_which_unit_of_measure_each_reading_is() {
    let folder = tempfile::tempdir().unwrap();
    let text = log("time [s],gx [deg/s],gy [deg/s],gz [deg/s],ax [mg],ay [mg],az [mg],temp [K]\n", |row| {
        let time = f64::from(u32::try_from(row).unwrap()) * 0.01;
        format!("{time:.2},{:.3},1.5,180,1.0,2.0,1000.0,298.15", noise(row, 8))
    });
    std::fs::write(folder.path().join("own.csv"), text).unwrap();
    let output = replay(folder.path(), &["import", "own.csv", "--no-plot"]);
    check(&output, 0);
    let words = stdout(&output);
    let row = |begin: &str| {
        let line = words
            .lines()
            .find(|line| line.trim().starts_with(begin))
            .unwrap_or_else(|| panic!("{begin}: {words}"));
        line.split_whitespace().map(str::to_owned).collect::<Vec<_>>()
    };
    assert_eq!(row("gyro 3")[2..6], ["rad/s", "500", "3.141593", "3.141593"]);
    assert_eq!(row("accelerometer 3")[2..5], ["m/s²", "500", "9.80665"]);
    assert_eq!(row("temperature imu")[2..5], ["°C", "500", "25"]);
}
