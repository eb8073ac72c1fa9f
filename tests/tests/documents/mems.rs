//! MEMS-0001 through its chamber cycle.

use isotherm_simulator::Scenario;
use isotherm_simulator::presets::mems_chamber;
use isotherm_tests::simulated::{Size, rate_errors};

use crate::{compile, parsed};

/// Averaging of the errors (s).
const WINDOW_S: f64 = 100.0;
/// White noise of the gyros over a window (°/h): 0.15 °/√h.
const NOISE_DEG_PER_H: f64 = 0.15 * 6.0;

#[test]
fn bias_and_scale_over_temperature_are_removed_to_the_noise_floor() {
    let scenario = Scenario { tick_ns: 50_000_000, ..mems_chamber(31) };
    let document = parsed("MEMS-0001.toml").document;
    let before = rate_errors(&compile(&document.nominal()), &scenario, WINDOW_S).unwrap();
    let after = rate_errors(&compile(&document), &scenario, WINDOW_S).unwrap();
    for axis in 0..3 {
        let (before, after) = (Size::of(before.axis(axis)), Size::of(after.axis(axis)));
        println!(
            "gyro {axis}: rms {:.2} -> {:.3} °/h, noise {NOISE_DEG_PER_H:.2} °/h",
            before.rms, after.rms
        );
        assert!(before.rms > 50.0 * after.rms);
        assert!(after.rms < 1.2 * NOISE_DEG_PER_H, "gyro {axis}: {} °/h", after.rms);
    }
}
