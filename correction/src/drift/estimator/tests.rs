use alloc::vec::Vec;

use super::super::{DriftParts, SUBTRACTION_RAMP};
use super::*;
use crate::observation::GyroSeen;
use crate::sample::TickFlags;

const SECOND: Span = Span::from_ms(1_000);
const TICK: Span = Span::from_ms(50);
const PARTS: DriftParts = DriftParts {
    sigma_rad_per_s: 2e-8,
    correlation_time_s: 28_800.0,
    trend_sigma_rad_per_s2: 4e-13,
    trend_correlation_time_s: 180_000.0,
    initial_sigma_rad_per_s: 2e-6,
    angle_random_walk_rad_per_sqrt_s: 1.5e-7,
};
/// Drift of the three gyros of the tests (rad/s).
const DRIFT: [f64; 3] = [1e-6, -5e-7, 2e-6];
/// Rate of the case in the tests (rad/s).
const EARTH: [f64; 3] = [4.2e-5, 1e-6, -6e-5];

fn at_s(s: f64) -> Timestamp {
    Timestamp::default() + Span::from_s(s)
}

fn reference(start_s: f64, end_s: f64) -> Reference {
    Reference { start: at_s(start_s), end: at_s(end_s), angular_rate: EARTH, sigma: 0.0 }
}

/// Input axes along the case axes.
fn plain(rate: [f64; 3]) -> Sensors<f64> {
    rate.into_iter().collect()
}

fn estimator(subtract: bool) -> DriftEstimator {
    let model = Some(DriftModel::new(&PARTS).unwrap());
    DriftEstimator::new(&[model; 3], DriftSettings { delay: SECOND, subtract })
}

fn estimate(estimator: &DriftEstimator, gyro: usize) -> Option<DriftEstimate> {
    estimator.estimates().nth(gyro).flatten()
}

/// A bench that feeds ticks and keeps what was subtracted.
struct Bench {
    estimator: DriftEstimator,
    end: Timestamp,
    subtracted: Vec<[f64; 3]>,
}

impl Bench {
    fn new(subtract: bool) -> Self {
        Self { estimator: estimator(subtract), end: at_s(0.0), subtracted: Vec::new() }
    }

    fn tick(&mut self) {
        self.tick_with(|_| {});
    }

    fn tick_with(&mut self, change: impl Fn(&mut Observation)) {
        self.end = self.end + TICK;
        let gyro = |i: usize| GyroSeen {
            rate: EARTH[i] + DRIFT[i] + 3e-5,
            bias: 3e-5,
            flags: SensorFlags::VALID,
            ..GyroSeen::default()
        };
        let mut observation = Observation {
            end_time: self.end,
            duration: TICK,
            settled: true,
            gyros: [0, 1, 2].map(gyro).into_iter().collect(),
            ..Observation::default()
        };
        change(&mut observation);
        let restart = observation.flags.contains(TickFlags::RESTART);
        self.end = observation.end_time;
        self.estimator.advance(self.end, restart, &plain);
        let subtracted = [0, 1, 2].map(|i| self.estimator.subtrahend(i, self.end));
        observation.gyros.drift[..3].copy_from_slice(&subtracted);
        self.estimator.observe(&observation);
        self.subtracted.push(subtracted);
    }

    fn run_to(&mut self, s: f64) {
        while self.end + TICK <= at_s(s) {
            self.tick();
        }
    }

    fn updates(&self, gyro: usize) -> u64 {
        estimate(&self.estimator, gyro).unwrap().updates
    }
}

#[test]
fn a_reference_tells_the_drift_of_each_gyro() {
    let mut bench = Bench::new(false);
    bench.estimator.submit(&reference(0.0, 60.0)).unwrap();
    bench.run_to(62.0);
    for (gyro, drift) in DRIFT.into_iter().enumerate() {
        let estimate = estimate(&bench.estimator, gyro).unwrap();
        assert!((estimate.rate / drift - 1.0).abs() < 1e-3, "{estimate:?}");
        assert!(estimate.sigma < 4e-8 && estimate.updates == 1);
        assert_eq!(estimate.last_update, Some(at_s(60.0)));
    }
    assert_eq!(estimate(&bench.estimator, 3), None);
    assert!(bench.subtracted.iter().flatten().all(|drift| *drift == 0.0), "nobody asked for it");
}

#[test]
fn what_is_subtracted_is_not_measured_away() {
    let [with, without] = [true, false].map(|subtract| {
        let mut bench = Bench::new(subtract);
        for k in 0..10 {
            let start = 60.0 * f64::from(k);
            bench.estimator.submit(&reference(start, start + 60.0)).unwrap();
        }
        bench.run_to(640.0);
        estimate(&bench.estimator, 0).unwrap()
    });
    assert_eq!(with.updates, 10);
    assert!((with.rate - without.rate).abs() < 1e-15, "{with:?} {without:?}");
}

#[test]
fn it_is_felt_by_the_first_tick_after_its_delay_and_no_earlier() {
    let mut bench = Bench::new(true);
    bench.estimator.submit(&reference(0.0, 60.0)).unwrap();
    bench.run_to(61.0);
    assert_eq!((bench.updates(0), bench.estimator.waiting.references.len()), (0, 1));
    bench.tick();
    assert_eq!((bench.updates(0), bench.estimator.waiting.references.len()), (1, 0));
    // A span that ends inside a cell waits for the cell's end where the delay is shorter.
    let mut quick = Bench::new(true);
    quick.estimator.settings.delay = Span::ZERO;
    quick.estimator.submit(&reference(0.0, 60.1)).unwrap();
    quick.run_to(60.25);
    assert_eq!(quick.updates(0), 0);
    quick.tick();
    assert_eq!(quick.updates(0), 1);
}

#[test]
fn when_it_arrived_changes_no_bit_as_long_as_it_came_in_time() {
    let all: Vec<_> = [0.0, 60.0, 121.3, 170.0, 230.0].map(|s| reference(s, s + 48.7)).into();
    let run = |arrivals: &[(f64, Reference)]| {
        let mut bench = Bench::new(true);
        let mut arrivals = arrivals.iter().peekable();
        while bench.end < at_s(300.0) {
            while let Some((_, reference)) = arrivals.next_if(|(s, _)| at_s(*s) <= bench.end) {
                bench.estimator.submit(reference).unwrap();
            }
            bench.tick();
        }
        (bench.subtracted, *bench.estimator.counters())
    };
    let at_once: Vec<_> = all.iter().rev().map(|r| (0.0, *r)).collect();
    let at_their_end: Vec<_> = all.iter().map(|r| (r.end.seconds_from(at_s(0.0)), *r)).collect();
    let at_the_last_moment: Vec<_> = all.iter().map(|r| (r.end.seconds_from(at_s(0.0)) + 0.99, *r)).collect();
    let expected = run(&at_once);
    assert_eq!(expected.1.used, 5);
    assert!(run(&at_their_end) == expected && run(&at_the_last_moment) == expected);
    let late: Vec<_> = all.iter().map(|r| (r.end.seconds_from(at_s(0.0)) + 3.0, *r)).collect();
    let (_, counters) = run(&late);
    assert_eq!((counters.used, counters.late), (5, 5));
}

#[test]
fn nothing_that_is_subtracted_ever_steps() {
    let mut bench = Bench::new(true);
    // One reference after the other, shorter than the ramp, each with another mean.
    for k in 0..30 {
        let start = 5.0 * f64::from(k);
        let mut wandering = reference(start, start + 5.0);
        wandering.angular_rate[0] += 1e-7 * f64::from(k % 7);
        bench.run_to(start);
        bench.estimator.submit(&wandering).unwrap();
    }
    bench.run_to(200.0);
    assert!(bench.updates(0) == 30 && bench.subtracted[199 * 20][0] > 5e-7);
    let largest = bench.subtracted.windows(2).map(|pair| (pair[1][0] - pair[0][0]).abs()).fold(0.0, f64::max);
    // The whole drift within the ramp, at most twice as fast where one ramp meets the next.
    let fastest = 2.0 * DRIFT[0] * TICK.as_s() / SUBTRACTION_RAMP.as_s();
    assert!(largest > 0.0 && largest < fastest, "{largest}");
}

#[test]
fn the_prediction_moves_on_straight_lines_from_second_to_second() {
    let mut bench = Bench::new(true);
    for k in 0..8 {
        let mut trending = reference(60.0 * f64::from(k), 60.0 * f64::from(k) + 60.0);
        trending.angular_rate[0] -= 1e-7 * f64::from(k);
        bench.estimator.submit(&trending).unwrap();
    }
    bench.run_to(510.0);
    let tail: Vec<f64> = bench.subtracted.iter().skip(20 * 500).map(|drift| drift[0]).collect();
    let slopes: Vec<f64> = tail.windows(2).map(|pair| pair[1] - pair[0]).collect();
    assert!(slopes.iter().all(|slope| *slope != 0.0), "no staircase");
    // Within a second all slopes are one; from second to second they hardly change.
    let (least, most) = slopes.iter().fold((f64::MAX, f64::MIN), |(a, b), s| (a.min(*s), b.max(*s)));
    assert!((most / least - 1.0).abs() < 1e-3, "{least} {most}");
}

#[test]
fn readings_that_say_nothing_take_no_part() {
    let mut bench = Bench::new(false);
    bench.estimator.submit(&reference(0.0, 60.0)).unwrap();
    for k in 0..1240_u32 {
        bench.tick_with(|observation| {
            // A mode switch now and then, one reading beyond its limit, one that is no number, a gyro that is excluded.
            if k % 300 == 0 {
                observation.settled = false;
                observation.gyros.rate = [5.0; 8];
            }
            if k == 700 {
                observation.gyros.flags[0] = SensorFlags::OVERRANGE;
                observation.gyros.rate[0] = 1e3;
            }
            if k == 701 {
                observation.gyros.rate[0] = f64::NAN;
            }
            observation.gyros.flags[2] = SensorFlags::EXCLUDED;
        });
    }
    let estimate = estimate(&bench.estimator, 0).unwrap();
    assert!((estimate.rate / DRIFT[0] - 1.0).abs() < 1e-3, "{estimate:?}");
    assert_eq!([0, 1, 2].map(|gyro| bench.updates(gyro)), [1, 1, 0]);
    assert_eq!(bench.estimator.counters().used, 1);
}

#[test]
fn a_gap_an_overlap_and_what_is_too_old_are_refused_and_counted() {
    let mut bench = Bench::new(false);
    bench.run_to(30.0);
    bench.end = at_s(40.0);
    bench.run_to(130.0);
    let submit =
        |bench: &mut Bench, start_s, end_s| bench.estimator.submit(&reference(start_s, end_s)).unwrap();
    submit(&mut bench, 10.0, 70.0);
    submit(&mut bench, 60.0, 120.0);
    submit(&mut bench, 90.0, 121.0);
    bench.run_to(131.0);
    let counters = *bench.estimator.counters();
    assert_eq!((counters.gap, counters.used, counters.overlap), (1, 1, 1));
    bench.run_to(300.0);
    submit(&mut bench, 121.0, 175.0);
    bench.run_to(302.0);
    assert_eq!(bench.estimator.counters().too_old, 1);
    assert!(bench.estimator.submit(&reference(1.0, 1.5)).is_err());
    let counters = *bench.estimator.counters();
    assert_eq!((counters.received, counters.late, counters.too_short), (5, 4, 1));
}

#[test]
fn a_restart_forgets_the_readings_and_keeps_the_estimate() {
    for back in [false, true] {
        let mut bench = Bench::new(true);
        bench.run_to(1000.0);
        bench.estimator.submit(&reference(900.0, 960.0)).unwrap();
        bench.estimator.submit(&reference(960.0, 1020.0)).unwrap();
        bench.run_to(1015.0);
        let before = estimate(&bench.estimator, 0).unwrap();
        let subtracted = bench.estimator.subtrahend(0, bench.end);
        let restart = if back { at_s(10.0) } else { at_s(1016.0) };
        bench.tick_with(|observation| {
            observation.end_time = restart;
            observation.flags |= TickFlags::RESTART;
        });
        let after = estimate(&bench.estimator, 0).unwrap();
        assert!((bench.estimator.subtrahend(0, bench.end) - subtracted).abs() < 1e-12);
        assert_eq!(after.updates, 1);
        let grown = after.sigma / before.sigma;
        if back {
            // The Markov part is forgotten: a hundredth of what was found.
            assert!((after.rate / before.rate - 1.0).abs() < 1e-3 && grown > 10.0, "{after:?}");
            assert_eq!((after.last_update, bench.estimator.waiting.references.len()), (None, 1));
        } else {
            assert!((after.rate / before.rate - 1.0).abs() < 1e-6 && grown < 1.01, "{after:?}");
            assert_eq!(
                (after.last_update, bench.estimator.waiting.references.len()),
                (before.last_update, 1)
            );
        }
        // The span over the restart has no readings; after it references count again.
        let start_s = restart.seconds_from(at_s(0.0)) + 10.0;
        bench.estimator.submit(&reference(start_s, start_s + 30.0)).unwrap();
        bench.run_to(start_s + 32.0);
        assert_eq!(bench.updates(0), 2, "back: {back}");
        assert_eq!(bench.estimator.counters().gap, u64::from(!back));
    }
}

#[test]
fn a_swap_keeps_the_gyros_whose_biases_it_leaves() {
    let mut bench = Bench::new(true);
    bench.estimator.submit(&reference(0.0, 60.0)).unwrap();
    bench.run_to(80.0);
    let before = bench.estimator.clone();
    let mut models = [Some(DriftModel::new(&PARTS).unwrap()); 3];
    models[2] = Some(DriftModel::new(&DriftParts { sigma_rad_per_s: 3e-8, ..PARTS }).unwrap());
    let mut swapped = DriftEstimator::new(&models, before.settings);
    swapped.carry(before.clone(), |gyro| gyro != 1);
    assert_eq!(estimate(&swapped, 0), estimate(&before, 0));
    assert_eq!([1, 2].map(|gyro| estimate(&swapped, gyro).unwrap().updates), [0, 0]);
    assert_eq!(swapped.counters(), before.counters());
    bench.estimator = swapped;
    bench.run_to(160.0);
    bench.estimator.submit(&reference(90.0, 150.0)).unwrap();
    bench.tick();
    assert_eq!([0, 1, 2].map(|gyro| bench.updates(gyro)), [2, 1, 1]);
}

#[test]
fn a_unit_without_stated_drift_has_nothing_to_feed() {
    let mut idle = DriftEstimator::new(&[None; 3], DriftSettings { delay: SECOND, subtract: true });
    assert!(idle.is_idle() && idle.gyros.capacity() == 0);
    assert_eq!(idle.submit(&reference(0.0, 60.0)), Err(ReferenceRefusal::NoDrift));
    idle.advance(at_s(1.0), false, &|_| unreachable!("there is nothing to project"));
    assert!(idle.subtrahend(0, at_s(1.0)) == 0.0 && idle.estimates().next().is_none());
    // One gyro alone may state one.
    let one = DriftEstimator::new(&[None, Some(DriftModel::new(&PARTS).unwrap())], idle.settings);
    assert!(!one.is_idle() && estimate(&one, 0).is_none() && estimate(&one, 1).is_some());
}
