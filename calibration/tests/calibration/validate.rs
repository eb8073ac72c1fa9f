//! `validate`: a document judged on logs, as its user calls it.

use std::path::Path;

use isotherm_calibration::document::{Written, origin};
use isotherm_calibration::runs::Run;
use isotherm_calibration::runs::table::Table;
use isotherm_correction::thermal::Feature;
use isotherm_log::offline::unit_id;
use isotherm_log::part::{LogFiles, Part};
use isotherm_log::text::LogEvent;
use isotherm_protocol::document::{Curve, Document, Shape, StatedTerm};
use isotherm_simulator::failure::{FailingSensor, Failure, Fault};
use serde_json::Value;

use crate::command::{self, calibrate, headings, json, shipped, words};
use crate::simulated_logs::{events, fibre_optic, record, record_events, write_text};

/// Length of the runs: a hold, and most of a ramp.
const SECONDS: f64 = 3600.0;

fn save(path: &Path, change: impl FnOnce(&mut Document)) {
    let mut changed = Written::read(&shipped("FOG-0001.toml")).unwrap().document;
    change(&mut changed);
    Written::of(&changed).unwrap().save(path, true).unwrap();
}

#[test]
fn a_good_document_is_accepted_and_a_bad_one_is_not() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).display().to_string();
    record(Path::new(&path("judge.mcap")), &fibre_optic(5, "FOG-0001", SECONDS));
    let good = shipped("FOG-0001.toml").display().to_string();
    // White noise is the most of what is left in shorter windows.
    let (log, page) = (path("judge.mcap"), path("judge.html"));
    let arguments = ["validate", &good, &log, "--window", "50", "--json", "--html", &page, "--overwrite"];
    let report = json(&arguments);
    assert_eq!(report["accepted"], true);
    for gyro in 0..3 {
        let verdict = &report["verdicts"][gyro];
        assert!(verdict["times_smaller"].as_f64().unwrap() > 3.0, "{verdict}");
        assert!(verdict["out_of_sample"].is_object(), "{verdict}");
    }
    let of_page = headings(&page);
    assert_eq!(calibrate(&arguments).stdout, calibrate(&arguments).stdout, "the same bytes");
    // With the place known, the bias itself is judged.
    let place = ["--latitude", "55.75", "--heading", "30"];
    let placed = json(&[&arguments[..6], &place].concat());
    for gyro in 0..3 {
        let after = &placed["verdicts"][gyro]["out_of_sample"]["after"];
        assert!(after["mean"].as_f64().unwrap().abs() < 0.1, "{after}");
    }
    // The sign of a bias the wrong way round.
    save(Path::new(&path("bad.toml")), |document| {
        let sensor = &mut document.gyro.sensor[0];
        let lags: Vec<StatedTerm> = sensor.terms.of(Feature::Lag).cloned().collect();
        sensor.terms.remove(Feature::Lag);
        for lag in lags {
            let Shape::Polynomial { reference, coefficients, range } = lag.curve().unwrap().shape().clone()
            else {
                continue;
            };
            let coefficients = coefficients.iter().map(|c| -c).collect();
            let gain = Curve::new(Shape::Polynomial { reference, coefficients, range });
            sensor.put(StatedTerm::with_parameter(Feature::Lag, lag.parameter, gain));
        }
    });
    let (code, stdout, stderr) = words(&calibrate(&["validate", &path("bad.toml"), &path("judge.mcap")]));
    assert_eq!(code, Some(1));
    insta::assert_snapshot!(of_page + &stderr + stdout.lines().next().unwrap());
}

#[test]
fn a_log_that_the_document_was_made_from_is_in_sample() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).display().to_string();
    record(Path::new(&path("known.mcap")), &fibre_optic(5, "FOG-0001", SECONDS));
    save(Path::new(&path("unit.toml")), |document| {
        let of_log = origin(&[path("known.mcap").into()], "test").unwrap();
        document.origin.get_or_insert_default().log = of_log.log;
    });
    let report = json(&["validate", &path("unit.toml"), &path("known.mcap"), "--json"]);
    assert_eq!((&report["accepted"], &report["verdicts"][0]["out_of_sample"]), (&true.into(), &Value::Null));
    let warnings = format!("{:#}", report["warnings"]);
    insta::assert_snapshot!(warnings.replace(folder.path().to_str().unwrap(), "FOLDER"));
}

#[test]
fn several_units_end_with_one_table() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).display().to_string();
    std::fs::create_dir(path("documents")).unwrap();
    let mut logs = Vec::new();
    for (seed, unit) in [(1, "FOG-0001"), (2, "FOG-0002"), (3, "FOG-0003")] {
        let log = path(&format!("{unit}.mcap"));
        record(Path::new(&log), &fibre_optic(seed, unit, 1500.0));
        logs.push(log);
        save(Path::new(&path(&format!("documents/{unit}.toml"))), |document| document.unit = unit.into());
    }
    let html = path("batch.html");
    let mut arguments = vec!["validate".to_owned(), path("documents")];
    arguments.extend(logs);
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let report = json(&[arguments.as_slice(), &["--json", "--html", &html]].concat());
    let verdict = report["batch"]["verdict"].as_str().unwrap();
    let units: Vec<&str> = (0..3).map(|unit| report["reports"][unit]["unit"].as_str().unwrap()).collect();
    assert_eq!(units, ["FOG-0001", "FOG-0002", "FOG-0003"]);
    assert!(Path::new(&path("batch-FOG-0002.html")).exists() && Path::new(&html).exists());
    // A unit without a document does not stop the others.
    std::fs::remove_file(path("documents/FOG-0002.toml")).unwrap();
    insta::assert_snapshot!(format!("{verdict}\n{}", command::told(folder.path(), &arguments)));
}

#[test]
fn a_text_log_says_the_same_as_a_recording() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).display().to_string();
    let scenario = isotherm_simulator::presets::mems_chamber(4);
    let mut scenario = isotherm_simulator::Scenario { duration_s: 1500.0, tick_ns: 500_000_000, ..scenario };
    scenario.start_ns = 0;
    record(Path::new(&path("judge.mcap")), &scenario);
    write_text(Path::new(&path("judge.csv")), Path::new(&path("mapping.toml")), &scenario);
    let document = shipped("MEMS-0001.toml").display().to_string();
    let recorded = json(&["validate", &document, &path("judge.mcap"), "--json"]);
    let written =
        json(&["validate", &document, &path("judge.csv"), "--mapping", &path("mapping.toml"), "--json"]);
    for (a, b) in recorded["verdicts"].as_array().unwrap().iter().zip(written["verdicts"].as_array().unwrap())
    {
        for end in ["before", "after"] {
            let of = |verdict: &Value| verdict["out_of_sample"][end]["rms"].as_f64().unwrap();
            // A row of the text has the temperature of the row, a recording that of the reading's own time.
            assert!((of(a) / of(b) - 1.0).abs() < 0.03, "{a} {b}");
        }
    }
}

#[test]
fn temperatures_of_a_recording_are_those_of_their_time() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("judge.mcap");
    let scenario = fibre_optic(5, "FOG-0001", SECONDS);
    record(&path, &scenario);
    let unit = unit_id("FOG-0001").unwrap();
    let files = LogFiles::Recordings(vec![path]);
    let recorded = Run::new("recorded".into(), unit.clone(), files, &Part::default());
    let in_memory = Run::of_events("recorded".into(), unit, events(&scenario).collect());
    let loaded = Written::read(&shipped("FOG-0001.toml")).unwrap().loaded;
    let [a, b] = [&recorded, &in_memory].map(|run| Table::of(run, &loaded, 10.0).unwrap());
    assert_eq!(a, b);
}

#[test]
fn what_cannot_be_judged_is_refused_in_words() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).display().to_string();
    let good = shipped("FOG-0001.toml").display().to_string();
    let mut told = String::new();
    let mut refused = |arguments: &[&str]| told += &command::told(folder.path(), arguments);
    record(Path::new(&path("other.mcap")), &fibre_optic(5, "FOG-0009", 200.0));
    refused(&["validate", &good, &path("other.mcap")]);
    let mut moving = fibre_optic(5, "FOG-0001", 200.0);
    moving.motion = moving.motion.along(isotherm_simulator::motion::Path::Sine {
        axis: [1.0, 0.0, 0.0],
        amplitude_deg: 20.0,
        frequency_hz: 0.01,
        phase_deg: 0.0,
    });
    record(Path::new(&path("moving.mcap")), &moving);
    // Two windows and none; one that turns steadily about the vertical.
    refused(&["validate", &good, &path("moving.mcap"), "--window", "90"]);
    refused(&["validate", &good, &path("moving.mcap"), "--window", "300"]);
    let mut turning = fibre_optic(5, "FOG-0001", 200.0);
    turning.motion = turning
        .motion
        .along(isotherm_simulator::motion::Path::ConstantRate { axis: [0.0, 0.0, 1.0], rate_deg_per_s: 6.0 });
    record(Path::new(&path("turning.mcap")), &turning);
    refused(&["validate", &good, &path("turning.mcap")]);
    refused(&["validate", &good, &path("moving.mcap")]);
    refused(&["validate", &good, &path("moving.mcap"), "--window", "0"]);
    refused(&["validate", &good, &path("moving.mcap"), "--latitude", "95", "--heading", "0"]);
    let scenario = fibre_optic(5, "FOG-0001", 200.0);
    let without = events(&scenario).filter(|event| !matches!(event, LogEvent::Temperature(_)));
    record_events(Path::new(&path("deaf.mcap")), "FOG-0001", without);
    refused(&["validate", &good, &path("deaf.mcap")]);
    // A dead gyro: not moving at all is no merit.
    let mut dead = fibre_optic(5, "FOG-0001", 600.0);
    dead.failures.push(Failure { sensor: FailingSensor::Gyro(1), at_s: 0.0, fault: Fault::Stuck });
    record(Path::new(&path("dead.mcap")), &dead);
    refused(&["validate", &good, &path("dead.mcap")]);
    refused(&["validate", &good, &path("none.mcap")]);
    refused(&["validate", &good, &path("none.csv")]);
    insta::assert_snapshot!(told.replace(&good, "FOG-0001.toml"));
}

#[test]
fn a_folder_that_was_fitted_is_known_whatever_is_given_of_it() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).display().to_string();
    for (name, seed) in [("pieces", 5), ("other", 6)] {
        std::fs::create_dir(path(name)).unwrap();
        record(Path::new(&path(&format!("{name}/run.mcap"))), &fibre_optic(seed, "FOG-0001", 1500.0));
    }
    let known = |document: &str, log: &str| {
        let report = json(&["validate", &path(document), &path(log), "--json"]);
        report["verdicts"][0]["out_of_sample"].is_null()
    };
    // From the folder, and from the file in it.
    for (document, log) in [("of-folder.toml", "pieces"), ("of-file.toml", "pieces/run.mcap")] {
        save(Path::new(&path(document)), |document| {
            document.origin.get_or_insert_default().log = origin(&[path(log).into()], "test").unwrap().log;
        });
        assert!(known(document, "pieces") && known(document, "pieces/run.mcap"), "{document}");
        assert!(!known(document, "other") && !known(document, "other/run.mcap"), "{document}");
    }
}

#[test]
fn faults_of_the_log_that_judges_are_told() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).display().to_string();
    let good = shipped("FOG-0001.toml").display().to_string();
    let healthy: Vec<LogEvent> = events(&fibre_optic(5, "FOG-0001", 1500.0)).collect();
    let warnings = |name: &str, change: &dyn Fn(usize, LogEvent) -> Option<LogEvent>| {
        let changed = healthy.iter().cloned().enumerate().filter_map(|(index, event)| change(index, event));
        let log = path(name);
        record_events(Path::new(&log), "FOG-0001", changed);
        let (_, said, errors) = words(&calibrate(&["validate", &good, &log, "--json"]));
        let report: Value = serde_json::from_str(&said).unwrap_or_default();
        format!("{:#}\n{errors}", report["warnings"])
    };
    let gyro = |event: LogEvent, of: &dyn Fn(&mut isotherm_correction::sample::GyroTick)| match event {
        LogEvent::Gyro { output, mut tick } => {
            of(&mut tick);
            LogEvent::Gyro { output, tick }
        }
        other => other,
    };
    let clean = warnings("clean.mcap", &|_, event| Some(event));
    let zero = warnings("zero.mcap", &|_, event| Some(gyro(event, &|tick| tick.readings[1] = 0.0)));
    let nan = warnings("nan.mcap", &|_, event| {
        Some(gyro(event, &|tick| {
            if tick.sequence % 300 == 7 {
                tick.readings[0] = f64::NAN;
            }
        }))
    });
    let gap = warnings("gap.mcap", &|_, event| {
        let inside = matches!(&event, LogEvent::Gyro { tick, .. } if (400..480).contains(&tick.sequence));
        (!inside).then_some(event)
    });
    let units = warnings("units.mcap", &|_, event| {
        Some(gyro(event, &|tick| {
            tick.readings.iter_mut().for_each(|rate| *rate = rate.to_degrees() * 3600.0);
        }))
    });
    let jumping = warnings("swapped.mcap", &|index, event| {
        Some(match event {
            LogEvent::Temperature(mut reading) => {
                reading.raw = 1.2 + 0.1 * (index * 7919 % 13) as f64;
                LogEvent::Temperature(reading)
            }
            other => other,
        })
    });
    let told = [clean, zero, nan, gap, units, jumping].join("\n");
    insta::assert_snapshot!(told.replace(folder.path().to_str().unwrap(), "FOLDER"));
}

#[test]
fn some_missing_rows_leave_a_verdict() {
    let folder = tempfile::tempdir().unwrap();
    let scenario = isotherm_simulator::presets::mems_chamber(4);
    let scenario = isotherm_simulator::Scenario { duration_s: 120.0, ..scenario };
    let judged = |every: u64| -> Value {
        let there = events(&scenario)
            .filter(|event| !matches!(event, LogEvent::Gyro { tick, .. } if tick.sequence % every == 7));
        let log = folder.path().join(format!("{every}.mcap"));
        record_events(&log, "MEMS-0001", there);
        let document = shipped("MEMS-0001.toml").display().to_string();
        let (_, said, _) = words(&calibrate(&["validate", &document, &log.display().to_string(), "--json"]));
        serde_json::from_str(&said).unwrap()
    };
    let both = [judged(333), judged(100_000)];
    // The first window is that of the warming up.
    assert!(both.iter().all(|report| report["verdicts"][0]["out_of_sample"]["after"]["count"] == 11));
    insta::assert_snapshot!(both.map(|report| format!("{:#}\n", report["warnings"])).concat());
}
