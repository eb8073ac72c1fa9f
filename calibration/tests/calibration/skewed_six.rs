//! Units with six skewed gyros and accelerometers: what each command finds of them, or why it does not.

use std::path::Path;

use isotherm_calibration::document::Written;
use isotherm_calibration::fits::positions::document::complete;
use isotherm_calibration::fits::positions::plan::Plan;
use isotherm_correction::thermal::Feature;
use isotherm_protocol::document::{AccelOutput, AccelSensor, Curve, Document, GyroSensor, Shape};
use isotherm_simulator::Scenario;
use isotherm_simulator::chamber::Profile;
use isotherm_simulator::instrument::{Gyros, Instrument};
use isotherm_simulator::motion::Motion;
use isotherm_simulator::orientation::Orientation;
use isotherm_simulator::presets::skewed_six;

use crate::command::{fails, json, told};
use crate::modes_rates;
use crate::simulated_logs::record;
use crate::stand::judging::{HOUSING_ABOVE_DEG_C, away, chi_square, found_in_room, plausible, quick};
use crate::stand::{self, ARCSEC};

const NAMES: [&str; 6] = ["a", "b", "c", "d", "e", "f"];

fn instrument() -> Instrument {
    skewed_six(0, None).instrument
}

/// The unit before anything was calibrated: nominal scale, axes of a dodecahedron, channels that read °C.
fn document() -> Document {
    let mut document = stand::document();
    document.unit = "SKEW-0006".into();
    document.origin = None;
    let channel = document.temperature.channel[0].clone();
    for name in ["gyro3", "gyro4", "gyro5", "accel3", "accel4", "accel5"] {
        document
            .temperature
            .channel
            .push(isotherm_protocol::document::Channel { name: name.into(), ..channel.clone() });
    }
    let rows = Orientation::dodecahedron().rows;
    document.gyro.orientation.rows.clone_from(&rows);
    document.gyro.orientation.thermal = None;
    let gyro = |(index, name): (usize, &&str)| GyroSensor {
        channel: Some(format!("gyro{index}")),
        increment_weight_rad_per_rad: Some(1.0),
        ..GyroSensor::bare(name)
    };
    document.gyro.sensor = NAMES.iter().enumerate().map(gyro).collect();
    let accel = document.accel.as_mut().unwrap();
    accel.output = AccelOutput::MetresPerSecondSquared;
    accel.orientation.rows = rows;
    let one = || {
        Curve::new(Shape::Constant { value: 1.0 }).in_unit(AccelOutput::MetresPerSecondSquared.scale_unit())
    };
    let sensor = |(index, name): (usize, &&str)| AccelSensor {
        channel: Some(format!("accel{index}")),
        ..AccelSensor::bare(name, one())
    };
    accel.sensor = NAMES.iter().enumerate().map(sensor).collect();
    document
}

/// The unit at rest, ten ticks a second.
fn at_rest(seed: u64, seconds: f64) -> Scenario {
    Scenario {
        motion: Motion { heading_deg: 30.0, ..Motion::rest(55.75) },
        duration_s: seconds,
        tick_ns: 100_000_000,
        chamber: Profile::constant(25.0),
        ..skewed_six(seed, None)
    }
}

fn save(path: &str, document: &Document) {
    Written::of(document).unwrap().save(Path::new(path), true).unwrap();
}

#[test]
fn positions_find_six_accelerometers_within_their_covariance() {
    let (plan, document) = (Plan::twelve(), Written::of(&document()).unwrap());
    let instrument = instrument();
    let truth =
        stand::all_rows(&instrument.accelerometers.as_ref().unwrap().orientation, 20.0 + HOUSING_ABOVE_DEG_C);
    let mut axes = Vec::new();
    for seed in 0..30 {
        let how = quick(seed);
        let found = found_in_room(&instrument, &plan, &document, &how);
        let error = away(&found, &truth, 0, false);
        assert_eq!(error.len(), 12);
        axes.push(chi_square(&error, found.fit.axes_covariance(0)));
        if seed == 0 {
            let made = Written::of(&complete(&document.document, &found, stand::GRAVITY)).unwrap().document;
            let accel = made.accel.unwrap();
            for (row, truth) in accel.orientation.rows.iter().zip(&truth) {
                let away = row.iter().zip(truth).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                assert!(away < 40.0 * ARCSEC, "{row:?} {truth:?}");
            }
        }
    }
    plausible("axes of six", &axes, 12.0);
}

#[test]
fn rates_find_six_gyros() {
    let folder = tempfile::tempdir().unwrap();
    let place = |name: &str| folder.path().join(name).display().to_string();
    let (base, out) = (place("base.toml"), place("rates.toml"));
    save(&base, &document());
    let mut logs = Vec::new();
    for (index, name) in ["x", "y", "z"].iter().enumerate() {
        let mut axis = [0.0; 3];
        axis[index] = 1.0;
        let mut scenarios = modes_rates::table(index as u64, axis, &[36.0, -36.0, 108.0, -108.0]);
        for scenario in &mut scenarios {
            (scenario.unit, scenario.instrument) = ("SKEW-0006".into(), instrument());
        }
        logs.push(place(&format!("{name}.mcap")));
        modes_rates::record(Path::new(&logs[index]), &scenarios);
    }
    let table = "--axis x --axis y --axis z --rates 36,-36,108,-108 --latitude 55.75 --heading 30 --pitch 0 --roll 0 --json";
    let mut arguments = vec!["rates", &logs[0], &logs[1], &logs[2], "--calibration", &base, "--out", &out];
    arguments.extend(table.split(' '));
    let report = json(&arguments);
    assert_eq!(report["accepted"], true, "{}", report["verdict"]);
    let made = Written::read(Path::new(&out)).unwrap().document;
    assert_eq!(made.gyro.sensor.len(), 6);
    let truth = stand::all_rows(&instrument().gyro_orientation, 27.0);
    for (row, truth) in made.gyro.orientation.rows.iter().zip(truth) {
        let away = row.iter().zip(truth).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(away < 4e-5, "{row:?} {truth:?}");
    }
    for (sensor, sense) in made.gyro.sensor.iter().zip([1.0, -0.8, 0.5, -1.2, 0.7, -0.4]) {
        let weight = sensor.increment_weight_rad_per_rad.unwrap();
        assert!((weight - 1.0 - 1.5e-3 * sense).abs() < 5e-4, "{}: {weight}", sensor.name);
    }
}

#[test]
fn drift_looks_at_six_gyros_or_at_the_three_axes_that_they_make() {
    let folder = tempfile::tempdir().unwrap();
    let place = |name: &str| folder.path().join(name).display().to_string();
    let (log, base, out) = (place("rest.mcap"), place("base.toml"), place("drift.toml"));
    record(Path::new(&log), &at_rest(3, 7200.0));
    save(&base, &document());
    let walk = |sensor: &serde_json::Value| sensor["noise"]["N"]["value"].as_f64().unwrap();
    let raw = json(&["drift", &log, "--json"]);
    let raw = raw["sensors"].as_array().unwrap();
    assert_eq!(
        raw.iter().map(|sensor| sensor["name"].as_str().unwrap()).collect::<Vec<_>>(),
        ["1", "2", "3", "4", "5", "6"]
    );
    for sensor in raw {
        assert!((walk(sensor) / 0.15 - 1.0).abs() < 0.1, "{sensor}");
    }
    // Six that are twice as many as needed: the axes have their noise over √2.
    let corrected = json(&["drift", &log, "--calibration", &base, "--json"]);
    let corrected = corrected["sensors"].as_array().unwrap();
    assert_eq!(corrected.len(), 3);
    for sensor in corrected {
        assert!((walk(sensor) / 0.106 - 1.0).abs() < 0.1, "{sensor}");
    }
    // Which of six gyros an axis' drift is of cannot be told.
    let refused = fails(&["drift", &log, "--calibration", &base, "--out", &out], 1);
    assert!(!Path::new(&out).exists(), "{refused}");
    // What a log left, for navigation: along three axes too.
    let sailed = json(&["impact", &log, "--calibration", &base, "--calibration-hours", "0.5", "--json"]);
    let told = format!("{refused}{:#}", sailed["notes"]).replace(folder.path().to_str().unwrap(), "FOLDER");
    insta::assert_snapshot!(told);
}

#[test]
fn six_sensors_are_judged_and_a_hand_tumbled_unit_of_six_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let place = |name: &str| folder.path().join(name).display().to_string();
    let (log, base) = (place("ramp.mcap"), place("base.toml"));
    let ramp = Profile::constant(20.0).ramp(40.0, 2.0);
    record(Path::new(&log), &Scenario { chamber: ramp, ..at_rest(4, 600.0) });
    save(&base, &document());
    let report = json(&["validate", &base, &log, "--json"]);
    assert_eq!(report["verdicts"].as_array().unwrap().len(), 6, "three axes of each kind");
    let call = ["tumble", &log, "--calibration", &base, "--gravity", "9.8154"];
    insta::assert_snapshot!(told(folder.path(), &call));
}

#[test]
fn modes_find_a_fourth_gyro_that_stands_askew() {
    let folder = tempfile::tempdir().unwrap();
    let place = |name: &str| folder.path().join(name).display().to_string();
    let askew = [0.6, 0.64, 0.48];
    let mut scenario = modes_rates::zeeman(6, Profile::constant(50.0).ramp(-30.0, 4.0).ramp(50.0, 4.0));
    if let Gyros::Zeeman(unit) = &mut scenario.instrument.gyros {
        unit.gyros.push(unit.gyros[1]);
    }
    let orientation = &mut scenario.instrument.gyro_orientation;
    orientation.rows.push(askew);
    orientation.rows_per_k.push([0.0; 3]);
    let (log, base, out) = (place("run.mcap"), place("four.toml"), place("modes.toml"));
    modes_rates::record(Path::new(&log), &[scenario]);
    let mut document = Written::read(&modes_rates::base(folder.path())).unwrap().document;
    let fourth = GyroSensor { name: "s".into(), ..document.gyro.sensor[1].clone() };
    document.gyro.sensor.push(fourth);
    document.gyro.orientation.rows.push(askew);
    if let Some(thermal) = &mut document.gyro.orientation.thermal {
        thermal.slopes_arcsec_per_deg_c.push([0.0; 3]);
    }
    save(&base, &document);
    let place = "--latitude 55.75 --heading 30 --json --out";
    let mut arguments = vec!["modes", &log, "--calibration", &base];
    arguments.extend(place.split(' '));
    let report = json(&[&arguments[..], &[&out]].concat());
    assert_eq!(report["accepted"], true, "{}", report["verdict"]);
    // The fourth is a copy of the second, and is found to be one, though the Earth turns it by another rate.
    let made = Written::read(Path::new(&out)).unwrap().document;
    let value = |gyro: usize, deg_c: f64| {
        let sensor = &made.gyro.sensor[gyro];
        [Feature::One, Feature::LasingMode]
            .map(|feature| sensor.terms.curve(feature))
            .map(|curve| curve.unwrap().shape().at(deg_c).unwrap())
    };
    for deg_c in [-25.0, 10.0, 45.0] {
        let (second, fourth) = (value(1, deg_c), value(3, deg_c));
        println!("{deg_c} °C: {second:?} {fourth:?}");
        second.iter().zip(fourth).for_each(|(a, b)| assert!((a - b).abs() < 0.06, "{deg_c} °C: {a} {b}"));
    }
}
