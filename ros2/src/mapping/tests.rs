//! What the shipped mapping says, and what is said about bad ones.

use super::*;
use crate::qos::{History, Reliability};

const GOOD: &str =
    "version = 1\n[[unit]]\nserial = \"A-1\"\nraw = \"/raw\"\ncorrected = \"/imu\"\ntime.tick_ms = 10\n";

fn problems(text: &str) -> Vec<String> {
    let problems = Mapping::parse(text, "m.toml").expect_err("a bad mapping");
    problems.iter().map(ToString::to_string).collect()
}

#[test]
fn the_shipped_mapping_is_read() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../config/ros2.toml");
    let mapping = Mapping::load(&path).unwrap();
    let [unit] = &*mapping.units else { panic!("{mapping:?}") };
    assert_eq!(
        (mapping.node.as_str(), unit.unit.as_str(), unit.temperatures.len()),
        ("isotherm", "MEMS-0001", 8)
    );
    assert_eq!(
        unit.output,
        Qos { reliability: Reliability::Reliable, history: History::KeepLast, depth: 10 }
    );
    assert!(unit.time.is_measured() && unit.time.tick().as_ns() == 10_000_000);
    // 0.15 °/√h.
    assert!((unit.gyro.random_walk().unwrap() - 4.363_323e-5).abs() < 1e-10);
    assert!((unit.accel.unwrap().random_walk().unwrap() - 5e-4).abs() < 1e-15);
}

#[test]
fn what_is_left_out_has_its_default() {
    let mapping = Mapping::parse(GOOD, "m").unwrap();
    let unit = &mapping.units[0];
    assert_eq!((mapping.namespace.as_str(), mapping.diagnostics.as_str()), ("/", "/diagnostics"));
    assert_eq!((unit.accel, unit.time.uncertainty_s(), unit.frame_id.as_deref()), (None, None, None));
    assert_eq!(unit.gyro.unit, GyroUnit::RadPerS);
}

#[test]
fn every_problem_has_its_place() {
    let text = "version = 1\nnode = \"1x\"\n[[unit]]\nserial = \"A 1\"\nraw = \"raw\"\ncorrected = \"/a__b\"\n[unit.time]\ntick_ms = 0\n\
                stamps = \"end\"\n[unit.gyro]\nunit = \"deg\\u002Fs\"\n";
    insta::assert_snapshot!(problems(text).join("\n"));
}

#[test]
fn what_contradicts_itself_is_refused() {
    let loops = GOOD.replace("\"/imu\"", "\"/raw\"");
    let twice = format!(
        "{GOOD}{}",
        GOOD.replace("version = 1\n", "").replace("/raw", "/raw2").replace("/imu", "/imu2")
    );
    let channels = format!(
        "{GOOD}temperature = [{{ topic = \"/t\", channel = \"b\" }}, {{ topic = \"/u\", channel = \"b\" }}]\n"
    );
    let waits = format!("{GOOD}time.stamp = \"start\"\ntime.duration = \"measured\"\n");
    let jitter = format!("{GOOD}time.uncertainty_us = 2000\n");
    let refused = [&loops, &twice, &channels, &waits, &jitter, "version = 2\n"].map(problems);
    insta::assert_snapshot!(refused.concat().join("\n"));
}
