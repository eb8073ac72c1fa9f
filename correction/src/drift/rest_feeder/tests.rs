use alloc::vec::Vec;

use super::*;

const TICK: Span = Span::from_ms(50);

fn at_s(s: i64) -> Timestamp {
    Timestamp::from_ns(s * 1_000_000_000)
}

/// Span of the reference that a tick completes.
fn observe(feeder: &mut RestFeeder, end: Timestamp, tick: Span, at_rest: bool) -> Option<[Timestamp; 2]> {
    let reference = feeder.reference((end, tick), at_rest, || Some(([0.0; 3], 0.0)));
    reference.map(|reference| [reference.start, reference.end])
}

/// Spans given from `from` on, tick by tick; `at_rest` gives `None` for a tick that is missing.
fn given(from: Timestamp, ticks: u32, at_rest: impl Fn(f64) -> Option<bool>) -> Vec<(i64, i64)> {
    let mut feeder = RestFeeder::default();
    let mut end = from;
    let mut spans = Vec::new();
    for _ in 0..ticks {
        end = end + TICK;
        let Some(at_rest) = at_rest(end.seconds_from(at_s(0))) else { continue };
        let span = observe(&mut feeder, end, TICK, at_rest);
        spans.extend(span.map(|[start, end]| (start.as_ns() / 1_000_000_000, end.as_ns() / 1_000_000_000)));
    }
    spans
}

#[test]
fn whole_minutes_at_rest_are_given_once_the_next_one_has_confirmed_them() {
    let spans = given(at_s(10), 20 * 300, |_| Some(true));
    assert_eq!(spans, [(60, 120), (120, 180), (180, 240)]);
    // From the first tick on a minute, it counts.
    assert_eq!(given(at_s(60), 20 * 120, |_| Some(true)), [(60, 120)]);
}

#[test]
fn motion_takes_the_minute_before_it_back() {
    // A nudge at 185 s: the minute from 120 s to 180 s has nobody to confirm it.
    let spans = given(at_s(0), 20 * 420, |t| Some(!(185.0..190.0).contains(&t)));
    assert_eq!(spans, [(0, 60), (60, 120), (240, 300), (300, 360)]);
}

#[test]
fn a_unit_that_was_not_seen_may_have_moved() {
    let spans = given(at_s(0), 20 * 360, |t| (!(100.0..102.0).contains(&t)).then_some(true));
    assert_eq!(spans, [(120, 180), (180, 240), (240, 300)]);
    let short = given(at_s(0), 20 * 180, |t| (!(100.0..100.5).contains(&t)).then_some(true));
    assert_eq!(short, [(0, 60), (60, 120)]);
}

#[test]
fn a_clock_that_steps_back_starts_the_rest_anew() {
    let mut feeder = RestFeeder::default();
    assert_eq!(observe(&mut feeder, at_s(1000), TICK, true), None);
    for s in 0..120 {
        assert_eq!(observe(&mut feeder, at_s(s), Span::from_ms(1000), true), None);
    }
    assert_eq!(observe(&mut feeder, at_s(120), Span::from_ms(1000), true), Some([at_s(0), at_s(60)]));
}

#[test]
fn without_the_rate_of_the_earth_there_is_no_reference() {
    let mut feeder = RestFeeder::default();
    let second = Span::from_ms(1000);
    let mut asked = 0;
    let mut made = 0;
    for s in 1..=240 {
        let known = s > 150;
        let reference = feeder.reference((at_s(s), second), true, || {
            asked += 1;
            known.then_some(([7e-5, 0.0, 0.0], 1e-9))
        });
        made += u32::from(reference.is_some_and(|r| r.end.since(r.start) == REST_SPAN && r.sigma > 0.0));
    }
    assert_eq!((asked, made), (3, 2));
}
