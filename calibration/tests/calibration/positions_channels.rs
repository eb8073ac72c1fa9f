//! `positions` of a unit whose accelerometers are warmer than its housing, which their axes follow.

use std::path::Path;

use isotherm_calibration::document::Written;
use isotherm_calibration::fits::positions::plan::Plan;
use isotherm_correction::thermal::Feature;
use isotherm_log::text::LogEvent;
use isotherm_protocol::document::{Document, Shape};
use isotherm_simulator::instrument::Instrument;
use isotherm_simulator::presets::mems_chamber;
use serde_json::Value;

use crate::command::{calibrate, shipped, succeeds, words};
use crate::positions_command::driven;
use crate::simulated_logs::record_events;
use crate::stand;

/// A recording of all twelve positions at a temperature of the chamber, and how much warmer than the housing an accelerometer is.
fn record(path: &str, instrument: &Instrument, chamber_deg_c: f64) -> f64 {
    let order: Vec<usize> = (0..12).collect();
    let (events, _) = stand::log(instrument, chamber_deg_c, &Plan::twelve(), &order, &driven(31));
    let last = |channel: &str| {
        let raw = events.iter().rev().find_map(|event| match event {
            LogEvent::Temperature(reading) if &*reading.channel == channel => Some(reading.raw),
            _ => None,
        });
        -150.0 + 100.0 * raw.unwrap()
    };
    let warmer = last("accel0") - last("housing");
    record_events(Path::new(path), "MEMS-0001", events);
    warmer
}

/// The shipped document, which has the truth, with wrong scale factors and biases.
fn wrong(path: &str) -> Document {
    let mut document = Written::read(&shipped("MEMS-0001.toml")).unwrap().document;
    for sensor in &mut document.accel.as_mut().unwrap().sensor {
        let bias = sensor.terms.curve(Feature::One).map(|bias| bias.plus(0.02));
        sensor.set(Feature::One, bias);
    }
    std::fs::write(path, Written::of(&document).unwrap().text).unwrap();
    document
}

fn rms(report: &Value, number: usize, sample: &str, when: &str) -> f64 {
    report["verdicts"][number][sample][when]["rms"].as_f64().unwrap()
}

#[test]
fn scale_and_bias_stand_at_the_temperature_of_their_own_channel() {
    let folder = tempfile::tempdir().unwrap();
    let place = |name: &str| folder.path().join(name).display().to_string();
    let (room, base, out) = (place("room.mcap"), place("base.toml"), place("out.toml"));
    let warmer = record(&room, &mems_chamber(0).instrument, 20.0);
    assert!((3.0..6.0).contains(&warmer), "the accelerometers are {warmer} °C warmer than the housing");
    let old = wrong(&base);
    let call = ["positions", &room, "--calibration", &base, "--gravity", "9.8154", "--out", &out, "--json"];
    let report: Value = serde_json::from_str(&succeeds(&call)).unwrap();
    for number in 0..4 {
        assert_eq!(report["verdicts"][number]["accepted"], true, "{}", report["verdict"]);
        let after = rms(&report, number, "in_sample", "after");
        // At the housing's temperature biases would be off by 0.0047 m/s².
        assert!(after < 6e-4, "{after} m/s² are left, {}", report["verdict"]);
    }
    // Curves keep their shape and go through what was found; the slopes of the axes stay with the housing.
    let new = Written::read(Path::new(&out)).unwrap().document;
    let (old, new) = (old.accel.unwrap(), new.accel.unwrap());
    assert_eq!(old.orientation.thermal, new.orientation.thermal);
    for (old, new) in old.sensor.iter().zip(&new.sensor) {
        let at = |sensor: &isotherm_protocol::document::AccelSensor| {
            sensor.terms.curve(Feature::One).unwrap().shape().at(24.0).unwrap()
        };
        assert!((at(new) - at(old) + 0.02).abs() < 3e-4, "{} {}", at(old), at(new));
    }
}

#[test]
fn curves_reach_as_far_as_their_own_channel_went() {
    let folder = tempfile::tempdir().unwrap();
    let place = |name: &str| folder.path().join(name).display().to_string();
    let (base, out) = (place("base.toml"), place("out.toml"));
    wrong(&base);
    let logs = [-20.0, 20.0, 55.0].map(|deg_c| {
        let log = place(&format!("at {deg_c}.mcap"));
        (log.clone(), deg_c, record(&log, &mems_chamber(0).instrument, deg_c))
    });
    let logs_of: Vec<&str> = logs.iter().map(|(log, ..)| log.as_str()).collect();
    let rest = ["--calibration", &base, "--gravity", "9.8154", "--out", &out, "--json"];
    let report: Value =
        serde_json::from_str(&succeeds(&[&["positions"], &logs_of[..], &rest].concat())).unwrap();
    assert_eq!(report["accepted"], true, "{}", report["verdict"]);
    let new = Written::read(Path::new(&out)).unwrap().document;
    let accel = new.accel.unwrap();
    // The housing itself is 2 °C above the chamber.
    let hottest = 55.0 + 2.0 + logs[2].2;
    for sensor in &accel.sensor {
        for shape in [sensor.scale_factor.shape(), sensor.terms.curve(Feature::One).unwrap().shape()] {
            let Shape::Polynomial { range: [low, high], .. } = shape else { panic!("{shape:?}") };
            assert!(*high >= hottest && *low <= -18.0 + logs[0].2, "{low}…{high}, went to {hottest}");
        }
    }
    let thermal = accel.orientation.thermal.unwrap();
    assert_eq!(thermal.channels, ["housing"]);
    assert!(thermal.range_deg_c[1] < hottest, "{:?}: the axes follow the housing", thermal.range_deg_c);
    let [low, high] = new.origin.unwrap().range_deg_c.unwrap();
    assert!(high >= hottest && low <= -18.0, "{low}…{high}");
}

#[test]
fn what_makes_a_judging_run_worse_leaves_the_old_document() {
    let folder = tempfile::tempdir().unwrap();
    let place = |name: &str| folder.path().join(name).display().to_string();
    let (log, judge, out) = (place("other.mcap"), place("judge.mcap"), place("out.toml"));
    let own = mems_chamber(0).instrument;
    // One sensor has another bias in the log that is fitted than in the one that judges.
    let mut other = own.clone();
    other.accelerometers.as_mut().unwrap().sensors[1].bias_v[0] += 0.05;
    record(&log, &other, 20.0);
    record(&judge, &own, 20.0);
    let document = shipped("MEMS-0001.toml").display().to_string();
    let call = [
        "positions",
        &log,
        "--judge",
        &judge,
        "--calibration",
        &document,
        "--gravity",
        "9.8154",
        "--out",
        &out,
    ];
    let (code, report, errors) = words(&calibrate(&call));
    assert_eq!(code, Some(1), "{errors}");
    assert!(!Path::new(&out).exists());
    insta::assert_snapshot!(report.replace(folder.path().to_str().unwrap(), "FOLDER"));
}
