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
    assert!(unit.time.measured && unit.tick.as_ns() == 10_000_000);
    // 0.15 °/√h.
    assert!((unit.gyro.random_walk.unwrap() - 4.363_323e-5).abs() < 1e-10);
    assert!((unit.accel.unwrap().random_walk.unwrap() - 5e-4).abs() < 1e-15);
}

#[test]
fn what_is_left_out_has_its_default() {
    let mapping = Mapping::parse(GOOD, "m").unwrap();
    let unit = &mapping.units[0];
    assert_eq!((mapping.namespace.as_str(), mapping.diagnostics.as_str()), ("/", "/diagnostics"));
    assert_eq!((unit.accel, unit.stamp_uncertainty_s, unit.frame_id.as_deref()), (None, None, None));
    assert_eq!(unit.gyro.conversion.factor.to_bits(), 1.0_f64.to_bits());
}

#[test]
fn every_problem_has_its_place() {
    let text = "version = 1\nnode = \"1x\"\n[[unit]]\nserial = \"A 1\"\nraw = \"raw\"\ncorrected = \"/a__b\"\n[unit.time]\ntick_ms = 0\n\
                stamps = \"end\"\n[unit.gyro]\nunit = \"deg\\u002Fs\"\n";
    let found = problems(text);
    for (place, words) in [
        ("m.toml:2:8: node", "must be letters"),
        ("m.toml:4:10: unit[0].serial", "must be 1 to 64 letters"),
        ("m.toml:5:7: unit[0].raw", "must be a name with its leading slash"),
        ("m.toml:6:13: unit[0].corrected", "must be a name with its leading slash"),
        ("m.toml:8:11: unit[0].time.tick_ms", "must be"),
        ("m.toml:9:1: unit[0].time.stamps", "did you mean `stamp`?"),
        ("m.toml:11:8: unit[0].gyro.unit", "must be one of"),
    ] {
        assert!(
            found.iter().any(|it| it.starts_with(place) && it.contains(words)),
            "{place}, {words}: {found:#?}"
        );
    }
    assert_eq!(found.len(), 7, "{found:#?}");
}

#[test]
fn what_contradicts_itself_is_refused() {
    let loops = GOOD.replace("\"/imu\"", "\"/raw\"");
    assert_eq!(
        problems(&loops),
        ["m.toml:5:13: unit[0].corrected: is \"/raw\", already the topic of unit[0].raw: use another"]
    );
    let twice = format!(
        "{GOOD}{}",
        GOOD.replace("version = 1\n", "").replace("/raw", "/raw2").replace("/imu", "/imu2")
    );
    assert!(
        problems(&twice)[0].contains("unit[1].serial: is \"A-1\", which is the serial of an earlier unit")
    );
    let channels = format!(
        "{GOOD}temperature = [{{ topic = \"/t\", channel = \"b\" }}, {{ topic = \"/u\", channel = \"b\" }}]\n"
    );
    assert!(problems(&channels)[0].contains("unit[0].temperature[1].channel: is \"b\""));
    let waits = format!("{GOOD}time.stamp = \"start\"\ntime.duration = \"measured\"\n");
    assert!(problems(&waits)[0].contains("time.duration: is \"measured\""));
    let jitter = format!("{GOOD}time.uncertainty_us = 2000\n");
    assert!(
        problems(&jitter)[0].contains("uncertainty_us: is 2000, must be at most 1179"),
        "{:?}",
        problems(&jitter)
    );
    assert!(problems("version = 2\n")[0].contains("this release reads 1"));
}
