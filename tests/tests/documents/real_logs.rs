//! The documents of the real logs, with the figures that are known of these logs.

use std::path::Path;
use std::sync::Arc;

use isotherm_correction::sample::CorrectedTick;
use isotherm_correction::thermal::Feature;
use isotherm_correction::units::AngularRate;
use isotherm_tests::data;
use isotherm_tests::logs::{RealLog, correct, events};
use isotherm_tests::simulated::Size;

use crate::{compile, parsed};

fn corrected(data: &Path, document: &str, log: RealLog) -> Vec<CorrectedTick> {
    correct(&Arc::new(parsed(document).calibration), &events(data, log).unwrap())
}

#[test]
fn needs_data_the_parked_laser_gyro_reads_the_known_mean_rates() {
    let Some(data) = data::folder() else { return };
    let ticks = corrected(&data, "rlg-static.toml", RealLog::RlgStatic);
    assert_eq!(ticks.len(), 184_718);
    let first = &ticks[..180_000];
    for (axis, expected) in [-12.265, 0.474, 8.354].into_iter().enumerate() {
        let angle: f64 = first.iter().map(|tick| tick.delta_angle[axis]).sum();
        let rate = AngularRate::from_rad_per_s(angle / 1800.0).as_deg_per_h();
        println!("axis {axis}: {rate:.4} °/h, known {expected} °/h");
        assert!((rate - expected).abs() < 0.001, "axis {axis}: {rate} °/h");
    }
}

#[test]
fn needs_data_the_parked_laser_gyro_feels_the_gravity_of_its_place() {
    let Some(data) = data::folder() else { return };
    let ticks = corrected(&data, "rlg-static.toml", RealLog::RlgStatic);
    let force = [0, 1, 2]
        .map(|axis| ticks[..180_000].iter().map(|tick| tick.delta_velocity[axis]).sum::<f64>() / 1800.0);
    let norm = force.iter().map(|f| f * f).sum::<f64>().sqrt();
    // Normal gravity at 34.246° N, less 3.086e-6 1/s² times 380 m.
    let gravity = isotherm_simulator::motion::normal_gravity_m_per_s2(34.246_048) - 3.086e-6 * 380.0;
    println!("{norm:.5} m/s² of {gravity:.5} m/s²: {:.0} µg", (norm / gravity - 1.0) * 1e6);
    // This settles which g the log's µg·s are of: with the standard one it would be 2690 µg more.
    assert!((norm / gravity - 1.0).abs() < 100e-6, "{norm} m/s²");
}

#[test]
fn needs_data_the_cubic_of_the_chamber_log_reaches_the_known_residuals() {
    let Some(data) = data::folder() else { return };
    let log = events(&data, RealLog::ChamberMems).unwrap();
    let document = parsed("chamber-mems.toml").document;
    let deviations = |calibration: &Arc<_>| {
        // The first row is an outlier.
        let ticks = &correct(calibration, &log)[1..];
        let rates = ticks
            .iter()
            .map(|t| AngularRate::from_rad_per_s(t.delta_angle[1] / t.duration.as_s()).as_deg_per_s());
        let forces = ticks.iter().map(|t| t.delta_velocity[2] / t.duration.as_s());
        [Size::of(rates).deviation, Size::of(forces).deviation]
    };
    let mut bare = document.nominal();
    for sensor in &mut bare.accel.as_mut().unwrap().sensor {
        sensor.set(Feature::One, None);
    }
    let known =
        [("as logged", compile(&bare), [1.77e-2, 0.189]), ("cubic", compile(&document), [9.5e-4, 0.044])];
    for (name, calibration, expected) in known {
        let got = deviations(&calibration);
        println!("{name}: gyro.y {:.3e} °/s, accel.z {:.4} m/s²", got[0], got[1]);
        for (got, expected) in got.into_iter().zip(expected) {
            assert!((got / expected - 1.0).abs() < 0.02, "{name}: {got}, known {expected}");
        }
    }
}
