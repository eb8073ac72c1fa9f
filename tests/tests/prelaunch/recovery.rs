//! Constants that were shifted are found again, and the stated errors are honest.

use isotherm_correction::prelaunch::{GyroConstants, PreLaunchSettings};
use isotherm_correction::units::Span;
use isotherm_simulator::Simulation;
use isotherm_simulator::instrument::Gyros;

use crate::bench::{
    DEG_PER_H, LEAD_S, accepted, calibration, fibre_optic, for_seeds, given, levelled, mems, run,
    shift_rad_per_s, zeeman, zeeman_unit,
};

/// Runs that are made.
const SEEDS: u64 = 100;

/// Errors of a run in units of their own standard errors.
fn standardised(seed: u64, size_deg_per_h: f64, constants: &[GyroConstants]) -> Vec<f64> {
    assert_eq!(constants.len(), 3);
    let errors = constants.iter().enumerate().flat_map(|(gyro, found)| {
        let shift = |constant| shift_rad_per_s(seed, gyro, constant, size_deg_per_h);
        let c0 = (found.static_bias_change_rad_per_s - shift(0)) / found.static_bias_sigma_rad_per_s;
        let magnetic = found.magnetic_bias_change_rad_per_s.zip(found.magnetic_bias_sigma_rad_per_s);
        [Some(c0), magnetic.map(|(change, sigma)| (change - shift(1)) / sigma)]
    });
    errors.flatten().collect()
}

/// Asserts that all constants are within three standard errors in 99 % of the runs, and that these are what they say.
#[track_caller]
fn judge(runs: &[Vec<f64>]) {
    let good = runs.iter().filter(|errors| errors.iter().all(|error| error.abs() <= 3.0)).count();
    let all: Vec<f64> = runs.iter().flatten().copied().collect();
    let count = all.iter().fold(0.0, |count, _| count + 1.0);
    let rms = f64::sqrt(all.iter().map(|error| error * error).sum::<f64>() / count);
    println!("{good} of {} runs within three standard errors, standardised rms {rms:.3}", runs.len());
    assert!(100 * good >= 99 * runs.len(), "{good} of {}", runs.len());
    assert!((0.7..1.3).contains(&rms), "rms of the standardised errors {rms}");
}

#[test]
fn shifted_constants_are_found_within_three_standard_errors() {
    const SHIFT_DEG_PER_H: f64 = 0.8;
    let calibration = calibration("ZLG-0001");
    let runs = for_seeds(SEEDS, |seed| {
        let mut scenario = zeeman(seed);
        for (index, gyro) in zeeman_unit(&mut scenario).gyros.iter_mut().enumerate() {
            gyro.bias_nonmagnetic_rad_per_s[0] += shift_rad_per_s(seed, index, 0, SHIFT_DEG_PER_H);
            gyro.bias_magnetic_rad_per_s[0] += shift_rad_per_s(seed, index, 1, SHIFT_DEG_PER_H);
        }
        accepted(run(&calibration, &scenario, &given()))
    });
    let sigma = runs[0][0].static_bias_sigma_rad_per_s / DEG_PER_H;
    println!("standard error of the first run: {sigma:.4} °/h");
    assert!(sigma < 0.01);
    let errors: Vec<_> =
        (0..).zip(&runs).map(|(seed, found)| standardised(seed, SHIFT_DEG_PER_H, found)).collect();
    judge(&errors);
}

#[test]
fn the_gyros_of_these_runs_warm_by_two_degrees() {
    for scenario in [zeeman(0), mems(0)] {
        let deg_c = |at_s: f64| {
            let at_ns = Span::from_s(at_s).as_ns();
            let mut steps = Simulation::new(&scenario).unwrap();
            steps.find(|step| step.gyro.end_time.as_ns() >= at_ns).unwrap().truth.gyro_deg_c[0]
        };
        let drift = deg_c(LEAD_S + 600.0) - deg_c(LEAD_S);
        assert!((1.7..2.3).contains(&drift), "{drift} °C");
    }
}

#[test]
fn a_micromechanical_unit_without_modes_gets_its_c0() {
    const SHIFT_DEG_PER_H: f64 = 20.0;
    let calibration = calibration("MEMS-0001");
    let mut settings = given();
    settings.limits.static_bias_change_rad_per_s = 30.0 * DEG_PER_H;
    let runs = for_seeds(SEEDS, |seed| {
        let mut scenario = mems(seed);
        let Gyros::Mems(gyros) = &mut scenario.instrument.gyros else { panic!() };
        for (index, gyro) in gyros.iter_mut().enumerate() {
            gyro.bias_rad_per_s[0] += shift_rad_per_s(seed, index, 0, SHIFT_DEG_PER_H);
        }
        let constants = accepted(run(&calibration, &scenario, &settings));
        standardised(seed, SHIFT_DEG_PER_H, &constants)
    });
    judge(&runs);
}

#[test]
fn a_fibre_optic_unit_as_its_document_has_it_needs_no_change() {
    let calibration = calibration("FOG-0001");
    let runs = for_seeds(10, |seed| accepted(run(&calibration, &fibre_optic(seed), &given())));
    for found in runs.iter().flatten() {
        // What is left of the document's fit, and the noise of ten minutes.
        let change = found.static_bias_change_rad_per_s / DEG_PER_H;
        assert!(change.abs() < 0.04, "{change} °/h");
        assert_eq!(found.magnetic_bias_change_rad_per_s, None);
        assert_eq!((found.modes.plus.ticks, found.modes.minus.ticks), (0, 0));
    }
}

#[test]
fn levelling_gives_what_the_given_attitude_gives() {
    let calibration = calibration("ZLG-0001");
    let both = |settings: PreLaunchSettings| accepted(run(&calibration, &zeeman(3), &settings));
    for (given, levelled) in both(given()).iter().zip(&both(levelled())) {
        let difference = given.static_bias_change_rad_per_s - levelled.static_bias_change_rad_per_s;
        println!("{:.6} °/h", difference / DEG_PER_H);
        assert!(difference.abs() < 1e-3 * DEG_PER_H, "{} °/h", difference / DEG_PER_H);
        // The mode-dependent half knows nothing of the Earth.
        assert_eq!(given.magnetic_bias_change_rad_per_s, levelled.magnetic_bias_change_rad_per_s);
    }
}
