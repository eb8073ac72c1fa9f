//! I1: every raw gyro tick gives exactly one corrected tick, or is counted in a gap that the next output announces.
//! Duplicates give none.

use isotherm_correction::sample::{AccelTick, CorrectedTick, GyroTick, TickFlags};
use isotherm_correction::unit::{Event, Uncalibrated, Unit, UnitSettings};
use isotherm_correction::units::Span;
use isotherm_tests::calibrations::{compile, identity};
use isotherm_tests::drive::{self, Owned};
use isotherm_tests::streams::{accel, gyro};
use proptest::prelude::*;

const RATES: [f64; 3] = [0.1, 0.2, 0.3];

/// The accounting rule of a consumer: returns (ticks, announced missing), panics where they do not add up.
fn account(out: &[CorrectedTick]) -> (u64, u64) {
    let mut next = None;
    for tick in out {
        if let Some(next) = next {
            assert_eq!(tick.sequence, next + tick.missed, "{tick:?}");
        }
        assert_eq!(tick.missed > 0, tick.flags.contains(TickFlags::GAP));
        next = Some(tick.sequence + 1);
    }
    (out.len() as u64, out.iter().map(|tick| tick.missed).sum())
}

fn batch(k: u64) -> [Owned; 2] {
    [Owned::Accel(vec![accel(k, &RATES)]), Owned::Gyro(vec![gyro(k, &RATES)])]
}

proptest! {
    #[test]
    fn i1_every_tick_is_given_once_or_announced(
        // What happens to each tick: 0 lost, 1 sent once, 2 sent twice, 3 swapped with the next one.
        fates in prop::collection::vec(0_u8..=3, 20..200)
    ) {
        let mut order: Vec<u64> = Vec::new();
        for (k, fate) in fates.iter().enumerate() {
            match fate {
                0 if k > 0 => {}
                2 => order.extend([k as u64; 2]),
                // Only past its neighbour: a tick that is overtaken again and again falls out of the window.
                3 if order.len() > 1 && order.last() == Some(&(k as u64 - 1)) && fates[k - 1] == 1 => order.insert(order.len() - 1, k as u64),
                _ => order.push(k as u64),
            }
        }
        let events: Vec<Owned> = order.iter().copied().flat_map(batch).collect();
        let mut unit = drive::unit(&compile(&identity()));
        let out = drive::run(&mut unit, &events);
        let (given, announced) = account(&out);
        let last = *order.iter().max().unwrap();
        prop_assert_eq!(given + announced, last + 1 - order[0]);
        let mut distinct = order.clone();
        distinct.sort_unstable();
        distinct.dedup();
        prop_assert_eq!(given, distinct.len() as u64, "a tick that came in time was not given");
    }
}

#[test]
fn i1_a_duplicate_of_any_age_gives_nothing() {
    let mut unit = drive::unit(&compile(&identity()));
    let mut out = Vec::new();
    for k in 0..100 {
        for event in &batch(k) {
            drive::hand(&mut unit, event, &mut out);
        }
    }
    for k in [99, 98, 50, 1] {
        for event in &batch(k) {
            drive::hand(&mut unit, event, &mut out);
        }
    }
    assert_eq!(out.len(), 100);
    assert_eq!(unit.counters().gyro_duplicates, 4);
}

#[test]
fn i1_a_gap_of_a_million_ticks_is_one_announcement() {
    let mut unit = drive::unit(&compile(&identity()));
    let events: Vec<Owned> = (0..10).chain(1_000_010..1_000_020).flat_map(batch).collect();
    let out = drive::run(&mut unit, &events);
    assert_eq!(account(&out), (20, 1_000_000));
    assert_eq!(unit.counters().gaps, 1);
}

#[test]
fn i1_ticks_that_were_held_back_are_announced_once_a_calibration_is_there() {
    let mut unit = Unit::new(UnitSettings { uncalibrated: Uncalibrated::Hold, ..UnitSettings::default() });
    let mut out = Vec::new();
    (0..30).flat_map(batch).for_each(|event| drive::hand(&mut unit, &event, &mut out));
    assert!(out.is_empty());
    let held = unit.counters().ticks_held;
    unit.install(compile(&identity()), 1);
    (30..60).flat_map(batch).for_each(|event| drive::hand(&mut unit, &event, &mut out));
    assert_eq!(out[0].missed, held);
    assert_eq!(held + out.len() as u64, 60);
}

#[test]
fn i1_a_restarted_producer_is_followed_and_its_lost_ticks_are_announced() {
    let mut unit = drive::unit(&compile(&identity()));
    let mut out = Vec::new();
    (1000..1300).flat_map(batch).for_each(|event| drive::hand(&mut unit, &event, &mut out));
    (0..300).flat_map(batch).for_each(|event| drive::hand(&mut unit, &event, &mut out));
    let restart = out.iter().position(|tick| tick.flags.contains(TickFlags::RESTART)).expect("a restart");
    assert_eq!(restart, 300);
    assert_eq!(out[restart].sequence, out[restart].missed, "the new series began at 0");
    assert_eq!(out.len() as u64 + out[restart].missed, 600);
    assert_eq!(unit.counters().gyro_implausible, out[restart].missed, "the one that is believed is not");
}

#[test]
fn i1_ticks_that_are_refused_around_a_restart_are_announced_by_it() {
    let (fits, bad) = (gyro(0, &RATES), GyroTick { duration: Span::ZERO, ..gyro(0, &RATES) });
    for broken in [bad, gyro(0, &[0.1; 4])] {
        let mut unit = drive::unit(&compile(&identity()));
        let tick = |like: &GyroTick, series, k| {
            let GyroTick { sequence, end_time, .. } = gyro(k, &RATES);
            [
                Owned::Accel(vec![accel(k, &RATES)]),
                Owned::Gyro(vec![GyroTick { sequence, end_time, series, ..like.clone() }]),
            ]
        };
        // Within a run the sequence says it; nobody is told twice.
        let old = (0..100).flat_map(|k| tick(if k == 50 { &broken } else { &fits }, 1, k));
        let refused = (100..103).map(|k| (1, k)).chain((0..4).map(|k| (2, k)));
        let refused = refused.flat_map(|(series, k)| tick(&broken, series, k));
        let new = (4..20).map(|k| (2, k)).chain((0..9).map(|k| (3, k)));
        let new = new.flat_map(|(series, k)| tick(&fits, series, k));
        let out = drive::run(&mut unit, &old.chain(refused).chain(new).collect::<Vec<_>>());
        let told = out.iter().filter(|tick| tick.missed > 0);
        let told: Vec<_> = told.map(|tick| (tick.series, tick.sequence, tick.missed)).collect();
        assert_eq!(told, [(1, 51, 1), (2, 4, 7)], "{broken:?}");
        assert_eq!((out.len(), unit.counters().restarts), (99 + 16 + 9, 2));
    }
}

#[test]
fn i1_accelerometer_ticks_of_a_new_run_go_to_none_of_the_old() {
    // So many ticks of the old run, of which the last have no accelerometer tick, and where the clock is when the new one begins.
    for (ticks, silent, clock_ms) in
        [(100, 3, 97 * 5), (100, 3, 97 * 5 + 2), (3, 0, 0), (3, 0, 3), (1, 0, 0), (7, 1, 32)]
    {
        let mut unit = drive::unit(&compile(&identity()));
        let tick = |series: u32, k, clock_ms| {
            let (gyro, accel) = (gyro(k, &RATES), accel(k, &[f64::from(series), 0.0, 0.0]));
            let end_time = gyro.end_time + Span::from_ms(clock_ms);
            [
                Owned::Accel(vec![AccelTick { end_time, ..accel }]),
                Owned::Gyro(vec![GyroTick { end_time, series: series.into(), ..gyro }]),
            ]
        };
        let old = (0..ticks).flat_map(|k| {
            let [accel, gyro] = tick(1, k, 0);
            [Some(accel).filter(|_| k + silent < ticks), Some(gyro)].into_iter().flatten()
        });
        let new = (0..50).flat_map(|k| tick(2, k, clock_ms));
        let out = drive::run(&mut unit, &old.chain(new).collect::<Vec<_>>());
        assert_eq!(out.len() as u64, ticks + 50);
        for tick in &out {
            let expected = if tick.series == 1 && tick.sequence + silent >= ticks { 0 } else { tick.series };
            let got = tick.delta_velocity[0] / tick.duration.as_s();
            let at = (ticks, clock_ms, tick.series, tick.sequence);
            assert!((got - f64::from(u32::try_from(expected).unwrap())).abs() < 1e-9, "{at:?}: {got}");
        }
    }
}

#[test]
fn i1_accelerometer_ticks_find_their_gyro_ticks_without_numbers_of_their_own() {
    let mut unit = drive::unit(&compile(&identity()));
    let unnumbered = |k| Owned::Accel(vec![AccelTick { sequence: 0, ..accel(k, &RATES) }]);
    let events = (0..50).flat_map(|k| [unnumbered(k), Owned::Gyro(vec![gyro(k, &RATES)])]);
    let _ = drive::run(&mut unit, &events.collect::<Vec<_>>());
    let counters = unit.counters();
    assert_eq!((counters.ticks_out, counters.accel_missing, counters.accel_late), (50, 0, 0));
}

#[test]
fn i1_a_stretch_of_old_ticks_sent_again_gives_nothing() {
    let mut unit = drive::unit(&compile(&identity()));
    let mut out = Vec::new();
    (0..1000).flat_map(batch).for_each(|event| drive::hand(&mut unit, &event, &mut out));
    (100..300).flat_map(batch).for_each(|event| drive::hand(&mut unit, &event, &mut out));
    (1000..1100).flat_map(batch).for_each(|event| drive::hand(&mut unit, &event, &mut out));
    assert_eq!(account(&out), (1100, 0));
}

#[test]
fn i1_a_producer_that_says_it_starts_anew_loses_nothing() {
    let mut unit = drive::unit(&compile(&identity()));
    let mut out = Vec::new();
    let in_series = |series, k| {
        let [accels, Owned::Gyro(mut gyros)] = batch(k) else {
            unreachable!("a batch ends with its gyro ticks")
        };
        gyros[0].series = series;
        [accels, Owned::Gyro(gyros)]
    };
    for series in [10, 30, 20] {
        // The same short log again and again, its first message twice, and then one from the run before.
        let first = in_series(series, 0).into_iter().chain(in_series(series, 0));
        for event in first.chain((1..100).flat_map(|k| in_series(series, k))) {
            drive::hand(&mut unit, &event, &mut out);
        }
    }
    for event in &in_series(30, 99) {
        drive::hand(&mut unit, event, &mut out);
    }
    let sequences: Vec<u64> = out.iter().map(|tick| tick.sequence).collect();
    assert!(sequences.iter().copied().eq((0..3).flat_map(|_| 0..100)), "{sequences:?}");
    assert_eq!(out.iter().filter(|tick| tick.flags.contains(TickFlags::RESTART)).count(), 2);
    assert!(out.iter().all(|tick| tick.missed == 0));
}

#[test]
fn i1_a_restart_that_was_held_back_is_announced_once() {
    let mut unit = Unit::new(UnitSettings { uncalibrated: Uncalibrated::Hold, ..UnitSettings::default() });
    let mut out = Vec::new();
    let in_series = |series, k| Owned::Gyro(vec![GyroTick { series, ..gyro(k, &RATES) }]);
    for (series, k) in (0..30).map(|k| (0, k)).chain((0..30).map(|k| (1, k))) {
        drive::hand(&mut unit, &in_series(series, k), &mut out);
    }
    unit.handle(Event::Flush, &mut |tick| out.push(tick.clone()));
    unit.install(compile(&identity()), 1);
    // The first tick that goes out is a restart itself.
    (0..30).for_each(|k| drive::hand(&mut unit, &in_series(2, k), &mut out));
    let restarts = out.iter().map(|tick| tick.flags.contains(TickFlags::RESTART));
    assert!(restarts.eq((0..out.len()).map(|i| i == 0)));
    assert_eq!(out[0].missed, 60);
}

#[test]
fn i1_the_last_number_of_all_is_given_once() {
    let mut unit = drive::unit(&compile(&identity()));
    let mut out = Vec::new();
    for k in [0, 1, 2, 2, 2] {
        let tick = GyroTick { sequence: u64::MAX - 2 + k, ..gyro(k, &RATES) };
        drive::hand(&mut unit, &Owned::Accel(vec![accel(k, &RATES)]), &mut out);
        drive::hand(&mut unit, &Owned::Gyro(vec![tick]), &mut out);
        unit.handle(Event::Flush, &mut |tick| out.push(tick.clone()));
    }
    assert_eq!(out.len(), 3, "{out:?}");
    assert_eq!(unit.counters().gyro_duplicates, 2);
}

#[test]
fn a_tick_that_does_not_begin_where_the_last_one_ended_says_so() {
    // From the tenth tick on the clock is ahead, by ticks that nobody numbered; from the twentieth on it is back.
    let later = |k: u64| if (10..20).contains(&k) { k + 3 } else { k };
    let events = (0..30).flat_map(|k| {
        let time = gyro(later(k), &RATES).end_time;
        let (gyro, accel) = (gyro(k, &RATES), accel(k, &RATES));
        [
            Owned::Accel(vec![AccelTick { end_time: time, ..accel }]),
            Owned::Gyro(vec![GyroTick { end_time: time, ..gyro }]),
        ]
    });
    let mut unit = drive::unit(&compile(&identity()));
    let out = drive::run(&mut unit, &events.collect::<Vec<_>>());
    let stepped = out.iter().filter(|tick| tick.flags.contains(TickFlags::TIME_STEP));
    assert_eq!(stepped.map(|tick| tick.sequence).collect::<Vec<_>>(), [10]);
    assert!(out.iter().all(|tick| !tick.flags.contains(TickFlags::GAP) || tick.missed > 0));
}

#[test]
fn velocity_over_another_time_than_the_angle_is_not_to_be_trusted() {
    let lasting = |k: u64, percent: i64| {
        let tick = accel(k, &RATES);
        let duration = Span::from_ns(tick.duration.as_ns() / 100 * percent);
        [Owned::Accel(vec![AccelTick { duration, ..tick }]), Owned::Gyro(vec![gyro(k, &RATES)])]
    };
    for (percent, trusted) in [(50, false), (80, true), (100, true), (120, true), (200, false)] {
        let mut unit = drive::unit(&compile(&identity()));
        let out = drive::run(&mut unit, &(0..20).flat_map(|k| lasting(k, percent)).collect::<Vec<_>>());
        let is_trusted = |tick: &CorrectedTick| !tick.flags.contains(TickFlags::VELOCITY_INVALID);
        assert!(out.len() == 20 && out.iter().all(|tick| is_trusted(tick) == trusted), "{percent} %");
    }
}
