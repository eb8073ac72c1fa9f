//! Laws of every term that is declared, whichever these are: what a term adds is proportional to its coefficient, makes no jump, and is
//! finite for whatever comes in.

use isotherm_correction::calibration::{CalibrationParts, TermParts};
use isotherm_correction::sample::{ChannelName, CorrectedTick, TemperatureReading};
use isotherm_correction::thermal::{ACCEL_TERMS, Feature, GYRO_TERMS, Term};
use isotherm_tests::calibrations::{
    ALONG_CASE_AXES, compile, constant, identity, orientation, plain_accel, stated, with_auxiliaries,
};
use isotherm_tests::drive::{self, Owned};
use isotherm_tests::streams::{accel, gyro, temperature};

/// Ticks of 5 ms.
const TICKS: u32 = 4000;
/// Largest change from tick to tick of what a term adds, by the whole of it.
const SMOOTH: f64 = 0.03;

/// All sensors of one kind with a term, or none.
fn with(term: Term, gyros: bool, times: f64) -> CalibrationParts {
    let mut parts = with_auxiliaries();
    let stated = stated(term, gyros, times);
    let sensors = if gyros {
        parts.gyros.iter_mut().map(|gyro| &mut gyro.terms).collect::<Vec<_>>()
    } else {
        parts.accels.iter_mut().map(|accel| &mut accel.terms).collect()
    };
    for terms in sensors {
        terms.push(stated.clone());
    }
    parts
}

/// The unit swings in every axis while its temperature goes up and down; `odd` replaces what gyro 0 and accelerometer 0 read.
fn run(parts: &CalibrationParts, odd: impl Fn(u32) -> Option<f64>) -> Vec<CorrectedTick> {
    let mut events = Vec::new();
    for k in 0..TICKS {
        let t = f64::from(k) * 0.005;
        if k % 200 == 0 {
            let of = |name, raw| TemperatureReading {
                channel: ChannelName::from(name).unwrap(),
                ..temperature(k.into(), raw)
            };
            let swing = 3.0 * (0.4 * t).sin();
            // In no order: what is read at one moment acts together.
            events.push(Owned::Temperature(vec![of("u", 5.0 + swing), of("t", 20.0 + swing), of("v", 2.5)]));
        }
        let swing = |phase: f64| (1.3 * t + phase).sin();
        let mut forces = [9.0 * swing(0.1), 12.0 * swing(2.0), 10.0 * swing(4.0)];
        let mut rates = [0.5 * swing(0.3), 0.7 * swing(1.0), -0.6 * swing(2.2)];
        if let Some(odd) = odd(k) {
            (forces[0], rates[0]) = (odd, odd);
        }
        events.push(Owned::Accel(vec![accel(k.into(), &forces)]));
        events.push(Owned::Gyro(vec![gyro(k.into(), &rates)]));
    }
    drive::run(&mut drive::unit(&compile(parts)), &events)
}

/// What the term adds, tick by tick and output by output.
fn added(term: Term, gyros: bool, times: f64) -> Vec<[f64; 6]> {
    let of = |times| run(&with(term, gyros, times), |_| None);
    let numbers = |tick: &CorrectedTick| {
        let ([x, y, z], velocity) = (tick.delta_angle, tick.delta_velocity);
        [x, y, z, velocity[0], velocity[1], velocity[2]]
    };
    of(times)
        .iter()
        .map(numbers)
        .zip(of(0.0).iter().map(numbers))
        .map(|(with, without)| std::array::from_fn(|i| with[i] - without[i]))
        .collect()
}

fn all() -> impl Iterator<Item = (Term, bool)> {
    GYRO_TERMS.map(|term| (term, true)).into_iter().chain(ACCEL_TERMS.map(|term| (term, false)))
}

fn largest(values: impl Iterator<Item = f64>) -> f64 {
    values.fold(0.0, |largest, value| largest.max(value.abs()))
}

#[test]
fn a_term_does_something_in_proportion_to_its_coefficient_and_makes_no_jump() {
    for (term, gyros) in all() {
        let (once, twice) = (added(term, gyros, 1.0), added(term, gyros, 2.0));
        let outputs = if gyros { 0..3 } else { 3..6 };
        for output in outputs {
            let size = largest(once.iter().map(|tick| tick[output]));
            assert!(size > 1e-8, "{}: output {output} does not change", term.key);
            // A square is taken out to all orders.
            let off =
                largest(once.iter().zip(&twice).map(|(once, twice)| twice[output] - 2.0 * once[output]));
            assert!(off < 1e-3 * size, "{}: output {output} is off by {off} of {size}", term.key);
            let step = largest(once[400..].windows(2).map(|pair| pair[1][output] - pair[0][output]));
            assert!(step < SMOOTH * size, "{}: output {output} jumps by {step} of {size}", term.key);
        }
    }
}

#[test]
fn whatever_comes_in_what_goes_out_is_finite() {
    let odds = [f64::NAN, f64::INFINITY, -f64::INFINITY, 1e300, -1e300, 1e-320, f64::MAX];
    for (term, gyros) in all() {
        for times in [1.0, -1e6, 1e9] {
            let out =
                run(&with(term, gyros, times), |k| odds.get(usize::try_from(k / 3 % 97).unwrap()).copied());
            let finite = out
                .iter()
                .all(|tick| tick.delta_angle.iter().chain(&tick.delta_velocity).all(|x| x.is_finite()));
            assert!(finite, "{} times {times}", term.key);
        }
    }
}

#[test]
fn gyros_drift_with_the_force_of_the_accelerometers_that_are_used() {
    let mut parts = identity();
    parts.gyros[0].terms.push(TermParts::new(Feature::ForceX, constant(1e-4)));
    parts.accels.push(plain_accel());
    let skewed = 3_f64.sqrt().recip();
    parts.accel_orientation = Some(orientation(&[ALONG_CASE_AXES.as_slice(), &[[skewed; 3]]].concat()));
    let run = |dead: usize| {
        let events = (0..200).flat_map(|k: u32| {
            let force = (0.1 * f64::from(k)).sin();
            let mut forces = [force, 0.0, 0.0, skewed * force];
            if k >= 20 {
                forces[dead..].fill(f64::NAN);
            }
            [Owned::Accel(vec![accel(k.into(), &forces)]), Owned::Gyro(vec![gyro(k.into(), &[0.0; 3])])]
        });
        let events: Vec<_> = events.collect();
        drive::run(&mut drive::unit(&compile(&parts)), &events)
    };
    let [all, one_less, two] = [4, 3, 2].map(run);
    for (k, tick) in all.iter().enumerate() {
        assert!((one_less[k].delta_angle[0] - tick.delta_angle[0]).abs() < 1e-18, "{k}");
        // Two accelerometers tell no force: the last one stands.
        let known = &all[k.min(19)];
        assert!((two[k].delta_angle[0] - known.delta_angle[0]).abs() < 1e-18, "{k}");
    }
}
