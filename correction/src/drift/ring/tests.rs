use super::*;

const TICK: Span = Span::from_ms(5);

fn at(seconds: f64) -> Timestamp {
    Timestamp::default() + Span::from_s(seconds)
}

fn span(start_s: f64, end_s: f64) -> Reference {
    Reference { start: at(start_s), end: at(end_s), angular_rate: [0.0; 3], sigma: 0.0 }
}

/// A ring fed with ticks from `from_s` to `to_s`; `rate` gives each its mean rate by its middle, `None` loses it.
fn fed(from_s: f64, to_s: f64, tick: Span, rate: impl Fn(f64) -> Option<f64>) -> Ring {
    let mut ring = Ring::new();
    let mut end = at(from_s) + tick;
    while end <= at(to_s) {
        let start = end - tick;
        let covered = Covered::new(start, end);
        ring.take(&covered, rate(0.5 * (start.seconds_from(at(0.0)) + end.seconds_from(at(0.0)))));
        end = end + tick;
    }
    ring
}

#[test]
fn a_constant_rate_is_its_own_mean_over_any_span() {
    let ring = fed(0.0, 130.0, TICK, |_| Some(3e-5));
    for (start_s, end_s) in [(10.0, 70.0), (10.1, 11.17), (3.0, 123.0), (60.003, 70.999)] {
        let mean = ring.mean(&span(start_s, end_s)).unwrap();
        assert!((mean.rate / 3e-5 - 1.0).abs() < 1e-12, "{start_s}…{end_s}: {mean:?}");
        assert!(mean.variance < 1e-24, "{mean:?}");
    }
}

#[test]
fn ticks_longer_than_a_cell_are_shared_out() {
    let ring = fed(0.0, 130.0, Span::from_ms(700), |t| Some(1e-3 * t));
    // Whole ticks, so that the mean of a straight line is its middle: 7 s to 56 s.
    let mean = ring.mean(&span(7.0, 56.0)).unwrap();
    assert!((mean.rate - 31.5e-3).abs() < 1e-12, "{mean:?}");
}

#[test]
fn an_end_inside_a_cell_errs_by_no_more_than_it_says() {
    // 10 °/s²: hard manoeuvring.
    let slope = 0.17;
    let ring = fed(0.0, 60.0, TICK, |t| Some(slope * t));
    for offset in [0.0, 0.05, 0.125, 0.2] {
        let (start_s, end_s) = (10.0 + offset, 14.0 + 0.7 * offset);
        let mean = ring.mean(&span(start_s, end_s)).unwrap();
        let error = mean.rate - slope * 0.5 * (start_s + end_s);
        let stated = libm::sqrt(mean.variance);
        // The ticks' own staircase adds a thousandth.
        assert!(error.abs() <= 1.5 * stated + 1e-3 * slope * TICK.as_s(), "{offset}: {error} of {stated}");
        assert!(stated < slope * CELL.as_s() * CELL.as_s() / 8.0, "{stated}");
    }
}

#[test]
fn time_before_the_ring_is_refused_and_forgotten_cells_do_not_come_back() {
    let ring = fed(0.0, 300.0, TICK, |t| Some(if t < 172.0 { 1.0 } else { 0.0 }));
    assert_eq!(ring.mean(&span(171.9, 240.0)), Err(ReferenceRefusal::TooOld));
    assert!(ring.mean(&span(172.25, 292.0)).unwrap().rate.abs() < 1e-15);
    let late = fed(100.0, 200.0, TICK, |_| Some(0.0));
    assert_eq!(late.mean(&span(90.0, 110.0)), Err(ReferenceRefusal::Gap));
    assert_eq!(Ring::new().mean(&span(0.0, 60.0)), Err(ReferenceRefusal::TooOld));
}

#[test]
fn a_few_lost_ticks_are_bridged_and_a_gap_is_refused() {
    // A mode switch each minute costs three ticks.
    let switched = |t: f64| (!(30.0..30.015).contains(&t)).then_some(2e-5);
    let mean = fed(0.0, 61.0, TICK, switched).mean(&span(0.0, 60.0)).unwrap();
    assert!((mean.rate / 2e-5 - 1.0).abs() < 1e-12, "{mean:?}");
    let gone = |gap_s: f64| move |t: f64| (!(30.0..30.0 + gap_s).contains(&t)).then_some(2e-5);
    assert!(fed(0.0, 61.0, TICK, gone(1.1)).mean(&span(0.0, 60.0)).is_ok());
    assert_eq!(fed(0.0, 61.0, TICK, gone(1.3)).mean(&span(0.0, 60.0)), Err(ReferenceRefusal::Gap));
}

#[test]
fn what_was_bridged_in_motion_costs_the_weight_of_the_measurement() {
    // Swinging at 0.2 Hz with 5 °/s while one second is lost at its crest.
    let swing = |t: f64| 0.087 * libm::cos(core::f64::consts::TAU * 0.2 * t);
    let lost = |t: f64| (!(29.5..30.5).contains(&t)).then(|| swing(t));
    let whole = fed(0.0, 61.0, TICK, |t| Some(swing(t))).mean(&span(0.0, 60.0)).unwrap();
    let bridged = fed(0.0, 61.0, TICK, lost).mean(&span(0.0, 60.0)).unwrap();
    let error = bridged.rate - whole.rate;
    assert!(error.abs() > 1e-4, "the case is hard: {error}");
    assert!(error.abs() < 2.0 * libm::sqrt(bridged.variance), "{error} of {}", libm::sqrt(bridged.variance));
    assert!(whole.variance < 1e-12, "{whole:?}");
}

#[test]
fn a_clock_that_counts_durations_differently_changes_no_rate() {
    let mut ring = Ring::new();
    for k in 1..=13_000_i64 {
        // Ends every 5 ms, durations half a per cent short.
        let end = Timestamp::from_ns(k * 5_000_000);
        let covered = Covered::new(end - Span::from_ns(4_975_000), end);
        ring.take(&covered, Some(7e-5));
    }
    let mean = ring.mean(&span(1.0, 61.0)).unwrap();
    assert!((mean.rate / 7e-5 - 1.0).abs() < 1e-12, "{mean:?}");
}

#[test]
fn times_at_the_ends_of_the_clock_are_survived() {
    let mut ring = Ring::new();
    for ns in [i64::MIN, i64::MIN + 1, -1, 0, 1, i64::MAX - 1, i64::MAX] {
        let end = Timestamp::from_ns(ns);
        let covered = Covered::new(end - TICK, end);
        ring.take(&covered, Some(1.0));
        ring.mean(&Reference { start: end - Span::from_ms(1000), end, angular_rate: [0.0; 3], sigma: 0.0 })
            .ok();
        cell_end(end);
    }
}
