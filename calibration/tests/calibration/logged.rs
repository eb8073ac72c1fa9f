//! `drift` and `impact` on logs of corrected and raw ticks, as their user calls them.

use std::path::Path;

use isotherm_calibration::document::Written;
use isotherm_calibration::runs::Run;
use isotherm_correction::sample::{CorrectedTick, SensorFlags};
use isotherm_correction::units::{AngularRate, Span, Timestamp};
use isotherm_log::message::{Message, Topic};
use isotherm_log::offline::rows::{write_header, write_tick};
use isotherm_log::offline::unit_id;
use isotherm_log::part::{LogFiles, Part};
use isotherm_log::recording::{RecordingOptions, RecordingReader, RecordingWriter};
use isotherm_protocol::stream::UnitStream;
use serde_json::Value;

use crate::command::{calibrate, ended, json, shipped, told};
use crate::simulated_logs::{fibre_optic, record, write_text};

/// A recording of the simulated unit, and its ticks corrected as CSV and as a recording.
fn logs(folder: &Path) -> [String; 3] {
    let path = |name: &str| folder.join(name);
    let raw = path("raw.mcap");
    record(&raw, &fibre_optic(7, "FOG-0001", 9000.0));
    let unit = unit_id("FOG-0001").unwrap();
    let loaded = Written::read(&shipped("FOG-0001.toml")).unwrap().loaded;
    let run = Run::new("raw".into(), unit.clone(), LogFiles::Recordings(vec![raw.clone()]), &Part::default());
    let mut csv = Vec::new();
    write_header(&mut csv).unwrap();
    run.correct_with_series(&loaded, |tick| write_tick(&mut csv, tick).unwrap()).1.unwrap();
    std::fs::write(path("corrected.csv"), csv).unwrap();
    // As the service records what it publishes.
    let mut stream = loaded.stream(isotherm_correction::unit::UnitSettings::default());
    let mut reader = RecordingReader::open(std::slice::from_ref(&raw), std::sync::Arc::default()).unwrap();
    let mut writer = RecordingWriter::create(&path("corrected.mcap"), RecordingOptions::default()).unwrap();
    let mut received_ns = 0;
    let mut give_out = |stream: &mut UnitStream, received_ns: u64| {
        let mut frame = Vec::new();
        while stream.next_frame(&mut frame).is_some() {
            let topic = Topic::Corrected(unit.clone());
            writer.write(&Message { topic, received_ns, frame: std::mem::take(&mut frame) }).unwrap();
        }
    };
    while let Some(message) = reader.next_message().unwrap() {
        let Topic::Raw(_, input) = message.topic else { continue };
        received_ns = message.received_ns;
        stream.receive(input, &message.frame).unwrap();
        give_out(&mut stream, received_ns);
    }
    stream.flush();
    give_out(&mut stream, received_ns);
    writer.finish().unwrap();
    [raw, path("corrected.csv"), path("corrected.mcap")].map(|path| path.display().to_string())
}

/// Mean and N of each sensor.
fn figures(report: &Value) -> Vec<[f64; 2]> {
    let of = |sensor: &Value| {
        let noise = &sensor["noise"]["N"];
        [sensor["mean"].as_f64().unwrap(), noise["value"].as_f64().or(noise["below"].as_f64()).unwrap()]
    };
    report["sensors"].as_array().unwrap().iter().map(of).collect()
}

#[test]
fn drift_says_the_same_of_a_log_in_every_form() {
    let folder = tempfile::tempdir().unwrap();
    let [raw, csv, mcap] = logs(folder.path());
    let document = shipped("FOG-0001.toml").display().to_string();
    let mut means = Vec::new();
    for accelerometers in [&[][..], &["--accelerometers"]] {
        let of = |arguments: &[&str]| json(&[&["drift"], arguments, accelerometers, &["--json"]].concat());
        let corrected_by = of(&[&raw, "--calibration", &document]);
        assert_eq!(corrected_by["corrected"], true);
        let by_csv = of(&[&csv]);
        let by_mcap = of(&[&mcap, "--corrected"]);
        assert_eq!(figures(&by_csv), figures(&by_mcap));
        assert_eq!(figures(&corrected_by), figures(&by_mcap));
        assert_eq!(by_csv["measure"], if accelerometers.is_empty() { "deg/h" } else { "m/s2" });
        means.push(figures(&by_csv));
    }
    // A document corrects raw readings only: it is not even read.
    let out = folder.path().join("new.toml").display().to_string();
    insta::assert_snapshot!(told(
        folder.path(),
        &["drift", &csv, "--calibration", "none.toml", "--out", &out]
    ));
    let (rates, forces) = (&means[0], &means[1]);
    // Gravity is along z, and Earth rate is about the axes of a unit that looks to 30° at 55.75° north.
    assert!((forces[2][0].abs() - 9.815).abs() < 0.02 && forces[0][0].abs() < 0.05, "{forces:?}");
    let north = 15.041 * 55.75_f64.to_radians().cos();
    assert!((rates[0][0] - north * 30.0_f64.to_radians().cos()).abs() < 0.1, "{rates:?}");
    assert!((rates[1][0].abs() - north * 30.0_f64.to_radians().sin()).abs() < 0.1, "{rates:?}");
}

#[test]
fn drift_reads_text_logs_by_their_mapping() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).display().to_string();
    let scenario = isotherm_simulator::presets::mems_chamber(4);
    let scenario =
        isotherm_simulator::Scenario { duration_s: 300.0, tick_ns: 100_000_000, start_ns: 0, ..scenario };
    record(Path::new(&path("log.mcap")), &scenario);
    write_text(Path::new(&path("log.csv")), Path::new(&path("mapping.toml")), &scenario);
    for accelerometers in [&[][..], &["--accelerometers"]] {
        let text =
            [&["drift", &path("log.csv"), "--mapping", &path("mapping.toml"), "--json"], accelerometers];
        let recorded = [&["drift", &path("log.mcap"), "--json"], accelerometers];
        let (text, recorded) = (figures(&json(&text.concat())), figures(&json(&recorded.concat())));
        for (a, b) in text.iter().flatten().zip(recorded.iter().flatten()) {
            assert!((a / b - 1.0).abs() < 1e-3, "{text:?} {recorded:?}");
        }
    }
}

#[test]
fn impact_sails_the_drift_of_a_log() {
    let folder = tempfile::tempdir().unwrap();
    let [raw, csv, mcap] = logs(folder.path());
    // The document of the unit, with what the estimator is to expect of another.
    let expected = Written::read(&shipped("ZLG-0001.toml")).unwrap().document;
    let mut unit = Written::read(&shipped("FOG-0001.toml")).unwrap().document;
    for (gyro, other) in unit.gyro.sensor.iter_mut().zip(expected.gyro.sensor) {
        gyro.drift = other.drift;
    }
    let document = folder.path().join("unit.toml").display().to_string();
    Written::of(&unit).unwrap().save(Path::new(&document), false).unwrap();
    let sail = |log: &str, more: &[&str]| {
        let report = json(&[&["impact", log, "--calibration-hours", "1", "--json"], more].concat());
        assert_eq!(report["models"].as_array().unwrap().len(), 3, "each gyro's calibration chooses a model");
        report["rows"].clone()
    };
    let by_csv = sail(&csv, &[]);
    assert_eq!(by_csv.as_array().unwrap().len(), 4);
    for row in by_csv.as_array().unwrap() {
        let radial = row["figures"]["radial_largest_m"].as_f64().unwrap();
        assert!(radial > 0.0 && radial < 20_000.0, "{row}");
    }
    assert_eq!(by_csv, sail(&mcap, &[]));
    let of_unit = sail(&csv, &["--calibration", &document]);
    assert_eq!(of_unit, sail(&raw, &["--calibration", &document]));
    assert_ne!(of_unit, by_csv, "the estimator expects something else");
    // A log that is too short for the calibration is refused in words.
    let short = calibrate(&["impact", &csv, "--calibration-hours", "3", "--calibration", &document]);
    assert_eq!(short.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&short.stderr).contains("--calibration-hours"));
    let raw_alone = calibrate(&["impact", &raw, "--calibration-hours", "1"]);
    assert!(!raw_alone.status.success());
}

/// A log of corrected ticks with these rates (°/h), and a little noise where a gyro measures.
fn at_rest(path: &str, rates_deg_per_h: [f64; 3], measures: [bool; 3]) {
    let mut csv = Vec::new();
    write_header(&mut csv).unwrap();
    for sequence in 0..200 {
        let noise = (sequence * 7 % 5) as f64 * 0.01 - 0.02;
        let rate = |axis: usize| rates_deg_per_h[axis] + if measures[axis] { noise } else { 0.0 };
        let tick = CorrectedTick {
            sequence,
            end_time: Timestamp::from_ns((sequence as i64 + 1) * 1_000_000_000),
            duration: Span::from_ns(1_000_000_000),
            ticks: 1,
            delta_angle: [0, 1, 2].map(|axis| AngularRate::from_deg_per_h(rate(axis)).as_rad_per_s()),
            gyro_flags: [SensorFlags::VALID; 3].into_iter().collect(),
            ..CorrectedTick::default()
        };
        write_tick(&mut csv, &tick).unwrap();
    }
    std::fs::write(path, csv).unwrap();
}

#[test]
fn starts_are_looked_at_before_their_means_count() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).display().to_string();
    let [monday, tuesday, fast, turning, dead] =
        ["monday.csv", "tuesday.csv", "fast.csv", "turning.csv", "dead.csv"].map(path);
    at_rest(&monday, [10.0, 4.0, -12.0], [true; 3]);
    at_rest(&tuesday, [10.02, 4.01, -12.03], [true; 3]);
    at_rest(&fast, [10.02, 200.0, -12.03], [true; 3]);
    at_rest(&turning, [10.0, 4.0, 30.0 * 3600.0], [true; 3]);
    at_rest(&dead, [10.0, 4.0, 0.0], [true, true, false]);
    let over = |other: &str| {
        let starts = ["impact", "--start-log", &monday, "--start-log", other];
        calibrate(&[&starts[..], &["--seeds", "1", "--hours", "1", "--json"]].concat())
    };
    let said = |other: &str| {
        let report: Value = serde_json::from_slice(&over(other).stdout).unwrap();
        let found = report["notes"].as_array().unwrap().iter().filter_map(Value::as_str);
        let found: Vec<&str> = found.filter(|note| note.starts_with("Sigma of the constant")).collect();
        format!("{:#}\n{}\n", report["warnings"], found.join("\n"))
    };
    let refused = [turning, dead].map(|other| ended(&over(&other)));
    insta::assert_snapshot!([said(&tuesday), said(&fast), refused.concat()].concat());
}
