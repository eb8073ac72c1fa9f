//! I2: output is a function of the messages and their own timestamps, never of arrival time or batching, while
//! transport jitter stays within the configured window.

use std::sync::Arc;

use isotherm_correction::calibration::{BranchArgument, BranchedParts, Calibration};
use isotherm_correction::drift::Reference;
use isotherm_correction::sample::{AccelTick, CorrectedTick, GyroTick, TickFlags};
use isotherm_correction::unit::{Unit, UnitSettings};
use isotherm_correction::units::{Span, Timestamp};
use isotherm_tests::calibrations::{
    Feature, PutTerms, compile, constant, identity, lively_drift, polynomial,
};
use isotherm_tests::drive::{self, Owned};
use isotherm_tests::streams::{accel, end_of, gyro, temperature};
use proptest::prelude::*;

const TICKS: u64 = 2000;

/// A calibration in which every thermal term is on, so that a wrong moment shows.
fn thermal() -> Arc<Calibration> {
    let mut parts = identity();
    parts.filter.grid_step_s = 0.1;
    parts.filter.smoothing_s = 0.3;
    parts.filter.derivative_step_s = 0.2;
    for gyro in &mut parts.gyros {
        gyro.terms.curve(Feature::One, polynomial(&[1e-4, 1e-5, 1e-7]));
        gyro.terms.curve(Feature::Reading, polynomial(&[0.0, 1e-5]));
        let branched = BranchedParts {
            argument: BranchArgument::Temperature,
            run_up: constant(1e-4),
            braking: constant(2e-4),
        };
        gyro.terms.branched(Feature::ThermalRate, branched.clone());
        gyro.terms.branched(Feature::ThermalAcceleration, branched);
        gyro.terms.lags([(2.0, constant(1e-4))]);
    }
    parts.accels[0].terms.curve(Feature::One, polynomial(&[0.01, 0.001]));
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

#[test]
fn i2_batching_changes_no_bit_over_a_restart_either() {
    // Ticks of one second, so that a batch is longer than any wait.
    let second = |k: i64| Timestamp::from_ns(k * 1_000_000_000);
    let duration = Span::from_ms(1000);
    let run = |batch: usize| {
        let mut events = Vec::new();
        for (series, start) in [(1, 0), (2, 5000), (3, 2000), (4, 1990)] {
            let ticks: Vec<i64> = (0..200).collect();
            for batch in ticks.chunks(batch) {
                let accels = batch.iter().map(|&k| AccelTick {
                    end_time: second(start + k),
                    duration,
                    ..accel(k.unsigned_abs(), &[0.1, 0.2, 9.8])
                });
                let gyros = batch.iter().map(|&k| GyroTick {
                    end_time: second(start + k),
                    duration,
                    series,
                    ..gyro(k.unsigned_abs(), &[0.01; 3])
                });
                let (accels, gyros) = (accels.collect(), gyros.collect());
                events.extend([Owned::Accel(accels), Owned::Gyro(gyros)]);
            }
        }
        drive::run(&mut drive::unit(&compile(&identity())), &events)
    };
    let reference = run(1);
    assert_eq!(reference.len(), 800);
    assert!(reference.iter().all(|tick| !tick.flags.contains(TickFlags::ACCELEROMETER_MISSING)));
    for batch in [7, 64, 200] {
        assert!(run(batch) == reference, "batches of {batch}");
    }
}

#[test]
fn i2_ticks_that_change_places_behind_a_restart_are_put_in_order() {
    let mut unit = drive::unit(&compile(&identity()));
    let mut out = Vec::new();
    let tick = |series, k| Owned::Gyro(vec![GyroTick { series, ..gyro(k, &[0.01; 3]) }]);
    for k in 1000..1300 {
        drive::hand(&mut unit, &Owned::Accel(vec![accel(k, &[0.1; 3])]), &mut out);
        drive::hand(&mut unit, &tick(1, k), &mut out);
    }
    for k in [0, 2, 1, 3, 5, 4] {
        drive::hand(&mut unit, &tick(2, k), &mut out);
    }
    (0..6).for_each(|k| drive::hand(&mut unit, &Owned::Accel(vec![accel(k, &[0.1; 3])]), &mut out));
    assert!(out.iter().map(|tick| tick.sequence).eq((1000..1300).chain(0..6)));
    assert!(out.iter().all(|tick| tick.missed == 0));
}

#[test]
fn i2_the_largest_temperature_message_is_felt_reading_by_reading() {
    let celsius = |k: u64| 20.0 + 0.01 * f64::from(u32::try_from(k % 1000).unwrap_or(0));
    let run = |batch: u64| {
        let mut events = Vec::new();
        for first in (0..8192).step_by(usize::try_from(batch).unwrap()) {
            let range = first..first + batch;
            events.push(Owned::Temperature(range.clone().map(|k| temperature(k, celsius(k))).collect()));
            events.push(Owned::Accel(range.clone().map(|k| accel(k, &[0.1; 3])).collect()));
            events.push(Owned::Gyro(range.map(|k| gyro(k, &[0.01; 3])).collect()));
        }
        drive::run(&mut drive::unit(&thermal()), &events)
    };
    assert!(run(4096) == run(1));
}

#[test]
fn i2_ticks_that_still_wait_take_nothing_from_the_series_behind_them() {
    let mut unit = drive::unit(&compile(&identity()));
    let mut out = Vec::new();
    for (series, k) in (1000..1010).map(|k| (1, k)).chain((0..10).map(|k| (2, k))) {
        // The last tick of the first series never gets its accelerometer tick.
        if k != 1009 {
            drive::hand(&mut unit, &Owned::Accel(vec![accel(k, &[0.1; 3])]), &mut out);
        }
        let tick = GyroTick { series, ..gyro(k, &[0.01; 3]) };
        drive::hand(&mut unit, &Owned::Gyro(vec![tick]), &mut out);
    }
    let missing = out.iter().filter(|tick| tick.flags.contains(TickFlags::ACCELEROMETER_MISSING));
    assert_eq!(missing.map(|tick| tick.sequence).collect::<Vec<_>>(), [1009]);
    assert_eq!(out.len(), 20);
}

#[test]
fn i2_a_subtracted_drift_depends_on_the_references_and_their_own_time() {
    let mut parts = identity();
    for gyro in &mut parts.gyros {
        gyro.drift = Some(lively_drift());
    }
    let calibration = compile(&parts);
    let references: Vec<_> = (1..8)
        .map(|k| (200 * k, [1e-3, -2e-3, 5e-4].map(|rate| rate * f64::from(u32::try_from(k).unwrap()))))
        .map(|(last, angular_rate)| {
            (last, Reference { start: end_of(last - 200), end: end_of(last), angular_rate, sigma: 1e-6 })
        })
        .collect();
    // Each reference arrives some ticks after its span, by less than the delay of 1 s.
    let run = |batch: u64, lateness: u64| {
        let settings = UnitSettings { subtract_drift: true, ..UnitSettings::default() };
        let mut unit = Unit::new(settings);
        unit.install(Arc::clone(&calibration), 1);
        let mut events = Vec::new();
        for first in (0..TICKS).step_by(usize::try_from(batch).unwrap()) {
            let range = first..first + batch;
            let due = references.iter().filter(|(last, _)| range.contains(&(last + lateness)));
            events.extend(due.map(|(_, reference)| Owned::Reference(*reference)));
            events.push(Owned::Accel(range.clone().map(|k| accel(k, &[0.1; 3])).collect()));
            events.push(Owned::Gyro(range.map(|k| gyro(k, &[0.01; 3])).collect()));
        }
        drive::run(&mut unit, &events)
    };
    let reference = run(1, 1);
    let [first, last] = [&reference[0], &reference[reference.len() - 1]].map(|tick| tick.delta_angle[0]);
    assert!((first - last).abs() > 1e-6, "the drift is felt: {first} and {last}");
    for (batch, lateness) in [(1, 120), (8, 1), (50, 60), (100, 90)] {
        assert!(run(batch, lateness) == reference, "batches of {batch}, {lateness} ticks late");
    }
}
