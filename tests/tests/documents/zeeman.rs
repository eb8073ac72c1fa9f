//! ZLG-0001 through the state machine: what is left of the modes, and of the switches between them.

use isotherm_correction::sample::LasingMode;
use isotherm_correction::units::{Angle, AngularRate};
use isotherm_protocol::document::{Curve, Document, Shape, Unit};
use isotherm_simulator::Scenario;
use isotherm_simulator::instrument::Gyros;
use isotherm_simulator::noise::GyroNoise;
use isotherm_simulator::presets::{zeeman_rest, zeeman_sine};
use isotherm_simulator::zeeman::Zeeman;
use isotherm_tests::simulated::{Size, run};

use crate::{compile, parsed};

const FILE: &str = "ZLG-0001.toml";
/// Switches over which the angle is judged.
const SWITCHES: usize = 50;
/// Tick j = n + 3 brings the angle of a switch back (models §5); the document has n = 3.
const RESTORED: usize = 6;

fn zeeman(scenario: &mut Scenario) -> &mut Zeeman {
    match &mut scenario.instrument.gyros {
        Gyros::Zeeman(zeeman) => zeeman,
        other => panic!("{other:?}"),
    }
}

/// Mean rate errors (°/h) of each stretch between two switches, beside its mode.
fn stretches(document: &Document, scenario: &Scenario) -> Vec<(LasingMode, [f64; 3])> {
    let mut all: Vec<(LasingMode, [f64; 3], f64)> = Vec::new();
    run(&compile(document), scenario, |step, tick| {
        let mode = step.gyro.mode.unwrap();
        if all.last().is_none_or(|last| last.0 != mode) {
            all.push((mode, [0.0; 3], 0.0));
        }
        let (_, angle, time_s) = all.last_mut().unwrap();
        *angle = [0, 1, 2].map(|axis| angle[axis] + tick.delta_angle[axis] - step.truth.delta_angle[axis]);
        *time_s += tick.duration.as_s();
    })
    .unwrap();
    let rate = |angle: f64, time_s: f64| AngularRate::from_rad_per_s(angle / time_s).as_deg_per_h();
    all.into_iter().map(|(mode, angle, time_s)| (mode, angle.map(|angle| rate(angle, time_s)))).collect()
}

/// Mean over the stretches of one mode, and its standard error (°/h).
fn mean(stretches: &[(LasingMode, [f64; 3])], mode: LasingMode, axis: usize) -> (f64, f64) {
    let errors = stretches.iter().filter(|stretch| stretch.0 == mode).map(|stretch| stretch.1[axis]);
    let count = f64::from(u32::try_from(errors.clone().count()).unwrap());
    let size = Size::of(errors);
    (size.mean, size.deviation / (count - 1.0).sqrt())
}

#[test]
fn at_rest_the_mode_dependent_drift_is_removed_to_the_noise_floor() {
    let scenario = zeeman_rest(11);
    let document = parsed(FILE).document;
    let (raw, corrected) = (stretches(&document.nominal(), &scenario), stretches(&document, &scenario));
    for axis in 0..3 {
        let drift = [LasingMode::Plus, LasingMode::Minus].map(|mode| mean(&raw, mode, axis).0);
        println!("gyro {axis}: nominal {:.3} and {:.3} °/h", drift[0], drift[1]);
        assert!((drift[0] - drift[1]).abs() > 2.0, "the modes differ by twice the magnetic bias");
        for mode in [LasingMode::Plus, LasingMode::Minus] {
            let (error, standard_error) = mean(&corrected, mode, axis);
            println!("gyro {axis} {mode:?}: {error:.4} ± {standard_error:.4} °/h");
            assert!(
                error.abs() < 3.0 * standard_error,
                "gyro {axis} {mode:?}: {error} ± {standard_error} °/h"
            );
            assert!(standard_error < 0.02, "{standard_error} °/h");
        }
    }
}

/// Angle that each switch left behind (″ per axis): error of the ticks from the command on, `ticks` of them.
fn switch_errors(document: &Document, scenario: &Scenario, ticks: usize) -> Vec<[f64; 3]> {
    let mut errors = Vec::new();
    let mut left = 0;
    run(&compile(document), scenario, |step, tick| {
        if step.gyro.switch_command {
            errors.push([0.0; 3]);
            left = ticks;
        }
        if left > 0 {
            left -= 1;
            let error: &mut [f64; 3] = errors.last_mut().unwrap();
            let angle = |axis: usize| Angle::from_rad(tick.delta_angle[axis] - step.truth.delta_angle[axis]);
            *error = [0, 1, 2].map(|axis| error[axis] + angle(axis).as_arcsec());
        }
    })
    .unwrap();
    assert_eq!(errors.len(), SWITCHES);
    errors
}

/// Root mean square over switches and axes (″).
fn rms(errors: &[[f64; 3]]) -> f64 {
    Size::of(errors.iter().flatten().copied()).rms
}

/// Fifty switches under 1° at 1 Hz.
fn swinging(quantised: bool) -> Scenario {
    let mut scenario = zeeman_sine(12);
    let unit = zeeman(&mut scenario);
    unit.quantised = quantised;
    // No whole number of swings, so that the fifty switches go once round their phase.
    unit.reversal.period_s = 12.02;
    scenario.duration_s = 12.02 * 50.5;
    scenario
}

/// Counts a hundred times finer, in the instrument and in its document.
fn finer(scenario: &mut Scenario, document: &mut Document) {
    const FINER: f64 = 100.0;
    for gyro in &mut zeeman(scenario).gyros {
        gyro.scale_rad_per_count /= FINER;
        gyro.dither_hz = gyro.dither_hz.map(|hz| hz * FINER);
    }
    for sensor in &mut document.gyro.sensor {
        *sensor.increment_weight_arcsec_per_count.as_mut().unwrap() /= FINER;
        let rest_frequency = &mut sensor.servo.as_mut().unwrap().rest_frequency;
        let Shape::Polynomial { reference, coefficients, range } = rest_frequency.shape().clone() else {
            panic!()
        };
        let coefficients = coefficients.iter().map(|hz| hz * FINER).collect();
        *rest_frequency = Curve::new(Shape::Polynomial { reference, coefficients, range }).in_unit(Unit::HZ);
    }
}

#[test]
fn without_quantisation_fifty_switches_keep_their_angle_within_0_05_arcsec_rms() {
    // `quantised = false` makes the counts of a tick real numbers, but its half-period counts are whole on the wire; a
    // hundred times finer they are as good as real. Servo transient, noise, motion and temperature are all on.
    let (mut scenario, mut document) = (swinging(false), parsed(FILE).document);
    finer(&mut scenario, &mut document);
    let got = rms(&switch_errors(&document, &scenario, RESTORED));
    println!("no quantisation: {got:.4}″ rms per switch");
    assert!(got < 0.05, "{got}″");

    // What of it is noise: the fit weighs the readings j = −1, 0, 4, 5 by −1, 2.5, 2.5, −1 (see `floor_counts`), and 4, 5, 6
    // are in the sum themselves: √(1 + 2.5² + 3.5² + 0 + 1) = 4.5 readings of 0.002 °/√h over 5 ms, 0.0085″ each.
    for gyro in &mut zeeman(&mut scenario).gyros {
        gyro.noise = GyroNoise::default();
    }
    let got = rms(&switch_errors(&document, &scenario, RESTORED));
    println!("no quantisation, no noise: {got:.4}″ rms per switch");
    assert!(got < 0.01, "{got}″");
}

#[test]
fn a_switch_into_either_mode_keeps_its_angle_in_either_wiring() {
    // The error from the command to the end of the transient, 8·τ = 0.32 s = 64 ticks after at most three lost ones.
    const SETTLED: usize = 70;
    for turns in [false, true] {
        let (mut scenario, mut document) = (swinging(false), parsed(FILE).document);
        finer(&mut scenario, &mut document);
        zeeman(&mut scenario).reversal.dither_turns_with_mode = turns;
        for gyro in &mut zeeman(&mut scenario).gyros {
            gyro.noise = GyroNoise::default();
        }
        let without = {
            let mut document = document.clone();
            document.gyro.sensor.iter_mut().for_each(|sensor| sensor.servo = None);
            switch_errors(&document, &scenario, SETTLED)
        };
        let with = switch_errors(&document, &scenario, SETTLED);
        // The unit starts in the plus mode: every other switch goes into the minus mode.
        for (first, mode) in [(0, LasingMode::Minus), (1, LasingMode::Plus)] {
            let of_mode =
                |errors: &[[f64; 3]]| rms(&errors.iter().copied().skip(first).step_by(2).collect::<Vec<_>>());
            let (raw, left) = (of_mode(&without), of_mode(&with));
            println!(
                "dither turns with the mode: {turns}, into {mode:?}: {raw:.3}″, with the servo term {left:.4}″"
            );
            assert!(raw > 1.0 && left < 0.02, "turns: {turns}, into {mode:?}: {raw}″, {left}″");
        }
    }
}

/// The theoretical floor of a switch's angle under count quantisation, in counts rms.
///
/// A counter carries its fraction on: a tick's counts are wrong by φ before less φ after it, φ being the fraction, which
/// under motion is uniform on [0, 1) and independent from tick to tick, of variance 1/12.
///
/// With n = 3 the two-sided quadratic through the readings j = −1, 0, 4, 5 has, summed over j = 1, 2, 3, the weights
/// −1, 2.5, 2.5, −1: about the middle j = 2 the readings lie at u = ±2 and ±3, the odd part cancels in the sum, the even
/// part a + b·u² goes through both pairs' means A and B, and 3a + 2b = 5A − 2B. The ticks 4, 5, 6 are in the sum
/// themselves, so that they weigh 2.5 + 1, −1 + 1 and 1 in the angle from the command to the restoring tick 6.
///
/// The servo's transient is modelled from tick 4 alone: its half-period counts c⁺ − c⁻ are wrong by φ₃ − 2φ′ + φ₄, φ′
/// being the fraction in mid-tick. Times tanh(Δt/2τ) that is what is wrongly taken from tick 4, times e^(−2Δt/τ) from each
/// further tick.
fn floor_counts(quantised: bool) -> f64 {
    let (tick_s, tau_s) = (0.005_f64, 0.040_f64);
    let decay = (-2.0 * tick_s / tau_s).exp();
    let [four, five, six] = [3.5, 0.0, 1.0];
    let servo = (tick_s / (2.0 * tau_s)).tanh() * (four + five * decay + six * decay * decay);
    // Weights of the errors of the readings −1, 0, then of φ₃, φ′, φ₄, φ₅, φ₆.
    let squares = if quantised {
        let [before, last] = [-1.0, 2.5];
        let old_mode: [f64; 3] = [before, last - before, -last];
        let new_mode: [f64; 5] = [four - servo, 2.0 * servo, five - four - servo, six - five, -six];
        old_mode.iter().chain(&new_mode).map(|weight| weight * weight).sum::<f64>()
    } else {
        // Only the half-period counts are rounded, each by itself.
        2.0 * servo * servo
    };
    (squares / 12.0).sqrt()
}

#[test]
fn with_quantisation_fifty_switches_reach_the_floor_of_whole_counts() {
    let document = parsed(FILE).document;
    let weights = document.gyro.sensor.iter().map(|sensor| sensor.increment_weight_arcsec_per_count.unwrap());
    let count = Size::of(weights).rms;
    for (quantised, name) in [(true, "whole counts"), (false, "whole half-period counts only")] {
        let floor = floor_counts(quantised) * count;
        let got = rms(&switch_errors(&document, &swinging(quantised), RESTORED));
        println!("{name}: {got:.3}″ rms per switch, theoretical floor {floor:.3}″");
        // 150 values give a root mean square to 6 %.
        assert!((got / floor - 1.0).abs() < 0.18, "{name}: {got}″, floor {floor}″");
    }
}
