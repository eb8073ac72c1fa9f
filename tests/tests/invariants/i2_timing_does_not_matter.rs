//! I2: output is a function of the messages and their own timestamps, never of arrival time or batching, while
//! transport jitter stays within the configured window.

use std::sync::Arc;

use isotherm_correction::calibration::{BranchArgument, BranchedParts, Calibration, LagParts};
use isotherm_correction::sample::CorrectedTick;
use isotherm_tests::calibrations::{compile, constant, identity, polynomial};
use isotherm_tests::drive::{self, Owned};
use isotherm_tests::streams::{accel, gyro, temperature};
use proptest::prelude::*;

const TICKS: u64 = 2000;

/// A calibration in which every thermal term is on, so that a wrong moment shows.
fn thermal() -> Arc<Calibration> {
    let mut parts = identity();
    parts.filter.grid_step_s = 0.1;
    parts.filter.smoothing_s = 0.3;
    parts.filter.derivative_step_s = 0.2;
    for gyro in &mut parts.gyros {
        gyro.static_bias = Some(polynomial(&[1e-4, 1e-5, 1e-7]));
        gyro.increment_weight_error = Some(polynomial(&[0.0, 1e-5]));
        let branched = BranchedParts {
            argument: BranchArgument::Temperature,
            run_up: constant(1e-4),
            braking: constant(2e-4),
        };
        gyro.thermal_rate = Some(branched.clone());
        gyro.thermal_acceleration = Some(branched);
        gyro.lags = vec![LagParts { time_constant_s: 2.0, gain: constant(1e-4) }];
    }
    parts.accels[0].bias = Some(polynomial(&[0.01, 0.001]));
    compile(&parts)
}

/// A message with the time at which it would be sent: the end of its last tick.
fn messages(batch: u64) -> Vec<(u64, Owned)> {
    let wave = |k: u64| f64::from(u32::try_from(k % 97).unwrap_or(0)) * 1e-3;
    let mut messages = Vec::new();
    let mut first = 0;
    while first < TICKS {
        let range = first..(first + batch).min(TICKS);
        let at = range.end - 1;
        let accels = range.clone().map(|k| accel(k, &[wave(k), 0.5, 9.8])).collect();
        let gyros = range.map(|k| gyro(k, &[wave(k), -wave(k + 3), 0.01])).collect();
        messages.push((at, Owned::Accel(accels)));
        messages.push((at, Owned::Gyro(gyros)));
        first += batch;
    }
    for k in (0..TICKS).step_by(20) {
        let celsius = 20.0 + f64::from(u32::try_from(k).unwrap_or(0)) * 2e-3 + wave(k);
        messages.push((k, Owned::Temperature(vec![temperature(k, celsius)])));
    }
    messages
}

/// Runs the messages in order of sending, each delayed by what `delay` says (in ticks), ties as they are.
fn run(batch: u64, mut delay: impl FnMut(usize) -> u64) -> Vec<CorrectedTick> {
    let mut sent: Vec<_> =
        messages(batch).into_iter().enumerate().map(|(i, (at, event))| (at + delay(i), at, event)).collect();
    sent.sort_by_key(|(arrival, at, _)| (*arrival, *at));
    let events: Vec<Owned> = sent.into_iter().map(|(_, _, event)| event).collect();
    drive::run(&mut drive::unit(&thermal()), &events)
}

#[test]
fn i2_batching_changes_no_bit() {
    let reference = run(1, |_| 0);
    assert_eq!(reference.len() as u64, TICKS);
    for batch in [2, 7, 64, 500] {
        assert!(run(batch, |_| 0) == reference, "batches of {batch}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn i2_jitter_within_the_window_changes_no_bit(delays in prop::collection::vec(0_u64..8, 64)) {
        // The window is 50 ms, ten ticks.
        let reference = run(1, |_| 0);
        prop_assert!(run(1, |i| delays[i % delays.len()]) == reference);
    }
}
