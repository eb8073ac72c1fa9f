//! FOG-0001 on the chamber profile that it was not fitted to.

use isotherm_protocol::document::{Measure, Sample};
use isotherm_simulator::Scenario;
use isotherm_simulator::presets::{fibre_optic_chamber, judging_profile, training_profile};
use isotherm_tests::simulated::{Size, rate_errors};

use crate::{compile, parsed};

/// Averaging of the errors (s), as in the document's own residuals.
const WINDOW_S: f64 = 100.0;
/// Tick of the runs (ns).
const TICK_NS: i64 = 50_000_000;

/// Rate errors per gyro before and after on a scenario.
fn sizes(scenario: &Scenario) -> Vec<[Size; 2]> {
    let document = parsed("FOG-0001.toml").document;
    let [before, after] = [document.nominal(), document]
        .map(|document| rate_errors(&compile(&document), scenario, WINDOW_S).unwrap());
    (0..3).map(|axis| [Size::of(before.axis(axis)), Size::of(after.axis(axis))]).collect()
}

#[test]
fn the_thermal_drift_of_the_judging_profile_is_reduced_tenfold() {
    // Other noise than in the document's own figures.
    let scenario = Scenario { tick_ns: TICK_NS, ..fibre_optic_chamber(303, judging_profile()) };
    for (axis, [before, after]) in sizes(&scenario).iter().enumerate() {
        let (times, of_deviation) = (before.rms / after.rms, before.deviation / after.deviation);
        println!(
            "gyro {axis}: rms {:.4} -> {:.4} °/h ({times:.1} times; about the mean {of_deviation:.1} times), peak to \
             peak {:.3} -> {:.3}",
            before.rms, after.rms, before.peak_to_peak, after.peak_to_peak,
        );
        assert!(times > 10.0, "gyro {axis}: {times} times");
    }
}

#[test]
fn the_stated_residuals_are_those_of_the_stated_runs() {
    let origin = parsed("FOG-0001.toml").document.origin.unwrap();
    let details = origin.details.unwrap();
    let detail = |key: &str| details.get(key).and_then(toml::Value::as_integer).unwrap();
    let runs =
        [(Sample::In, "training_seed", training_profile()), (Sample::Out, "judging_seed", judging_profile())];
    for (sample, seed, profile) in runs {
        let seed = u64::try_from(detail(seed)).unwrap();
        let scenario = Scenario { tick_ns: detail("tick_ns"), ..fibre_optic_chamber(seed, profile) };
        for (axis, [before, after]) in sizes(&scenario).into_iter().enumerate() {
            let of = format!("gyro.{}", ["x", "y", "z"][axis]);
            let residual = origin
                .residual
                .iter()
                .find(|residual| residual.sample == sample && residual.of == of)
                .unwrap();
            assert_eq!(residual.measure, Measure::DegPerH);
            for (got, stated) in [(before.rms, residual.rms_before), (after.rms, residual.rms_after)] {
                assert!((got / stated - 1.0).abs() < 0.01, "{of} {sample:?}: {got} °/h, stated {stated} °/h");
            }
        }
    }
}
