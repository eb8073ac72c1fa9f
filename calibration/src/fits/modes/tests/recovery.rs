//! Constants are recovered within what is stated of them.

use isotherm_correction::unit::UnitSettings;
use isotherm_log::offline::load_calibration;
use isotherm_protocol::document::Sample;
use isotherm_simulator::Scenario;
use isotherm_simulator::chamber::Profile;

use super::fixture::{base, cycle, fitted, place, run, scenario, truth, wanted, zeeman};
use crate::fits::modes::fit::{Made, Wanted, make};
use crate::fits::modes::model::{Asked, deg_per_h};
use crate::fixture::events;

/// Normalised errors of all constants over some seeds: how many runs have all within three standard errors, and the
/// errors by constant.
struct Found {
    runs_within: usize,
    by_constant: Vec<Vec<f64>>,
}

impl Found {
    fn rms(&self) -> Vec<f64> {
        self.by_constant.iter().map(|errors| rms(errors)).collect()
    }
}

fn over_seeds(seeds: std::ops::Range<u64>, asked: Asked, scenario: impl Fn(u64) -> Scenario) -> Found {
    let base = base();
    let mut found = Found { runs_within: 0, by_constant: Vec::new() };
    for seed in seeds {
        let mut scenario = scenario(seed);
        let runs = [run(&scenario)];
        let made = make(&Wanted { asked, ..wanted(&runs, &base) }).unwrap();
        let mut errors = Vec::new();
        for (sensor, fit) in made.gyros.iter().enumerate() {
            let fit = fit.as_ref().unwrap();
            for (term, power, value) in truth(&mut scenario, sensor) {
                let [got, sigma] = fit
                    .coefficient(term, power)
                    .unwrap_or_else(|| panic!("{seed} {sensor} {term:?} {power}"));
                errors.push((got - value) / sigma);
            }
        }
        found.runs_within += usize::from(errors.iter().all(|error| error.abs() <= 3.0));
        found.by_constant.resize(errors.len(), Vec::new());
        found.by_constant.iter_mut().zip(errors).for_each(|(list, error)| list.push(error));
    }
    found
}

/// Tick of the runs with everything in them (s).
const TICK_S: f64 = 0.03;

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
    let found = over_seeds(0..100, Asked::default(), coarse);
    let all: Vec<f64> = found.by_constant.iter().flatten().copied().collect();
    println!(
        "{} of 100 runs with all {} constants within three standard errors",
        found.runs_within,
        found.by_constant.len()
    );
    println!("normalised errors: rms {:.3}, by constant {:?}", rms(&all), found.rms());
    assert_eq!(found.by_constant.len(), 24);
    assert!(found.runs_within >= 99, "{}", found.runs_within);
    // Standard errors that were too large would show here.
    assert!((0.75..1.05).contains(&rms(&all)), "{}", rms(&all));
    assert!(found.rms().iter().all(|rms| (0.6..1.2).contains(rms)), "{:?}", found.rms());
}

#[test]
fn correlated_noise_is_in_the_standard_errors() {
    let orders =
        Asked { static_order: Some(2), magnetic_order: Some(2), meander_order: Some(1), ..Asked::default() };
    let found = over_seeds(0..30, orders, |seed| {
        let mut scenario = coarse(seed);
        for gyro in &mut zeeman(&mut scenario).gyros {
            gyro.noise.markov_drift_rad_per_s = 0.03 * std::f64::consts::PI / 180.0 / 3600.0;
            gyro.noise.markov_correlation_s = 200.0;
        }
        scenario
    });
    let all: Vec<f64> = found.by_constant.iter().flatten().copied().collect();
    let beyond = all.iter().filter(|error| error.abs() > 3.0).count();
    println!(
        "{beyond} of {} constants beyond three standard errors, rms {:.3}: {:?}",
        all.len(),
        rms(&all),
        found.rms()
    );
    assert!(beyond * 100 <= all.len() && (0.7..1.1).contains(&rms(&all)), "{beyond} {}", rms(&all));
}

#[test]
fn the_servo_s_time_constant_and_the_lost_ticks_are_recovered() {
    let base = base();
    let mut errors = Vec::new();
    for seed in 0..25 {
        let mut scenario = scenario(seed, Profile::constant(20.0), 0.005, 2.0);
        scenario.duration_s = 100.0;
        // With and without electronics that invert the field with the mode.
        zeeman(&mut scenario).reversal.dither_turns_with_mode = seed % 2 == 1;
        let made = fitted(&scenario, &base);
        // 5…15 ms are two or three ticks.
        assert_eq!(made.transition_ticks, 3);
        for servo in &made.servos {
            let found = servo.as_ref().unwrap().transient;
            errors.push((found.time_constant_s - 0.040) / found.sigma_s);
        }
    }
    let beyond = errors.iter().filter(|error| error.abs() > 3.0).count();
    println!(
        "time constant: {beyond} of {} beyond three standard errors, rms {:.3}",
        errors.len(),
        rms(&errors)
    );
    assert!(beyond * 100 <= errors.len() && (0.6..1.2).contains(&rms(&errors)), "{beyond} {}", rms(&errors));
}

#[test]
fn the_drift_in_running_mode_falls_tenfold_on_another_profile() {
    let base = base();
    let runs = [run(&scenario(1, cycle(2.0), TICK_S, 120.0))];
    let other = Profile::constant(20.0)
        .hold(10.0)
        .ramp(55.0, 1.0)
        .hold(20.0)
        .ramp(-35.0, 3.0)
        .hold(15.0)
        .ramp(20.0, 2.5);
    let other = scenario(2, other, TICK_S, 120.0);
    let judge = [run(&other)];
    let mut wanted = wanted(&runs, &base);
    wanted.judge = &judge;
    let made = make(&wanted).unwrap();
    let report = made.report();
    println!("{}", report.headline());
    for verdict in &report.verdicts {
        let [before, after] = verdict.out_of_sample.unwrap();
        let peaks = before.peak_to_peak / after.peak_to_peak;
        println!("{}: rms {:.1} times smaller, peak to peak {peaks:.1}", verdict.of, before.rms / after.rms);
        assert!(verdict.accepted && before.rms > 10.0 * after.rms && peaks > 10.0, "{}", verdict.words());
    }
    dither_is_recovered(&made, &other);
    what_is_reported_is_what_offline_correction_gives(&made, &other);
}

/// f0 over temperature, and the delay of the temperature: a mean of three seconds, a grid, a ramp.
fn dither_is_recovered(made: &Made, scenario: &Scenario) {
    let mut scenario = scenario.clone();
    for (servo, gyro) in made.servos.iter().zip(&zeeman(&mut scenario).gyros) {
        let rest = &servo.as_ref().unwrap().rest;
        for ([got, sigma], truth) in rest.coefficients.iter().zip(gyro.dither_hz) {
            println!("rest frequency: {got} ± {sigma}, {truth}");
            assert!((got - truth).abs() < 3.0 * sigma, "{got} {truth} {sigma}");
        }
        assert!((1.0..3.5).contains(&rest.delay_s.unwrap()), "{:?}", rest.delay_s);
    }
}

/// The written document in a file, through the service's stream, and the figures worked out anew.
fn what_is_reported_is_what_offline_correction_gives(made: &Made, scenario: &Scenario) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("modes.toml");
    made.written.save(&path, false).unwrap();
    let loaded = load_calibration(&path).unwrap();
    let mut unit = loaded.stream(UnitSettings::default());
    let mut ticks = Vec::new();
    for event in events(scenario) {
        unit.handle((&event).into());
        ticks.extend(unit.take_ready());
    }
    unit.flush();
    ticks.extend(unit.take_ready());
    let per_window = (made.window_s / TICK_S).round();
    let earth = place().earth_rate_in_case(None).unwrap();
    for (axis, name) in ["gyro x", "gyro y", "gyro z"].iter().enumerate() {
        let curve =
            made.residuals.iter().find(|curve| curve.of == *name && curve.sample == Sample::Out).unwrap();
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "ticks of a window")]
        let windows = ticks.chunks_exact(per_window as usize);
        assert_eq!(windows.len(), curve.after.len());
        for (window, reported) in windows.zip(&curve.after) {
            let angle: f64 = window.iter().map(|tick| tick.delta_angle[axis]).sum();
            let own = deg_per_h(angle / made.window_s - earth[axis]);
            let scale = deg_per_h(earth[axis]).abs().max(1.0);
            assert!((own - reported).abs() < 1e-9 * scale, "{name}: {own} {reported}");
        }
    }
}
