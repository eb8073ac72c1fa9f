use alloc::vec::Vec;
use core::f64::consts::{PI, TAU};

use proptest::prelude::*;

use super::*;
use crate::sample::LasingMode;
use crate::sigma::Causes;
use crate::units::Timestamp;

const TICK_S: f64 = 5e-3;
const TICK_NS: i64 = 5_000_000;

fn tick(sequence: u64) -> CorrectedTick {
    let k = f64::from(u32::try_from(sequence).unwrap());
    CorrectedTick {
        sequence,
        end_time: Timestamp::from_ns(i64::try_from(sequence).unwrap() * TICK_NS),
        duration: Span::from_ns(TICK_NS),
        ticks: 1,
        delta_angle: [1e-3 * k, -2e-3, 3e-4],
        delta_velocity: [0.05, 0.01 * k, -0.02],
        mode: Some(LasingMode::Plus),
        gyro_flags: [SensorFlags::VALID; 3].into_iter().collect(),
        accel_flags: [SensorFlags::VALID; 3].into_iter().collect(),
        revision: 7,
        ..CorrectedTick::default()
    }
}

fn summed(step: NavigationStep, ticks: &[CorrectedTick]) -> Vec<CorrectedTick> {
    let mut steps = Vec::new();
    let mut sum = StepSum::default();
    for tick in ticks {
        sum.push(&step, tick, &mut |step| steps.push(step.clone()));
    }
    sum.flush(&step, &mut |step| steps.push(step.clone()));
    steps
}

fn stated(ticks: u16, coning_sculling: bool) -> NavigationStep {
    NavigationStep::new(ticks, coning_sculling).unwrap()
}

fn largest(a: [f64; 3], b: [f64; 3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

#[test]
fn a_step_of_one_tick_is_the_tick() {
    let ticks: Vec<_> = (0..10).map(tick).collect();
    assert_eq!(summed(stated(1, false), &ticks), ticks);
    assert_eq!(summed(NavigationStep::default(), &ticks), ticks);
}

#[test]
fn a_step_sums_what_can_be_summed_and_takes_the_rest_from_its_last_tick() {
    let mut ticks: Vec<_> = (0..6).map(tick).collect();
    ticks[0].missed = 3;
    ticks[0].flags = TickFlags::GAP;
    ticks[1].flags = TickFlags::INTERPOLATED;
    ticks[1].gyro_flags[2] = SensorFlags::OVERRANGE;
    ticks[2].mode = Some(LasingMode::Minus);
    let steps = summed(stated(3, false), &ticks);
    let [first, second] = &steps[..] else { panic!("two steps") };
    assert_eq!((first.sequence, first.ticks, first.missed), (2, 3, 3));
    assert_eq!(first.duration, Span::from_ns(3 * TICK_NS));
    assert_eq!(first.end_time, ticks[2].end_time);
    assert_eq!(first.mode, Some(LasingMode::Minus));
    assert_eq!(first.flags, TickFlags::GAP | TickFlags::INTERPOLATED);
    let valid = SensorFlags::VALID;
    assert_eq!(first.gyro_flags.as_slice(), [valid, valid, SensorFlags::OVERRANGE]);
    assert!(largest(first.delta_angle, [3e-3, -6e-3, 9e-4]) < 1e-17);
    assert_eq!((second.sequence, second.missed, second.flags), (5, 0, TickFlags::empty()));
}

#[test]
fn a_step_ends_early_before_anything_it_must_not_span() {
    let changes: [fn(&mut CorrectedTick); 4] = [
        |tick| tick.missed = 1,
        |tick| tick.flags |= TickFlags::RESTART,
        |tick| tick.revision = 8,
        |tick| tick.flags |= TickFlags::UNCALIBRATED,
    ];
    for change in changes {
        let mut ticks: Vec<_> = (0..8).map(tick).collect();
        change(&mut ticks[2]);
        let steps = summed(stated(4, true), &ticks);
        assert_eq!(steps[0].ticks, 2);
        assert_eq!(steps[1].missed, ticks[2].missed);
        assert_eq!(steps.iter().map(|step| step.ticks).sum::<u16>(), 8);
    }
}

#[test]
fn raw_readings_are_summed_plainly_and_say_so() {
    let mut ticks: Vec<_> = (0..4).map(tick).collect();
    for tick in &mut ticks {
        tick.flags = TickFlags::UNCALIBRATED;
    }
    assert_eq!(summed(stated(4, true), &ticks), summed(stated(4, false), &ticks));
}

#[test]
fn raw_readings_have_no_part_in_the_first_step_of_a_calibration() {
    let calibrated: Vec<_> = (4..8).map(tick).collect();
    let raw = CorrectedTick {
        delta_angle: [-90.0, 4000.0, 15.0],
        delta_velocity: [2500.0, 3.0, -70.0],
        flags: TickFlags::UNCALIBRATED,
        revision: 0,
        ..tick(3)
    };
    let [alone, after_raw] =
        [&calibrated[..], &[&[raw], &calibrated[..]].concat()].map(|ticks| summed(stated(4, true), ticks));
    assert_eq!(alone[0], after_raw[1]);
}

#[test]
fn a_sensor_that_is_not_there_in_every_tick_is_not_valid() {
    let mut ticks: Vec<_> = (0..3).map(tick).collect();
    ticks[0].gyro_flags.truncate(2);
    ticks[2].accel_flags.truncate(1);
    let steps = summed(stated(3, false), &ticks);
    let (valid, none) = (SensorFlags::VALID, SensorFlags::empty());
    assert_eq!(steps[0].gyro_flags.as_slice(), [valid, valid, none]);
    assert_eq!(steps[0].accel_flags.as_slice(), [valid, none, none]);
}

#[test]
fn steps_out_of_range_are_refused() {
    for ticks in [0, 1001] {
        let error = NavigationError { got: ticks };
        assert_eq!(NavigationStep::new(ticks, true), Err(error));
    }
}

/// Quaternion product, scalar first.
fn product(p: [f64; 4], q: [f64; 4]) -> [f64; 4] {
    [
        p[0] * q[0] - p[1] * q[1] - p[2] * q[2] - p[3] * q[3],
        p[0] * q[1] + p[1] * q[0] + p[2] * q[3] - p[3] * q[2],
        p[0] * q[2] - p[1] * q[3] + p[2] * q[0] + p[3] * q[1],
        p[0] * q[3] + p[1] * q[2] - p[2] * q[1] + p[3] * q[0],
    ]
}

/// Rotation vector of a unit quaternion of a small rotation.
fn rotation_vector(q: [f64; 4]) -> [f64; 3] {
    let sine = libm::sqrt(q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    let factor = 2.0 * libm::atan2(sine, q[0]) / sine;
    [q[1] * factor, q[2] * factor, q[3] * factor]
}

#[test]
fn coning_terms_take_out_the_drift_of_a_coning_motion() {
    // Attitude (cos a/2, 0, sin a/2 cos Ωt, sin a/2 sin Ωt) [Savage]: its body rate integrates in closed form.
    let (cone, omega) = (PI / 180.0, TAU * 10.0);
    let attitude = |t: f64| {
        let (sin, cos) = (libm::sin(cone / 2.0), libm::cos(cone / 2.0));
        [cos, 0.0, sin * libm::cos(omega * t), sin * libm::sin(omega * t)]
    };
    let length = 4;
    let ticks: Vec<_> = (1..=400)
        .map(|k| {
            let end = f64::from(k) * TICK_S;
            let start = end - TICK_S;
            CorrectedTick {
                delta_angle: [
                    -2.0 * omega * libm::sin(cone / 2.0) * libm::sin(cone / 2.0) * TICK_S,
                    libm::sin(cone) * (libm::cos(omega * end) - libm::cos(omega * start)),
                    libm::sin(cone) * (libm::sin(omega * end) - libm::sin(omega * start)),
                ],
                ticks: 1,
                ..CorrectedTick::default()
            }
        })
        .collect();
    // Mean error about the cone's axis per step, the first step left out: the drift.
    let drift = |coning| {
        let steps = summed(stated(length, coning), &ticks);
        let errors = steps.iter().zip(0_u32..).skip(1).map(|(step, index)| {
            let start = f64::from(index) * f64::from(length) * TICK_S;
            let [w, x, y, z] = attitude(start);
            let turned = product([w, -x, -y, -z], attitude(start + f64::from(length) * TICK_S));
            step.delta_angle[0] - rotation_vector(turned)[0]
        });
        (errors.sum::<f64>() / 99.0).abs()
    };
    let (plain, compensated) = (drift(false), drift(true));
    assert!(plain > 1e-5, "{plain}");
    assert!(compensated * 400.0 < plain, "{compensated} against {plain}");
}

#[test]
fn sculling_terms_take_out_the_error_of_a_sculling_motion() {
    // Rotation about x in phase with an acceleration along y: a false z without the terms.
    let (a, force, omega) = (PI / 180.0, 10.0, TAU * 10.0);
    let m = 4;
    let ticks: Vec<_> = (1..=400)
        .map(|k| {
            let end = f64::from(k) * TICK_S;
            let start = end - TICK_S;
            let turned = a * (libm::sin(omega * end) - libm::sin(omega * start));
            let gained = force / omega * (libm::cos(omega * start) - libm::cos(omega * end));
            CorrectedTick {
                delta_angle: [turned, 0.0, 0.0],
                delta_velocity: [0.0, gained, 0.0],
                ticks: 1,
                ..CorrectedTick::default()
            }
        })
        .collect();
    let error = |terms| {
        let steps = summed(stated(m, terms), &ticks);
        let errors = steps.iter().zip(0_u32..).skip(1).map(|(step, index)| {
            let start = f64::from(index) * f64::from(m) * TICK_S;
            let points = 2000;
            let dt = f64::from(m) * TICK_S / f64::from(points);
            let truth = (0..points).fold([0.0; 3], |sum, i| {
                let t = start + (f64::from(i) + 0.5) * dt;
                let turned = a * (libm::sin(omega * t) - libm::sin(omega * start));
                let dv = force * libm::sin(omega * t) * dt;
                plus(sum, [0.0, dv * libm::cos(turned), dv * libm::sin(turned)])
            });
            largest(step.delta_velocity, truth)
        });
        errors.fold(0.0, f64::max)
    };
    let (plain, compensated) = (error(false), error(true));
    assert!(plain > 1e-4, "{plain}");
    assert!(compensated * 100.0 < plain, "{compensated} against {plain}");
}

#[test]
fn a_constant_turn_under_constant_force_is_exact() {
    // 1 rad about z in one step, 10 m/s² along x: Δv = f·T·(sin φ, 1 − cos φ)/φ in the axes at the start.
    for (m, rate) in [(200, 1.0), (4, 0.5), (2, 20.0)] {
        let tick = CorrectedTick {
            delta_angle: [0.0, 0.0, rate * TICK_S],
            delta_velocity: [10.0 * TICK_S, 0.0, 0.0],
            ticks: 1,
            ..CorrectedTick::default()
        };
        let ticks: Vec<_> = (0..m).map(|_| tick.clone()).collect();
        let steps = summed(stated(m, true), &ticks);
        let (phi, speed) = (rate * TICK_S * f64::from(m), 10.0 * TICK_S * f64::from(m));
        let truth = [libm::sin(phi) / phi * speed, (1.0 - libm::cos(phi)) / phi * speed, 0.0];
        assert!(largest(steps[0].delta_velocity, truth) < 1e-13 * speed);
        assert!(largest(steps[0].delta_angle, [0.0, 0.0, phi]) < 1e-14);
        assert!(steps[0].flags.contains(TickFlags::CONING_SCULLING));
    }
}

proptest! {
    #[test]
    fn every_tick_is_in_exactly_one_step(
        length in 1..20_u16,
        terms in any::<bool>(),
        gaps in prop::collection::vec(0..12_u64, 1..100),
    ) {
        let mut sequence = 0;
        let ticks: Vec<_> = gaps
            .iter()
            .map(|gap| {
                let missed = gap.saturating_sub(9);
                sequence += 1 + missed;
                let flags = if missed > 0 { TickFlags::GAP } else { TickFlags::empty() };
                CorrectedTick { missed, flags, ..tick(sequence) }
            })
            .collect();
        let steps = summed(stated(length, terms), &ticks);
        let mut last = 0;
        for step in &steps {
            prop_assert!(step.ticks >= 1 && step.ticks <= length);
            // Sequence numbers are all accounted for: in the step, or announced as missing before it.
            prop_assert_eq!(step.sequence - last, u64::from(step.ticks) + step.missed);
            last = step.sequence;
        }
        prop_assert_eq!(last, sequence);
    }

    #[test]
    fn no_numbers_panic(
        values in prop::collection::vec(prop::array::uniform3(prop::num::f64::ANY), 2..20),
        ns in any::<i64>(),
        ticks in any::<u16>(),
    ) {
        let ticks: Vec<_> = values
            .iter()
            .map(|v| CorrectedTick {
                delta_angle: *v,
                delta_velocity: *v,
                duration: Span::from_ns(ns),
                ticks,
                ..CorrectedTick::default()
            })
            .collect();
        prop_assert!(!summed(stated(5, true), &ticks).is_empty());
    }
}

#[test]
fn restoration_adds_up_over_the_ticks_of_one_switch_and_in_squares_beyond() {
    let ticks: Vec<_> = (0..8)
        .map(|k| {
            let lost = (2..5).contains(&k);
            let restoration = if lost || k == 6 { [3e-6; 3] } else { [0.0; 3] };
            let flags = match k {
                2..=4 => TickFlags::INTERPOLATED,
                6 => TickFlags::ANGLE_RESTORED,
                _ => TickFlags::empty(),
            };
            let angle = Causes { noise: [1e-6; 3], restoration, ..Causes::default() };
            let sigma = Some(Box::new(Sigma { angle, ..Sigma::default() }));
            CorrectedTick { flags, sigma, ..tick(k) }
        })
        .collect();
    let of = |ticks: u16, all: &[CorrectedTick]| -> Vec<[f64; 2]> {
        let steps = summed(stated(ticks, false), all);
        let angles = steps.iter().map(|step| step.sigma.as_deref().unwrap().angle);
        angles.map(|angle| [angle.noise[0], angle.restoration[0]].map(|sigma| 1e6 * sigma)).collect()
    };
    let near = |got: &[[f64; 2]], expected: &[[f64; 2]]| {
        assert_eq!(got.len(), expected.len());
        let pairs = got.iter().flatten().zip(expected.iter().flatten());
        pairs.for_each(|(got, expected)| assert!((got - expected).abs() < 1e-9, "{got} {expected}"));
    };
    let root = |squared: f64| libm::sqrt(squared);
    near(&of(8, &ticks), &[[root(8.0), root(81.0 + 9.0)]]);
    near(&of(4, &ticks), &[[2.0, 6.0], [2.0, root(18.0)]]);
    // Two switches.
    near(&of(5, &[&ticks[2..4], &ticks[6..], &ticks[4..5]].concat()), &[[root(5.0), root(36.0 + 18.0)]]);
}
