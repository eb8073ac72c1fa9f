//! Constants are recovered within what is stated of them.

use isotherm_simulator::Scenario;
use isotherm_simulator::chamber::Profile;

use super::fixture::*;
use crate::modes::fit::Term;
use crate::modes::make::make;

/// Normalised errors of all constants over some seeds: how many runs have all within three standard errors, and the
/// errors by constant.
struct Found {
    runs_within: usize,
    by_constant: Vec<Vec<f64>>,
}

fn over_seeds(seeds: std::ops::Range<u64>, scenario: impl Fn(u64) -> Scenario) -> Found {
    let base = base();
    let mut found = Found { runs_within: 0, by_constant: Vec::new() };
    for seed in seeds {
        let mut scenario = scenario(seed);
        let made = fitted(&scenario, &base);
        let mut errors = Vec::new();
        for (sensor, fit) in made.gyros.iter().enumerate() {
            let fit = fit.as_ref().unwrap();
            for (term, power, value) in truth(&mut scenario, sensor) {
                let [got, sigma] = fit.coefficient(term, power).unwrap_or_else(|| panic!("{seed} {sensor} {term:?} {power}"));
                errors.push((got - value) / sigma);
            }
        }
        found.runs_within += usize::from(errors.iter().all(|error| error.abs() <= 3.0));
        found.by_constant.resize(errors.len(), Vec::new());
        found.by_constant.iter_mut().zip(errors).for_each(|(list, error)| list.push(error));
    }
    found
}

#[expect(clippy::cast_precision_loss, reason = "few")]
fn rms(errors: &[f64]) -> f64 {
    (errors.iter().map(|error| error * error).sum::<f64>() / errors.len() as f64).sqrt()
}

/// The cycle at two ticks a second; a servo's transient would be lost in one of them, so there is none.
fn coarse(seed: u64) -> Scenario {
    let mut scenario = scenario(seed, cycle(4.0), 0.5, 60.0);
    zeeman(&mut scenario).reversal.miss_rms_wavelengths = 0.0;
    scenario
}

#[test]
fn all_constants_of_all_gyros_are_recovered_in_99_of_100_runs() {
    let found = over_seeds(0..100, |seed| coarse(seed));
    let all: Vec<f64> = found.by_constant.iter().flatten().copied().collect();
    let beyond = all.iter().filter(|error| error.abs() > 3.0).count();
    for (index, errors) in found.by_constant.iter().enumerate() {
        let within = errors.iter().filter(|error| error.abs() <= 3.0).count();
        println!("constant {index}: {within} of {} within, rms {:.2}", errors.len(), rms(errors));
    }
    println!("{} runs with all within, {beyond} of {} beyond, rms {:.3}", found.runs_within, all.len(), rms(&all));
}

#[test]
fn correlated_noise_is_in_the_standard_errors() {
    let found = over_seeds(0..30, |seed| {
        let mut scenario = coarse(seed);
        for gyro in &mut zeeman(&mut scenario).gyros {
            gyro.noise.markov_drift_rad_per_s = 0.03 * std::f64::consts::PI / 180.0 / 3600.0;
            gyro.noise.markov_correlation_s = 200.0;
        }
        scenario
    });
    let all: Vec<f64> = found.by_constant.iter().flatten().copied().collect();
    let beyond = all.iter().filter(|error| error.abs() > 3.0).count();
    println!("markov: {} runs, {beyond} of {} beyond, rms {:.3}", found.runs_within, all.len(), rms(&all));
}

#[test]
fn switch_parameters_are_recovered() {
    let base = base();
    let mut errors: Vec<Vec<f64>> = Vec::new();
    for seed in 0..40 {
        let mut scenario = scenario(seed, Profile::constant(20.0), 0.005, 2.0);
        scenario.duration_s = 100.0;
        zeeman(&mut scenario).reversal.meander_half_period_s = 0.0;
        let made = fitted(&scenario, &base);
        assert_eq!(made.transition_ticks, 3);
        let own: Vec<f64> = made.servos.iter().map(|servo| {
            let servo = servo.as_ref().unwrap();
            (servo.transient.time_constant_s - 0.040) / servo.transient.sigma_s
        }).collect();
        if seed == 0 {
            println!("{}", made.report().to_text());
        }
        errors.push(own);
    }
    let all: Vec<f64> = errors.iter().flatten().copied().collect();
    println!("tau: rms {:.3} worst {:.2}", rms(&all), all.iter().fold(0.0_f64, |a, b| a.max(b.abs())));
}

#[test]
fn drift_in_running_mode_falls_tenfold_on_another_profile() {
    let base = base();
    let runs = [run(&scenario(1, cycle(2.0), 0.02, 120.0))];
    let other = Profile::constant(20.0).hold(10.0).ramp(55.0, 1.0).hold(20.0).ramp(-35.0, 3.0).hold(15.0).ramp(20.0, 2.5);
    let judge = [run(&scenario(2, other, 0.02, 120.0))];
    let mut wanted = wanted(&runs, &base);
    wanted.judge = &judge;
    let made = make(&wanted, || ()).unwrap();
    println!("{}", made.report().to_text());
    let _ = Term::Static;
}
