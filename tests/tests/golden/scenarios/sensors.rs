//! Sensors that fail, that read too much, or no number at all.

use isotherm_correction::sample::OutputKind;
use isotherm_tests::calibrations::compile;
use isotherm_tests::lives::{FULL_CHANNELS, full};
use isotherm_tests::script::{Kind, Odd, Scenario, Script};

use crate::plain::{RICH_CHANNELS, redundant_script, rich_parts, rich_script, told, with_outputs};

fn odd(kind: Kind, sensor: Option<usize>, from: u64, ticks: u64, value: f64) -> Odd {
    Odd { kind, sensor, ticks: from..from + ticks, value }
}

/// Six sensors of each kind; one gyro is off for too short to be excluded, another for good, and so an accelerometer.
pub(crate) fn parity_of_six() -> Scenario {
    let mut script = redundant_script(51, 6, 25);
    (script.swing, script.batch) = (5.0, 5);
    script.odd = vec![
        odd(Kind::Gyro, Some(1), 1100, 20, 0.4),
        odd(Kind::Gyro, Some(4), 1200, 900, 0.3),
        odd(Kind::Accel, Some(2), 1400, 900, 3.0),
        odd(Kind::Accel, Some(0), 1550, 10, 60.0),
    ];
    script.ticks(800);
    script.restart();
    script.ticks(100);
    told(script)
}

/// Eight of each, which fail one behind the other until two are left.
pub(crate) fn parity_of_eight_until_two_are_left() -> Scenario {
    let mut script = redundant_script(52, 8, 5);
    (script.swing, script.batch) = (5.0, 3);
    for (failed, value) in (0..6_u8).zip([0.4, -0.9, 1.3, -2.1, 3.4, -5.5]) {
        let (sensor, from) = (usize::from(failed), 1050 + 60 * u64::from(failed));
        script.odd.push(odd(Kind::Gyro, Some(sensor), from, 10_000, value));
        script.odd.push(odd(Kind::Accel, Some(sensor), from + 30, 10_000, 20.0 * value));
    }
    script.ticks(500);
    script.odd.clear();
    script.ticks(60);
    told(script)
}

/// The same with sensors that read no number any more.
pub(crate) fn eight_sensors_of_which_six_read_no_number() -> Scenario {
    let mut script = redundant_script(53, 8, 5);
    (script.swing, script.batch) = (5.0, 3);
    for failed in 0..6_u8 {
        let (sensor, from) = (usize::from(failed), 1050 + 40 * u64::from(failed));
        script.odd.push(odd(Kind::Gyro, Some(sensor), from, 400, f64::NAN));
        script.odd.push(odd(Kind::Accel, Some(sensor), from + 20, 400, f64::INFINITY));
    }
    script.ticks(600);
    told(script)
}

/// The document's four of each; parity counts on through switches of the mode.
pub(crate) fn parity_of_four_over_mode_switches() -> Scenario {
    let mut script = Script::new(54, &full(), &FULL_CHANNELS);
    (script.switches, script.batch, script.fails) = (90, 4, Some((3, 1300)));
    script.odd = vec![odd(Kind::Gyro, Some(0), 1700, 60, 5000.0), odd(Kind::Accel, Some(3), 1500, 900, 90.0)];
    script.ticks(1100);
    told(script)
}

/// At the limit, just below it and beyond, in both directions; one sensor and all.
pub(crate) fn rails_of_counting_sensors() -> Scenario {
    let mut script = Script::new(55, &full(), &FULL_CHANNELS);
    script.batch = 4;
    let values = [7299.0, 7300.0, 7301.0, -7299.0, -7300.0, -7301.0, 2e9, -2e9];
    for (value, from) in values.into_iter().zip((1100..).step_by(16)) {
        script.odd.push(odd(Kind::Gyro, Some(1), from, 3, value));
        script.odd.push(odd(Kind::Accel, Some(0), from + 8, 3, value - 6320.0 * value.signum()));
    }
    script.odd.push(odd(Kind::Gyro, None, 1250, 5, 200_000.0));
    script.odd.push(odd(Kind::Accel, None, 1260, 5, -200_000.0));
    script.ticks(300);
    script.switches = 64;
    script.odd.push(odd(Kind::Gyro, Some(2), 1340, 2, 9000.0));
    script.odd.push(odd(Kind::Gyro, None, 1408, 1, 9000.0));
    script.ticks(200);
    told(script)
}

pub(crate) fn rails_of_mean_sensors() -> Scenario {
    let parts = with_outputs(rich_parts(0.0), OutputKind::Mean, OutputKind::Mean);
    let mut script = Script::new(56, &compile(&parts), &RICH_CHANNELS);
    script.batch = 2;
    let values = [4.999_999, 5.0, 5.000_001, -4.999_999, -5.0, -5.000_001, 1e300, -1e300, f64::MAX];
    for (value, from) in values.into_iter().zip((1050..).step_by(12)) {
        script.odd.push(odd(Kind::Gyro, Some(0), from, 2, value));
        script.odd.push(odd(Kind::Accel, Some(1), from + 6, 2, 40.0 * value));
    }
    script.odd.push(odd(Kind::Gyro, None, 1180, 4, -70.0));
    script.odd.push(odd(Kind::Accel, None, 1190, 4, 1e9));
    script.ticks(300);
    told(script)
}

/// In one sensor, in all, from the first tick on, and over a mode switch.
pub(crate) fn readings_that_are_no_numbers() -> Scenario {
    let mut script = rich_script(57);
    (script.batch, script.switches) = (2, 80);
    for (value, from) in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY].into_iter().zip((1050..).step_by(40)) {
        script.odd.push(odd(Kind::Gyro, Some(1), from, 3, value));
        script.odd.push(odd(Kind::Accel, Some(2), from + 5, 3, value));
        script.odd.push(odd(Kind::Gyro, None, from + 10, 4, value));
        script.odd.push(odd(Kind::Accel, None, from + 16, 4, value));
    }
    script.odd.push(odd(Kind::Gyro, None, 1000, 2, f64::NAN));
    script.odd.push(odd(Kind::Accel, None, 1000, 3, f64::NAN));
    script.odd.push(odd(Kind::Gyro, Some(0), 1198, 12, f64::NAN));
    script.ticks(300);
    told(script)
}
