//! `board`: the ratio of the electronics from cycles of a simulated chamber in two positions.

use isotherm_calibration::document::Written;
use isotherm_calibration::error::Error;
use isotherm_calibration::finding::{AccelKind, Kind};
use isotherm_calibration::fits::board::{Wanted, fit};
use isotherm_calibration::fits::thermal::{Site, Stand};
use isotherm_calibration::runs::Run;
use isotherm_correction::thermal::Feature;
use isotherm_protocol::document::{Curve, Document, Shape};
use isotherm_simulator::Scenario;
use isotherm_simulator::chamber::Profile;
use isotherm_simulator::presets::mems_chamber;
use serde_json::Value;

use crate::command::{headings, shipped, succeeds, told};
use crate::simulated_logs::{events, record_events, run};

/// Gravity alike on all three axes, and the opposite (pitch and roll, °).
const DIAGONAL: [[f64; 2]; 2] = [[35.264_389_682_754_654, -135.0], [-35.264_389_682_754_654, 45.0]];
/// r − 1 by powers of the board's temperature from 25 °C.
const RATIOS: [[f64; 2]; 3] = [[2.2e-5, 3.3e-8], [-1.7e-5, -2.5e-8], [2.9e-5, 4.4e-8]];

/// 001's cycle, −25 → 55 → −25 °C, one tick a second; on a thermostat scale and bias do not move.
fn scenario(seed: u64, [pitch_deg, roll_deg]: [f64; 2], thermostat: bool) -> Scenario {
    let chamber = Profile::constant(-25.0).hold(10.0).ramp(55.0, 2.0).hold(60.0).ramp(-25.0, 2.0);
    let mut scenario =
        Scenario { duration_s: chamber.duration_s(), chamber, tick_ns: 1_000_000_000, ..mems_chamber(seed) };
    scenario.motion.heading_deg = 30.0;
    scenario.motion.pitch_deg = pitch_deg;
    scenario.motion.roll_deg = roll_deg;
    let accels = scenario.instrument.accelerometers.as_mut().unwrap();
    for (sensor, [first, second]) in accels.sensors.iter_mut().zip(RATIOS) {
        sensor.board_ratio = [1.0, first, second];
        sensor.velocity_random_walk_m_per_s_per_sqrt_s = 3e-5;
        if thermostat {
            sensor.scale_v_per_m_per_s2[1..].fill(0.0);
            sensor.bias_v[1..].fill(0.0);
        }
    }
    scenario
}

/// The shipped document with the scale that is true at 25 °C, and the channel of the board.
fn base(thermostat: bool) -> Document {
    let mut document = Written::read(&shipped("MEMS-0001.toml")).unwrap().document;
    if document.temperature.channel.iter().all(|channel| channel.name != "board") {
        let mut board = document.temperature.channel[0].clone();
        "board".clone_into(&mut board.name);
        document.temperature.channel.push(board);
    }
    for sensor in document.accel.iter_mut().flat_map(|accel| &mut accel.sensor) {
        let constant = Shape::Constant { value: sensor.scale_factor.shape().at(25.0).unwrap() };
        sensor.scale_factor = Curve::new(constant).in_unit(sensor.scale_factor.unit());
        sensor.board_channel = Some("board".to_owned());
        if thermostat {
            sensor.channel = None;
            sensor.set(Feature::One, None);
        }
    }
    document.origin = None;
    document
}

#[test]
fn a_two_position_cycle_finds_the_ratio_and_another_cycle_judges_it() {
    let folder = tempfile::tempdir().unwrap();
    let place = |name: &str| folder.path().join(name).display().to_string();
    let logs: Vec<String> = (0..4_u64)
        .map(|number| {
            let path = place(&format!("log{number}.mcap"));
            let attitude = DIAGONAL[usize::try_from(number % 2).unwrap()];
            record_events(path.as_ref(), "MEMS-0001", events(&scenario(10 + number, attitude, true)));
            path
        })
        .collect();
    let (document, out, page) = (place("base.toml"), place("out.toml"), place("board.html"));
    std::fs::write(&document, Written::of(&base(true)).unwrap().text).unwrap();
    let stands = "--latitude 55.75 --heading 30 --pitch 35.264389682754654 --roll -135 --pitch -35.264389682754654 --roll 45 \
        --pitch 35.264389682754654 --roll -135 --pitch -35.264389682754654 --roll 45";
    let stands: Vec<&str> = stands.split_whitespace().collect();
    let call = [
        &["board", &logs[0], &logs[1], "--judge", &logs[2], "--judge", &logs[3], "--calibration", &document],
        &["--reference", "25", "--out", &out, "--html", &page, "--json"][..],
        &stands,
    ]
    .concat();
    let report: Value = serde_json::from_str(&succeeds(&call)).unwrap();
    assert_eq!(report["accepted"], true, "{}", report["verdict"]);
    let new = Written::read(out.as_ref()).unwrap().document;
    for (sensor, [first, second]) in new.accel.as_ref().unwrap().sensor.iter().zip(RATIOS) {
        let shape = sensor.board_ratio_error.as_ref().unwrap().shape();
        for deg_c in [-15.0, 0.0, 25.0, 40.0, 55.0] {
            let away = deg_c - 25.0;
            let truth = 1e6 * (first * away + second * away * away);
            let found = shape.at(deg_c).unwrap();
            assert!(
                (found - truth).abs() < 8.0,
                "{} at {deg_c} °C: {found} ppm, {truth} is true",
                sensor.name
            );
        }
    }
    for axis in 0..3 {
        let rms = |when: &str| report["verdicts"][axis]["out_of_sample"][when]["rms"].as_f64().unwrap();
        assert!(rms("after") < 0.1 * rms("before"), "{axis}: {} {}", rms("before"), rms("after"));
    }
    let details = new.origin.unwrap().details.unwrap();
    assert!(details["board"]["coefficients"]["accelerometer x board ratio, power 1"]["sigma"].is_float());
    assert!(details["sigma"]["accel"]["x"]["board_ratio_error"].is_array());
    // Without positions there is nothing to tell it by.
    let without = told(folder.path(), &["board", &logs[0], &logs[1], "--calibration", &document]);
    insta::assert_snapshot!(headings(&page) + &without);
}

#[test]
fn logs_that_do_not_tell_the_ratio_are_refused_by_kind() {
    let kinds = |base: &Document, attitudes: [[f64; 2]; 2], thermostat: bool| -> Vec<AccelKind> {
        let runs: Vec<Run> = attitudes
            .into_iter()
            .enumerate()
            .map(|(number, attitude)| {
                let events = events(&scenario(20 + number as u64, attitude, thermostat));
                run(&format!("log {number}"), "MEMS-0001", events)
            })
            .collect();
        let stands = attitudes
            .map(|tilt| Stand { site: Site::at(55.75, 30.0, Some(tilt), None).unwrap(), turning: None });
        let wanted =
            Wanted { runs: &runs, judges: &[], stands: &stands, base, reference_deg_c: None, window_s: 10.0 };
        let Err(Error::Found(findings)) = fit(&wanted) else { panic!("it must be refused") };
        assert_eq!(
            findings.iter().filter_map(|found| found.place.accel.as_deref()).collect::<String>(),
            "xyz"
        );
        let kind = |found: isotherm_calibration::finding::Finding| match found.kind {
            Kind::Accel(kind) => kind,
            other => panic!("{other:?}"),
        };
        findings.into_iter().map(kind).collect()
    };
    // Both follow the chamber.
    let follows = kinds(&base(false), DIAGONAL, false);
    assert!(follows.iter().all(|kind| matches!(kind, AccelKind::BoardFollows { .. })), "{follows:?}");
    let same = kinds(&base(true), [DIAGONAL[0]; 2], true);
    assert!(same.iter().all(|kind| matches!(kind, AccelKind::SameInput { .. })), "{same:?}");
    let mut unnamed = base(true);
    unnamed
        .accel
        .iter_mut()
        .flat_map(|accel| &mut accel.sensor)
        .for_each(|sensor| sensor.board_channel = None);
    let unnamed = kinds(&unnamed, DIAGONAL, true);
    assert!(unnamed.iter().all(|kind| *kind == AccelKind::NoBoardChannel), "{unnamed:?}");
}
