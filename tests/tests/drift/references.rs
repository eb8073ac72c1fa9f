//! Wrong references, and the order in which right ones arrive.

use isotherm_correction::drift::Reference;
use isotherm_correction::sample::{CorrectedTick, GyroTick, OutputKind};
use isotherm_correction::unit::{Event, Unit, UnitSettings};

use crate::bench::{Bench, DEG_PER_H, calibration, table_1};

#[test]
fn a_wrong_reference_does_not_poison_the_estimate() {
    let mut bench = Bench::sound(3);
    let mut twin = Bench::sound(3);
    for bench in [&mut bench, &mut twin] {
        bench.fed_hours(4);
        bench.tick_on(&mut |_| {});
    }
    // An aiding source is wrong by 0.1 °/h about every axis for five minutes; the other unit hears nothing meanwhile.
    for minute in 0..5 {
        let mut wrong = bench.reference();
        wrong.angular_rate = wrong.angular_rate.map(|rate| rate + 0.1 * DEG_PER_H);
        bench.unit.handle(Event::Reference(&wrong), &mut |_| {});
        for bench in [&mut bench, &mut twin] {
            bench.tick_on(&mut |_| {});
        }
        // A gyro across the error is not hurt by it and not protected from it; the others are.
        let estimates = bench.estimates().into_iter().zip(twin.estimates());
        for (gyro, (hurt, sound)) in estimates.enumerate().filter(|(gyro, _)| ![1, 3, 5].contains(gyro)) {
            assert_eq!(hurt.refused, minute + 1, "gyro {gyro}");
            assert_eq!(hurt.rate.to_bits(), sound.rate.to_bits(), "gyro {gyro}");
        }
    }
    // Right again: as if nothing had been, but for the minutes that were lost.
    bench.fed_hours(2);
    assert!(bench.errors().iter().all(|error| error.abs() < 4.0), "{:?}", bench.errors());
}

#[test]
fn a_drift_that_steps_is_followed_after_ten_refusals() {
    let mut bench = Bench::sound(5);
    bench.fed_hours(4);
    let before = bench.estimates()[0].rate;
    // The same as a step of the drift: every reference is off by the same amount from now on.
    let step = 0.2 * DEG_PER_H;
    let mut refused = 0;
    for minute in 0..60 {
        bench.tick_on(&mut |_| {});
        let mut reference = bench.reference();
        reference.angular_rate[0] -= step;
        bench.unit.handle(Event::Reference(&reference), &mut |_| {});
        let estimate = bench.estimates()[0];
        // The minute's own reference takes effect in the next one.
        assert_eq!(estimate.believed, u64::from(minute >= 10), "minute {minute}");
        refused = estimate.refused;
    }
    assert_eq!(refused, 9);
    // Gyro 0 looks 0.5257 along the axis of the step.
    let found = (bench.estimates()[0].rate - before) / DEG_PER_H;
    assert!((found - 0.2 * 0.5257).abs() < 0.01, "{found} °/h");
}

/// All ticks and references of some hours.
fn recorded(minutes: usize) -> (Vec<GyroTick>, Vec<Reference>) {
    let mut bench = Bench::sound(11);
    let (mut ticks, mut references) = (Vec::new(), Vec::new());
    for _ in 0..minutes {
        ticks.extend(bench.minute());
        references.push(bench.reference());
    }
    (ticks, references)
}

/// Corrected ticks, with the drift subtracted or not; a reference is handed over before the batch that `arrives` names: the number
/// of the first tick that has not been sent yet.
fn corrected(
    subtract_drift: bool,
    (ticks, references): (&[GyroTick], &[Reference]),
    batch: usize,
    arrives: impl Fn(usize) -> usize,
) -> Vec<CorrectedTick> {
    let mut unit = Unit::new(UnitSettings { subtract_drift, ..UnitSettings::default() });
    unit.install(calibration(&table_1()), 1);
    let (mut sent, mut given, mut out) = (0, 0, Vec::new());
    for ticks in ticks.chunks(batch) {
        while given < references.len() && arrives(given) < sent + ticks.len() {
            unit.handle(Event::Reference(&references[given]), &mut |_| {});
            given += 1;
        }
        unit.handle(Event::Gyro { output: OutputKind::Mean, ticks }, &mut |tick| out.push(tick.clone()));
        sent += ticks.len();
    }
    unit.handle(Event::Flush, &mut |tick| out.push(tick.clone()));
    assert_eq!(
        unit.reference_counters().used,
        references.len() as u64 - 1,
        "the last has no tick to feel it"
    );
    out
}

#[test]
fn neither_batches_nor_the_moment_of_arrival_change_a_bit() {
    let (ticks, references) = recorded(240);
    let run = |batch: usize, arrives: &dyn Fn(usize) -> usize| {
        corrected(true, (&ticks, &references), batch, arrives)
    };
    // The reference of minute k ends with tick 15·(k + 1), is felt by the tick behind it, and may come until then.
    let end = |k: usize| 15 * (k + 1);
    let expected = run(15, &|k| end(k) - 1);
    for batch in [1, 7, 15, 50] {
        assert!(run(batch, &|k| end(k) - 1) == expected, "batches of {batch}");
        assert!(
            run(batch, &|k| end(k.saturating_sub(10))) == expected,
            "ten minutes early, batches of {batch}"
        );
    }
    assert!(run(1, &end) == expected, "at the last moment");
    // From the second tick behind the first minute on, when the ramp has begun, it makes a difference.
    let plain = corrected(false, (&ticks, &references), 15, |k| end(k) - 1);
    let differs = expected.iter().zip(&plain).map(|(a, b)| a != b);
    assert!(differs.enumerate().all(|(k, differs)| differs == (k > 15)));
}
