use isotherm_correction::navigation::NavigationStep;
use isotherm_correction::units::Span;

use super::*;

const S: Duration = Duration::from_secs(1);
const WINDOW: Span = Span::from_ms(50);
/// Ticks in a navigation step.
const STEP: u16 = 1;

/// Looks at a unit once a second; `seen` says what is seen of it, by the second.
fn watched(step_ticks: u16, seconds: u64, seen: impl Fn(u64) -> Seen) -> Vec<Kind> {
    let navigation = NavigationStep::new(step_ticks, false).unwrap();
    let mut watch =
        Watch::of(&UnitSettings { navigation, pairing_window: WINDOW, ..UnitSettings::default() });
    let start = Instant::now();
    (0..=seconds).for_each(|s| watch.see(start + S * u32::try_from(s).unwrap(), "U", seen(s)));
    let now = start + S * u32::try_from(seconds).unwrap();
    watch.reasons(now).into_iter().map(|reason| reason.kind).collect()
}

fn seen(came: u64, went: u64) -> Seen {
    Seen { came, went, alarms: 0, runs: true }
}

#[test]
fn a_unit_that_runs_or_pauses_is_healthy() {
    assert_eq!(watched(STEP, 60, |s| seen(200 * s, 200 * s)), []);
    assert_eq!(watched(STEP, 60, |s| seen(200 * s.min(20), 200 * s.min(20))), [], "nothing comes any more");
}

#[test]
fn a_unit_that_gives_nothing_out_while_ticks_come_is_not() {
    let stalls = |s: u64| seen(200 * s, 200 * s.min(20));
    assert_eq!(watched(STEP, 30, stalls), []);
    assert_eq!(watched(STEP, 31, stalls), [Kind::NoOutput]);
    let comes_back = |s: u64| seen(200 * s, 200 * if s < 40 { s.min(20) } else { s });
    assert_eq!(watched(STEP, 40, comes_back), []);
    let never_gave = |s: u64| seen(200 * s, 0);
    assert_eq!(watched(STEP, 60, never_gave), [Kind::NoOutput]);
    let ends = |s: u64| seen(200 * s.min(31), 200 * s.min(20));
    assert_eq!(watched(STEP, 50, ends), [], "nor do ticks come");
}

#[test]
fn what_is_held_back_on_purpose_is_no_stall() {
    let stands_by = |s: u64| Seen { runs: s < 20, ..seen(200 * s, 200 * s.min(20)) };
    assert_eq!(watched(STEP, 60, stands_by), []);
    let back = |s: u64| Seen { runs: s > 50, ..seen(200 * s, 0) };
    assert_eq!(watched(STEP, 55, back), [], "the time in standby does not count");
    assert_eq!(watched(STEP, 62, back), [Kind::NoOutput]);
    // A navigation step of 1000 ticks at 10 ticks a second.
    let steps = |s: u64| seen(10 * s, 10 * s / 1000 * 1000);
    assert_eq!(watched(1000, 99, steps), []);
    assert_eq!(watched(STEP, 99, steps), [Kind::NoOutput]);
}

#[test]
fn an_alarm_speaks_against_it_for_a_minute() {
    let alarm = |s: u64| Seen { alarms: u64::from(s >= 20), ..seen(200 * s, 200 * s) };
    assert_eq!(watched(STEP, 19, alarm), []);
    assert_eq!(watched(STEP, 20, alarm), [Kind::Alarm]);
    assert_eq!(watched(STEP, 79, alarm), [Kind::Alarm]);
    assert_eq!(watched(STEP, 80, alarm), []);
    let before_the_first_look = |s: u64| Seen { alarms: 1, ..seen(200 * s, 200 * s) };
    assert_eq!(watched(STEP, 5, before_the_first_look), [Kind::Alarm]);
}
