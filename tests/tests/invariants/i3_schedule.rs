//! I3, continued: a calibration that takes effect at a stated tick or time, and one that is slewed in.

use isotherm_correction::calibration::CalibrationParts;
use isotherm_correction::sample::{CorrectedTick, OutputKind, TickFlags};
use isotherm_correction::unit::{At, Change, Event, Unit};
use isotherm_correction::units::Span;
use isotherm_tests::calibrations::{Feature, PutTerms, compile, identity, polynomial};
use isotherm_tests::drive::{self, Owned};
use isotherm_tests::streams::{accel, end_of, gyro, temperature};

const TICKS: u64 = 2000;

fn with_bias(bias: f64) -> CalibrationParts {
    let mut parts = identity();
    for gyro in &mut parts.gyros {
        gyro.terms.curve(Feature::One, polynomial(&[bias, 1e-5]));
    }
    parts
}

fn change(parts: &CalibrationParts, revision: u64, at: At, slew: Span) -> Change {
    Change { calibration: compile(parts), revision, at, slew }
}

/// A run in batches of `batch` ticks, with what is done before each of them.
fn run(batch: u64, mut before: impl FnMut(u64, &mut Unit)) -> Vec<CorrectedTick> {
    let mut unit = drive::unit(&compile(&with_bias(1e-4)));
    let mut out = Vec::new();
    for first in (0..TICKS).step_by(usize::try_from(batch).unwrap()) {
        before(first, &mut unit);
        let ticks = first..first + batch;
        let readings = ticks.clone().filter(|k| k % 100 == 0);
        let readings = readings.map(|k| temperature(k, 20.0 + 0.002 * f64::from(u32::try_from(k).unwrap())));
        drive::hand(&mut unit, &Owned::Temperature(readings.collect()), &mut out);
        let accels = ticks.clone().map(|k| accel(k, &[0.0, 0.0, 9.8])).collect();
        drive::hand(&mut unit, &Owned::Accel(accels), &mut out);
        drive::hand(&mut unit, &Owned::Gyro(ticks.map(|k| gyro(k, &[0.01; 3])).collect()), &mut out);
    }
    unit.handle(Event::Flush, &mut |tick| out.push(tick.clone()));
    out
}

#[test]
fn i3_a_change_at_a_stated_tick_or_time_does_not_depend_on_when_it_was_asked_for() {
    let by_hand = run(1, |first, unit| {
        if first == 1234 {
            unit.install(compile(&with_bias(3e-4)), 2);
        }
    });
    for at in [At::Sequence(1234), At::TimeNs(end_of(1234).as_ns())] {
        for (batch, asked) in [(1, 0), (1, 1233), (8, 40), (250, 1000)] {
            let scheduled = run(batch, |first, unit| {
                if first == asked {
                    unit.schedule(change(&with_bias(3e-4), 2, at, Span::ZERO));
                    assert_eq!(unit.pending(), Some((2, at)));
                }
            });
            assert_eq!(scheduled, by_hand, "{at:?}, batches of {batch}");
        }
    }
}

#[test]
fn i3_a_change_replaces_the_one_that_waits() {
    let mut unit = drive::unit(&compile(&identity()));
    let later = |revision| change(&with_bias(1e-3), revision, At::Sequence(50), Span::ZERO);
    assert_eq!(unit.schedule(later(2)), None);
    assert_eq!(unit.schedule(later(3)), Some(2));
    let now = change(&identity(), 4, At::NextTick, Span::ZERO);
    assert_eq!((unit.schedule(now), unit.pending()), (Some(3), None));
}

#[test]
fn i3_a_change_that_waits_takes_effect_at_a_restart() {
    let mut unit = drive::unit(&compile(&identity()));
    unit.schedule(change(&with_bias(1e-3), 2, At::Sequence(1_000_000), Span::ZERO));
    let mut out = Vec::new();
    for (series, k) in [(1, 0), (1, 1), (2, 5), (2, 6)] {
        drive::hand(&mut unit, &Owned::Accel(vec![accel(k, &[0.0; 3])]), &mut out);
        let mut tick = gyro(k, &[0.0; 3]);
        tick.series = series;
        drive::hand(&mut unit, &Owned::Gyro(vec![tick]), &mut out);
    }
    unit.handle(Event::Flush, &mut |tick| out.push(tick.clone()));
    let revisions: Vec<_> = out.iter().map(|tick| (tick.sequence, tick.revision)).collect();
    assert_eq!(revisions, [(0, 1), (1, 1), (5, 2), (6, 2)]);
    assert!(out[2].flags.contains(TickFlags::RESTART));
}

#[test]
fn i3_ticks_that_only_fit_the_calibration_that_waits_are_not_refused() {
    let mut counts = identity();
    counts.gyro_output = OutputKind::Counts;
    counts.accel_output = OutputKind::Counts;
    let mut unit = drive::unit(&compile(&identity()));
    unit.schedule(change(&counts, 2, At::Sequence(10), Span::ZERO));
    let mut out = Vec::new();
    for k in 0..20 {
        let output = if k < 10 { OutputKind::Mean } else { OutputKind::Counts };
        let mut emit = |tick: &CorrectedTick| out.push(tick.clone());
        unit.handle(Event::Accel { output, ticks: &[accel(k, &[0.0; 3])] }, &mut emit);
        unit.handle(Event::Gyro { output, ticks: &[gyro(k, &[1.0; 3])] }, &mut emit);
    }
    unit.handle(Event::Flush, &mut |tick| out.push(tick.clone()));
    assert!(out.iter().map(|tick| (tick.sequence, tick.missed)).eq((0..20).map(|k| (k, 0))));
    assert!(!out.iter().any(|tick| tick.flags.contains(TickFlags::ACCELEROMETER_MISSING)));
}

#[test]
fn i3_a_slewed_change_has_no_step_and_arrives() {
    let slew = Span::from_ms(2000);
    let mut to = with_bias(5e-4);
    // Axes, scale factors and weights move too.
    to.gyro_orientation.rows[0] = [0.8, 0.6, 0.0];
    for gyro in &mut to.gyros {
        gyro.increment_weight = 1.01;
    }
    for accel in &mut to.accels {
        accel.scale_factor = polynomial(&[1.02]);
    }
    let at_once = run(1, |first, unit| {
        if first == 1000 {
            unit.schedule(change(&to, 2, At::NextTick, Span::ZERO));
        }
    });
    let slewed = run(1, |first, unit| {
        if first == 1000 {
            unit.schedule(change(&to, 2, At::NextTick, slew));
        }
    });
    assert!(slewed.iter().map(|tick| tick.sequence).eq(0..TICKS));
    assert_eq!(slewed[..1000], at_once[..1000]);
    assert_eq!(slewed[1000].revision, 2, "the output names the new calibration from its first tick on");
    let step = |run: &[CorrectedTick], k: usize| {
        let change =
            |a: [f64; 3], b: [f64; 3]| a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        let (last, this) = (&run[k - 1], &run[k]);
        change(last.delta_angle, this.delta_angle).max(change(last.delta_velocity, this.delta_velocity))
    };
    let jump = step(&at_once, 1000);
    // The way takes 400 ticks; what temperature does on each of them is far below.
    let largest = (1000..slewed.len()).map(|k| step(&slewed, k)).fold(0.0, f64::max);
    assert!(largest < jump / 390.0, "{largest:e} of {jump:e}");
    assert_eq!(slewed[1400..], at_once[1400..], "after the slew nothing is left of it");
}

#[test]
fn i3_a_slew_that_is_overtaken_by_another_has_no_step_either() {
    let slew = Span::from_ms(2000);
    let bias = |tick: &CorrectedTick| tick.delta_angle[0];
    let run = run(1, |first, unit| {
        let to = [(1000, 5e-4, 2), (1200, 0.0, 3)].into_iter().find(|(tick, ..)| *tick == first);
        if let Some((_, bias, revision)) = to {
            unit.schedule(change(&with_bias(bias), revision, At::NextTick, slew));
        }
    });
    let largest = run.windows(2).map(|pair| (bias(&pair[1]) - bias(&pair[0])).abs()).fold(0.0, f64::max);
    assert!(largest < 5e-4 * 0.005 / 390.0, "{largest:e}");
}
