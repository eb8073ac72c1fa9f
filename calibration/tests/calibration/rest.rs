//! `drift` and `impact` on logs that are none of a unit at rest, as their user calls them.

use std::path::Path;

use isotherm_calibration::drift::columns::{Columns, Kind};
use isotherm_calibration::drift::pieces::Spacing;
use isotherm_calibration::drift::pieces::checks::{at_rest, frozen};

use crate::command::{fails, shipped, succeeds};
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
    let words = fails(&["drift", &dead, "--document", &document, "--out", &new], 1);
    assert!(words.contains("gyro y: every reading is 0: the sensor is dead"), "{words}");
    assert!(!Path::new(&new).exists(), "no document");
    let words = fails(&[&["impact", &dead, "--document", &document], &SHORT[..]].concat(), 1);
    assert!(words.contains("gyro y: every reading is 0: the sensor is dead"), "{words}");
}

#[test]
fn drift_and_impact_tell_of_frozen_readings_and_of_a_wrong_measure() {
    let folder = tempfile::tempdir().unwrap();
    let document = shipped("FOG-0001.toml").display().to_string();
    let both = |log: &str| {
        let drift = succeeds(&["drift", log, "--document", &document]);
        [drift, succeeds(&[&["impact", log, "--document", &document], &SHORT[..]].concat())]
    };
    let frozen = log(folder.path(), |columns| columns[1][3000..4000].fill(0.0), |_| true);
    for told in both(&frozen) {
        assert!(told.contains("gyro y reads exactly 0 from 3000.00 s to 3999.00 s"), "{told}");
    }
    let wrong = log(folder.path(), |columns| columns[2].iter_mut().for_each(|rate| *rate *= 57.3), |_| true);
    for told in both(&wrong) {
        assert!(told.contains("the Earth turns by 15 °/h: does the unit rest"), "{told}");
    }
    let moving = log(folder.path(), |columns| columns[2].iter_mut().for_each(|rate| *rate += 2e5), |_| true);
    for command in [&["drift"][..], &[&["impact"], &SHORT[..]].concat()] {
        let words = fails(&[command, &[&moving, "--document", &document]].concat(), 1);
        assert!(words.contains("at most 20 °/s is rest"), "{words}");
    }
}

#[test]
fn drift_states_nothing_beyond_what_a_document_allows() {
    let folder = tempfile::tempdir().unwrap();
    let spikes = log(
        folder.path(),
        |columns| columns[0].iter_mut().step_by(800).for_each(|rate| *rate = 1e11),
        |_| true,
    );
    let output = crate::command::calibrate(&["drift", &spikes]);
    let (code, told, words) = crate::command::words(&output);
    assert_eq!(code, Some(1));
    assert!(words.contains("gyro x: ") && words.contains("a document allows"), "{words}");
    assert!(told.contains("gyro x: 9 single readings are far beyond the noise"), "{told}");
    assert!(!told.contains("# gyro x") && told.contains("# gyro y"), "{told}");
}

#[test]
fn impact_tells_of_missing_ticks_and_of_what_a_short_log_lacks() {
    let folder = tempfile::tempdir().unwrap();
    let document = shipped("FOG-0001.toml").display().to_string();
    let gaps = log(folder.path(), |_| (), |index| index % 5 != 0);
    let told = succeeds(&[&["impact", &gaps, "--document", &document], &SHORT[..]].concat());
    assert!(told.contains("ticks (20.0 %) are missing"), "{told}");
    let words = fails(&["impact", &gaps, "--document", &document], 1);
    assert!(words.contains("FOG-0001.toml has no [gyro.sensor.drift]"), "{words}");
    let spoil = |columns: &mut [Vec<f64>; 3]| columns[0].iter_mut().step_by(5).for_each(|r| *r = f64::NAN);
    let holes = log(folder.path(), spoil, |_| true);
    let words = fails(&[&["impact", &holes, "--document", &document], &SHORT[..]].concat(), 1);
    assert!(words.contains("are no good numbers"), "{words}");
}

const TICK_NS: i64 = 20_000_000;

fn wave(count: usize) -> Vec<f64> {
    (0..count).map(|k| (k as f64 * 1.7).sin() + 0.3 * (k as f64 * 0.91).sin()).collect()
}

fn times(count: usize) -> Vec<i64> {
    (0..count as i64).map(|k| k * TICK_NS).collect()
}

fn frozen_in(column: &[f64]) -> Option<String> {
    frozen("gyro y", &times(column.len()), column)
}

#[test]
fn frozen_readings_are_told_and_coarse_or_slow_ones_are_not() {
    let good = wave(20_000);
    assert_eq!(frozen_in(&good), None);
    let mut half = good.clone();
    half[10_000..15_000].fill(0.5);
    let words = frozen_in(&half).unwrap();
    assert!(words.contains("gyro y reads exactly 0.5 from 200.00 s to 299.98 s"), "{words}");
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

#[test]
fn noise_of_two_measures_and_far_readings_are_told() {
    let mut columns = Columns {
        unit: isotherm_log::offline::unit_id("U").unwrap(),
        kind: Kind::Rate,
        names: vec!["x".to_owned()],
        corrected: true,
        end_ns: times(8000),
        duration_s: vec![0.02; 8000],
        values: vec![wave(8000)],
        frozen: Vec::new(),
        notes: Vec::new(),
    };
    let told = |columns: &Columns| {
        let spacing = Spacing::of(&columns.end_ns)?;
        at_rest(columns, &spacing)
    };
    assert!(told(&columns).unwrap().is_empty());
    columns.values[0][4000..].iter_mut().for_each(|reading| *reading *= 57.3);
    let words = told(&columns).unwrap().join("\n");
    assert!(words.contains("times as large between 80 s and 100 s"), "{words}");
    columns.values = vec![wave(8000)];
    columns.values[0][1000] = 1e9;
    let words = told(&columns).unwrap().join("\n");
    assert!(words.contains("1 single readings") && words.contains("the first at 20.00 s"), "{words}");
    columns.values = vec![wave(8000)];
    columns.values[0][1000..1100].fill(1e5);
    let words = told(&columns).unwrap().join("\n");
    assert!(
        words.contains("100 readings between 20.00 s and 21.98 s") && words.contains("did the unit turn")
    );
    columns.values = vec![wave(8000).iter().map(|reading| reading + 419.0).collect()];
    assert!(told(&columns).unwrap()[0].contains("reads 419 °/h"));
    columns.values = vec![wave(8000).iter().map(|reading| reading + 57.3 * 3600.0).collect()];
    let words = told(&columns).unwrap_err().to_string();
    assert!(words.contains("gyro x reads 57.3 °/s in the median, at most 20 °/s"), "{words}");
    columns.values = vec![wave(8000)];
    columns.duration_s = vec![0.01; 8000];
    let words = told(&columns).unwrap().join("\n");
    assert!(words.contains("ticks are 20.0 ms apart and last 10.0 ms"), "{words}");
    columns.duration_s = vec![2e-5; 8000];
    assert!(told(&columns).unwrap_err().to_string().contains("is the unit of the time column right"));
}
