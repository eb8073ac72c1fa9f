//! What moves, or whose modes are unbalanced, is refused every time; what stands still never is.

use std::sync::Arc;

use isotherm_correction::calibration::Calibration;
use isotherm_correction::prelaunch::{Outcome, Refusal};
use isotherm_simulator::Scenario;
use isotherm_simulator::failure::FailingSensor::{Accelerometer, Gyro};

use crate::bench::{
    accepted, calibration, coarse_zeeman, for_seeds, given, mems, pulse, refused, run, words, zeeman,
    zeeman_unit,
};

/// Runs of each kind.
const SEEDS: u64 = 100;
/// 20 mg (m/s²).
const KNOCK_M_PER_S2: f64 = 0.02 * 9.806_65;
/// 0.05° (rad).
const NUDGE_RAD: f64 = 0.05 * std::f64::consts::PI / 180.0;

/// A time of the calibration for each seed, spread evenly over it; its first and last seconds and those of a mode switch
/// come more often (s).
fn time_s(seed: u64) -> f64 {
    let spread = (f64::from(u32::try_from(seed).unwrap()) * 0.618_034).fract();
    match seed % 10 {
        0 => spread,
        1 => 598.8 + 0.2 * spread,
        2 | 3 => 99.0 + 1.4 * spread,
        _ => 598.0 * spread,
    }
}

/// Ways to disturb a unit, by the seed: in no other sensor than the one that feels it least of all.
fn nudge(scenario: &mut Scenario, seed: u64) {
    let axis = usize::try_from(seed / 3 % 3).unwrap();
    let times = if seed.is_multiple_of(2) { 1.0 } else { -1.0 }
        * [1.0, 1.0, 4.0, 20.0][usize::try_from(seed / 9 % 4).unwrap()];
    let at_s = time_s(seed);
    match seed % 3 {
        // Turned within a second, about an axis of which the accelerometers know nothing.
        0 => pulse(scenario, Gyro(axis), at_s, 1.0, times * NUDGE_RAD),
        // Turned at once.
        1 => pulse(scenario, Gyro(axis), at_s, 0.2, times * NUDGE_RAD / 0.2),
        // Knocked.
        _ => pulse(scenario, Accelerometer(axis), at_s, 0.2, times * KNOCK_M_PER_S2),
    }
}

/// Nudges a unit in each of many runs.
#[track_caller]
fn refused_every_time(calibration: &Arc<Calibration>, at_rest: impl Fn(u64) -> Scenario + Sync) {
    let runs = for_seeds(SEEDS, |seed| {
        let mut scenario = at_rest(seed);
        nudge(&mut scenario, seed);
        run(calibration, &scenario, &given())
    });
    for (seed, outcome) in runs.into_iter().enumerate() {
        let refusals = refused(outcome);
        assert!(matches!(refusals.as_slice(), [Refusal::Moved(_)]), "seed {seed}: {:?}", words(&refusals));
    }
}

#[test]
fn a_zeeman_unit_that_is_nudged_is_refused_every_time() {
    refused_every_time(&calibration("ZLG-0001"), coarse_zeeman);
}

#[test]
fn a_zeeman_unit_at_its_full_rate_that_is_nudged_is_refused_every_time() {
    refused_every_time(&calibration("ZLG-0001"), zeeman);
}

#[test]
fn a_micromechanical_unit_that_is_nudged_is_refused_every_time() {
    refused_every_time(&calibration("MEMS-0001"), mems);
}

#[test]
fn a_unit_that_stands_still_is_never_refused() {
    // At the full rate, and of the micromechanical kind: see the tests of recovery, where a refusal fails.
    let calibration = calibration("ZLG-0001");
    for outcome in for_seeds(SEEDS, |seed| run(&calibration, &coarse_zeeman(seed + 1000), &given())) {
        accepted(outcome);
    }
}

#[test]
fn a_unit_whose_modes_are_unbalanced_is_refused_every_time() {
    let calibration = calibration("ZLG-0001");
    // Never switched; switched once, late; switched in the middle of too long a stretch.
    for period_s in [0.0, 580.0, 390.0] {
        let runs = for_seeds(SEEDS / 4, |seed| {
            let mut scenario = coarse_zeeman(seed);
            zeeman_unit(&mut scenario).reversal.period_s = period_s;
            run(&calibration, &scenario, &given())
        });
        for outcome in runs {
            let refusals = refused(outcome);
            let unbalanced = refusals.iter().filter(|r| matches!(r, Refusal::ModesUnbalanced { .. })).count();
            assert_eq!(unbalanced, 3, "{:?}", words(&refusals));
        }
    }
}

#[test]
fn a_unit_outside_its_fitted_temperatures_is_refused() {
    let mut scenario = coarse_zeeman(1);
    // The document is good to 100 °C; the gyros are 11 °C warmer than the chamber.
    scenario.chamber.start_deg_c = 88.0;
    scenario.chamber.segments.clear();
    scenario.chamber = scenario.chamber.ramp(98.0, 2.0);
    let outcome = run(&calibration("ZLG-0001"), &scenario, &given());
    let Outcome::Refused(refusals) = &outcome else { panic!("{outcome:?}") };
    assert!(matches!(refusals.as_slice(), [Refusal::TemperatureOutOfRange { .. }]), "{:?}", words(refusals));
}
