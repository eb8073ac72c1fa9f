//! `drift` and `impact` on logs that are none of a unit at rest, as their user calls them.

use std::path::Path;

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
