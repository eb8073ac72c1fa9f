//! `drift` and `impact` on logs that are none of a unit at rest, as their user calls them.

use std::path::Path;

use isotherm_calibration::fits::drift::columns::{Columns, Kind};
use isotherm_calibration::fits::drift::pieces::Spacing;
use isotherm_calibration::fits::drift::pieces::checks::{at_rest, frozen};
use serde_json::Value;

use crate::command::{fails, json, shipped, succeeds, told};
use crate::drift_generator::{Normal, recording};

/// Two hours at 1 Hz of three gyros; `change` spoils the readings (°/h), `keep` says which ticks are there.
fn log(folder: &Path, change: impl Fn(&mut [Vec<f64>; 3]), keep: impl Fn(usize) -> bool) -> String {
    let mut normal = Normal::new(8);
    let mut columns =
        [7.0, -4.0, -12.0].map(|mean| normal.white(7200, 0.6).iter().map(|white| white + mean).collect());
    change(&mut columns);
    let there = std::fs::read_dir(folder).unwrap().count();
    let path = folder.join(format!("rest-{there}.mcap"));
    recording(&path, "FOG-0001", &columns, 1_000_000_000, keep);
    path.display().to_string()
}

const SHORT: [&str; 4] = ["--calibration-hours", "0.5", "--hours", "1"];

#[test]
fn drift_and_impact_refuse_a_dead_gyro_behind_a_correction() {
    let folder = tempfile::tempdir().unwrap();
    let document = shipped("FOG-0001.toml").display().to_string();
    let new = folder.path().join("new.toml").display().to_string();
    let dead = log(folder.path(), |columns| columns[1].fill(0.0), |_| true);
    let drift = fails(&["drift", &dead, "--calibration", &document, "--out", &new], 1);
    assert!(!Path::new(&new).exists(), "no document");
    let impact = fails(&[&["impact", &dead, "--calibration", &document], &SHORT[..]].concat(), 1);
    insta::assert_snapshot!((drift + &impact).replace(folder.path().to_str().unwrap(), "FOLDER"));
}

#[test]
fn drift_and_impact_tell_of_frozen_readings_and_of_a_wrong_measure() {
    let folder = tempfile::tempdir().unwrap();
    let document = shipped("FOG-0001.toml").display().to_string();
    let both = |log: &str| {
        let drift = succeeds(&["drift", log, "--calibration", &document]);
        [drift, succeeds(&[&["impact", log, "--calibration", &document], &SHORT[..]].concat())]
    };
    let frozen = log(folder.path(), |columns| columns[1][3000..4000].fill(0.0), |_| true);
    let wrong = log(folder.path(), |columns| columns[2].iter_mut().for_each(|rate| *rate *= 57.3), |_| true);
    let mut told = [both(&frozen), both(&wrong)].concat().concat();
    let moving = log(folder.path(), |columns| columns[2].iter_mut().for_each(|rate| *rate += 2e5), |_| true);
    for command in [&["drift"][..], &[&["impact"], &SHORT[..]].concat()] {
        told += &fails(&[command, &[&moving, "--calibration", &document]].concat(), 1);
    }
    insta::assert_snapshot!(told.replace(folder.path().to_str().unwrap(), "FOLDER"));
}

#[test]
fn drift_states_nothing_beyond_what_a_document_allows() {
    let folder = tempfile::tempdir().unwrap();
    let turned = log(folder.path(), |columns| columns[0][3000..3100].fill(1e11), |_| true);
    insta::assert_snapshot!(told(folder.path(), &["drift", &turned]));
    let (_, json, _) = crate::command::words(&crate::command::calibrate(&["drift", &turned, "--json"]));
    let report: Value = serde_json::from_str(&json).unwrap();
    let noted = [0, 1].map(|gyro| report["sensors"][gyro]["drift_notes"].is_array());
    assert_eq!(noted, [false, true], "{report}");
}

#[test]
fn drift_states_no_ramp_of_a_log_with_gaps() {
    let folder = tempfile::tempdir().unwrap();
    let rising = |columns: &mut [Vec<f64>; 3]| {
        columns[0].iter_mut().enumerate().for_each(|(tick, rate)| *rate += 0.01 * tick as f64);
    };
    let states = |kept: fn(usize) -> bool| {
        let report = json(&["drift", &log(folder.path(), rising, kept), "--json"]);
        report["sensors"][0]["noise"]["R"]["value"].is_number()
    };
    assert_eq!([states(|_| true), states(|tick| !(4000..4300).contains(&tick))], [true, false]);
}

#[test]
fn drift_leaves_single_readings_far_beyond_the_noise_out() {
    let folder = tempfile::tempdir().unwrap();
    let spoil =
        |columns: &mut [Vec<f64>; 3]| columns[0].iter_mut().step_by(800).for_each(|rate| *rate = 1e11);
    let spikes = log(folder.path(), spoil, |_| true);
    let document = shipped("FOG-0001.toml").display().to_string();
    let corrected = succeeds(&["drift", &spikes, "--calibration", &document]);
    let told = succeeds(&["drift", &spikes]);
    insta::assert_snapshot!(
        format!("{corrected}\n{told}").replace(folder.path().to_str().unwrap(), "FOLDER")
    );
    let walk =
        |log: &str| json(&["drift", log, "--json"])["sensors"][0]["noise"]["N"]["value"].as_f64().unwrap();
    let good = walk(&log(folder.path(), |_| (), |_| true));
    assert!((walk(&spikes) / good - 1.0).abs() < 0.02, "{told}");
}

#[test]
fn corrected_accelerometers_that_do_not_feel_gravity_are_told() {
    let of = |level: [f64; 3]| Columns {
        kind: Kind::Force,
        names: ["x", "y", "z"].map(str::to_owned).to_vec(),
        values: level.map(|level| wave(8000).iter().map(|reading| reading * 1e-3 + level).collect()).to_vec(),
        ..columns(wave(8000))
    };
    let told = |columns: Columns| {
        let spacing = Spacing::of(&columns.end_ns).unwrap();
        at_rest(&mut columns.clone(), &spacing).unwrap().join("\n")
    };
    assert_eq!(told(of([0.3, -0.2, -9.79])), "");
    insta::assert_snapshot!(told(of([0.03, -0.02, -1.0])));
    assert_eq!(told(Columns { corrected: false, ..of([0.03, -0.02, -1.0]) }), "", "they may be volts");
}

#[test]
fn drift_tells_of_a_step() {
    let folder = tempfile::tempdir().unwrap();
    let good = succeeds(&["drift", &log(folder.path(), |_| (), |_| true)]);
    let step = |columns: &mut [Vec<f64>; 3]| {
        let middle = columns[1].len() / 2;
        columns[1][middle..].iter_mut().for_each(|rate| *rate += 20.0);
    };
    let stepped = log(folder.path(), step, |_| true);
    let told = succeeds(&["drift", &stepped]);
    // Times are those that --start takes, of the readings and of the corrected ones.
    let fog = shipped("FOG-0001.toml").display().to_string();
    for more in [&[][..], &["--calibration", &fog]] {
        let part = succeeds(&[&["drift", &stepped, "--start", "3000"], more].concat());
        let (_, words) = part.split_once("at about ").unwrap();
        let at_s: f64 = words.split_once(' ').unwrap().0.parse().unwrap();
        assert!((at_s - 3600.0).abs() < 100.0, "{part}");
    }
    insta::assert_snapshot!((good + &told).replace(folder.path().to_str().unwrap(), "FOLDER"));
}

#[test]
fn impact_takes_a_gyro_only_where_it_has_something() {
    let without = fails(&["impact", "--seeds", "2", "--gyro", "x"], 2);
    let each = fails(&["impact", "--seeds", "2", "--trend", "0.0001", "--gyro", "each"], 2);
    insta::assert_snapshot!(without + &each);
}

#[test]
fn impact_tells_of_missing_ticks_and_of_what_a_short_log_lacks() {
    let folder = tempfile::tempdir().unwrap();
    let document = shipped("FOG-0001.toml").display().to_string();
    let gaps = log(folder.path(), |_| (), |index| index % 5 != 0);
    let mut told = succeeds(&[&["impact", &gaps, "--calibration", &document], &SHORT[..]].concat());
    told += &fails(&["impact", &gaps, "--calibration", &document], 1).replace(&document, "FOG-0001.toml");
    let spoil = |columns: &mut [Vec<f64>; 3]| columns[0].iter_mut().step_by(5).for_each(|r| *r = f64::NAN);
    let holes = log(folder.path(), spoil, |_| true);
    told += &fails(&[&["impact", &holes, "--calibration", &document], &SHORT[..]].concat(), 1);
    insta::assert_snapshot!(told.replace(folder.path().to_str().unwrap(), "FOLDER"));
}

const TICK_NS: i64 = 20_000_000;

fn wave(count: usize) -> Vec<f64> {
    (0..count).map(|k| (k as f64 * 1.7).sin() + 0.3 * (k as f64 * 0.91).sin()).collect()
}

fn times(count: usize) -> Vec<i64> {
    (0..count as i64).map(|k| k * TICK_NS).collect()
}

fn frozen_in(column: &[f64]) -> Option<String> {
    frozen("gyro y", (0.0, &times(column.len())), column)
}

#[test]
fn frozen_readings_are_told_and_coarse_or_slow_ones_are_not() {
    let good = wave(20_000);
    assert_eq!(frozen_in(&good), None);
    let mut half = good.clone();
    half[10_000..15_000].fill(0.5);
    insta::assert_snapshot!(frozen_in(&half).unwrap());
    let mut short = good.clone();
    short[10_000..10_100].fill(0.5);
    assert_eq!(frozen_in(&short), None, "half a hundredth of the log");
    // Counts that are nearly always the same, and a sensor that is read more often than it measures.
    let coarse: Vec<f64> = (0..20_000).map(|k| if k % 900 < 2 { 1.0 } else { 0.0 }).collect();
    assert_eq!(frozen_in(&coarse), None);
    let mut slow: Vec<f64> = good.iter().step_by(10).flat_map(|reading| [*reading; 10]).collect();
    slow[3000..3300].fill(0.5);
    assert_eq!(frozen_in(&slow), None);
}

/// One corrected gyro.
fn columns(readings: Vec<f64>) -> Columns {
    Columns {
        unit: isotherm_log::offline::unit_id("U").unwrap(),
        kind: Kind::Rate,
        names: vec!["x".to_owned()],
        corrected: true,
        start_s: 0.0,
        end_ns: times(readings.len()),
        duration_s: vec![0.02; readings.len()],
        values: vec![readings],
        frozen: Vec::new(),
        notes: Vec::new(),
    }
}

#[test]
fn steps_are_told_from_noise_and_slow_drift() {
    const COUNT: usize = 20_000;
    let told = |readings: Vec<f64>| {
        let mut columns = columns(readings);
        let spacing = Spacing::of(&columns.end_ns).unwrap();
        at_rest(&mut columns, &spacing).unwrap()
    };
    let sum = |a: Vec<f64>, b: Vec<f64>| a.iter().zip(b).map(|(a, b)| a + b).collect::<Vec<f64>>();
    for seed in 0..40 {
        let normal = &mut Normal::new(seed);
        let white = normal.white(COUNT, 1.0);
        let day = white.iter().enumerate().map(|(k, white)| white + 2.0 * (k as f64 * 6e-4).sin()).collect();
        let ramp =
            white.iter().enumerate().map(|(k, white)| white + 1e-3 * (k as f64 - 12e3).max(0.0)).collect();
        let walk = sum(white.clone(), normal.random_walk(COUNT, 0.05));
        let flicker = sum(white.clone(), normal.flicker(COUNT, 0.5));
        for (kind, readings) in
            [("white", white), ("day", day), ("ramp", ramp), ("walk", walk), ("flicker", flicker)]
        {
            assert_eq!(told(readings.clone()), [""; 0], "seed {seed}, {kind}");
            if kind == "white" {
                // A part of the log has 157 readings, its mean a deviation of 0.08.
                let stepped =
                    readings.iter().enumerate().map(|(k, x)| if k < 11_000 { *x } else { x + 2.0 }).collect();
                // From what, to what (°/h), and when (s).
                let words = told(stepped).join("\n");
                let numbers: Vec<f64> = words.split(' ').filter_map(|word| word.parse().ok()).collect();
                let [before, behind, at] = numbers[..] else { panic!("seed {seed}: {words}") };
                assert!(
                    (at - 220.0).abs() < 7.0 && (behind - before - 2.0).abs() < 0.5,
                    "seed {seed}: {words}"
                );
            }
        }
    }
}

#[test]
fn noise_of_two_measures_and_far_readings_are_told() {
    let mut columns = columns(wave(8000));
    let told = |columns: &Columns| {
        let spacing = Spacing::of(&columns.end_ns)?;
        at_rest(&mut columns.clone(), &spacing)
    };
    assert!(told(&columns).unwrap().is_empty());
    columns.values[0][4000..].iter_mut().for_each(|reading| *reading *= 57.3);
    let mut words = told(&columns).unwrap();
    columns.values = vec![wave(8000)];
    columns.values[0][1000] = 1e9;
    words.extend(told(&columns).unwrap());
    columns.values = vec![wave(8000)];
    columns.values[0][1000..1100].fill(1e5);
    words.extend(told(&columns).unwrap());
    columns.values = vec![wave(8000).iter().map(|reading| reading + 419.0).collect()];
    words.extend(told(&columns).unwrap());
    columns.values = vec![wave(8000).iter().map(|reading| reading + 57.3 * 3600.0).collect()];
    words.push(told(&columns).unwrap_err().to_string());
    columns.values = vec![wave(8000)];
    columns.duration_s = vec![0.01; 8000];
    words.extend(told(&columns).unwrap());
    columns.duration_s = vec![2e-5; 8000];
    words.push(told(&columns).unwrap_err().to_string());
    insta::assert_snapshot!(words.join("\n"));
}

#[test]
fn a_drift_slower_than_its_log_is_called_so_wherever_it_is_stated() {
    let folder = tempfile::tempdir().unwrap();
    let log = folder.path().join("walk.mcap");
    let columns = [1, 2, 3].map(|seed| {
        let mut normal = Normal::new(seed);
        let white = normal.white(28_800, 3.0);
        let walk = normal.random_walk(28_800, 2.0 / 60.0);
        white.iter().zip(walk).map(|(white, walk)| white + walk).collect::<Vec<f64>>()
    });
    recording(&log, "FOG-0001", &columns, 1_000_000_000, |_| true);
    let log = log.display().to_string();
    let (said, report) = (succeeds(&["drift", &log]), json(&["drift", &log, "--json"]));
    let rows = report["tables"]["Drift"]["rows"].as_array().unwrap().iter();
    let markov =
        rows.filter(|row| row[0].as_str().unwrap().contains("Markov") || row[0] == "its correlation time, h");
    let told = said.lines().take(7).map(str::to_owned).chain(markov.map(Value::to_string));
    insta::assert_snapshot!(told.collect::<Vec<_>>().join("\n"));
}
