//! Navigation steps, units without a calibration, and times at the ends of what can be counted.

use isotherm_correction::navigation::NavigationStep;
use isotherm_correction::unit::{At, Uncalibrated, UnitSettings};
use isotherm_correction::units::Span;
use isotherm_protocol::journal::JournalEvent;
use isotherm_tests::lives::{FULL_CHANNELS, full, skewed};
use isotherm_tests::script::{Accels, Scenario, Script};

use crate::plain::{rich, rich_script, told};

fn steps(seed: u64, ticks: u16, coning_sculling: bool, swing: f64) -> Scenario {
    let mut script = rich_script(seed);
    (script.batch, script.swing, script.switches) = (3, swing, 85);
    script.ticks(250);
    script.gap(4);
    script.ticks(100);
    script.give(rich(0.4), At::NextTick, Span::ZERO);
    script.ticks(100);
    script.event(JournalEvent::Flushed);
    script.ticks(50);
    script.restart();
    script.ticks(100);
    let navigation = NavigationStep::new(ticks, coning_sculling).unwrap();
    script.scenario("", UnitSettings { navigation, ..UnitSettings::default() }, Vec::new())
}

pub(crate) fn navigation_steps_with_coning_and_sculling() -> Scenario {
    steps(121, 4, true, 2000.0)
}

/// Turns of more than a tenth of a radian in a step.
pub(crate) fn navigation_steps_of_large_turns() -> Scenario {
    steps(122, 20, true, 60_000.0)
}

pub(crate) fn navigation_steps_as_plain_sums() -> Scenario {
    steps(123, 5, false, 2000.0)
}

pub(crate) fn navigation_steps_of_one_tick_with_coning_and_sculling() -> Scenario {
    steps(124, 1, true, 2000.0)
}

/// A step over ticks of which some have more sensors than others, and one that is excluded.
pub(crate) fn navigation_steps_of_skewed_sensors() -> Scenario {
    let mut script = Script::new(125, &skewed(0.0), &[("t", 24.0)]);
    (script.batch, script.fails, script.mishaps) = (2, Some((4, 1200)), 2);
    script.ticks(500);
    let navigation = NavigationStep::new(9, true).unwrap();
    script.scenario("", UnitSettings { navigation, ..UnitSettings::default() }, Vec::new())
}

fn uncalibrated(seed: u64, settings: UnitSettings) -> Scenario {
    let mut script = Script::new(seed, &full(), &FULL_CHANNELS);
    script.steps.clear();
    (script.switches, script.batch, script.mishaps) = (60, 3, 1);
    script.ticks(150);
    script.restart();
    script.ticks(60);
    script.give_later(&full(), 40, Span::from_ms(100));
    script.ticks(150);
    script.scenario("", settings, Vec::new())
}

pub(crate) fn uncalibrated_passed_through() -> Scenario {
    uncalibrated(126, UnitSettings { uncalibrated: Uncalibrated::PassThrough, ..UnitSettings::default() })
}

pub(crate) fn uncalibrated_held() -> Scenario {
    uncalibrated(127, UnitSettings { uncalibrated: Uncalibrated::Hold, ..UnitSettings::default() })
}

pub(crate) fn uncalibrated_in_navigation_steps() -> Scenario {
    let navigation = NavigationStep::new(6, true).unwrap();
    uncalibrated(128, UnitSettings { navigation, ..UnitSettings::default() })
}

/// A life that begins at a time, is put off its clock, and begins there again.
fn from_time(seed: u64, now_ns: i64) -> Scenario {
    let mut script = rich_script(seed);
    (script.batch, script.switches, script.now_ns) = (2, 50, now_ns);
    script.ticks(130);
    script.reference();
    script.accels = Accels::Lost(50);
    script.ticks(30);
    script.accels = Accels::Before;
    script.give(rich(0.2), At::NextTick, Span::from_ms(200));
    script.ticks(60);
    (script.next, script.now_ns, script.series) = (10, now_ns, script.series + 1);
    script.ticks(60);
    script.event(JournalEvent::Flushed);
    told(script)
}

pub(crate) fn times_from_zero_on() -> Scenario {
    from_time(131, 0)
}

pub(crate) fn times_before_zero() -> Scenario {
    from_time(132, -400_000_000)
}

pub(crate) fn times_near_the_last_one() -> Scenario {
    from_time(133, i64::MAX - 600_000_000)
}

pub(crate) fn times_near_the_first_one() -> Scenario {
    from_time(134, i64::MIN)
}

/// Where doubles of nanoseconds leave what an i64 holds.
pub(crate) fn times_about_half_of_the_last_one() -> Scenario {
    from_time(135, (1 << 62) - 300_000_000)
}

/// From one end of time to the other, in a producer's restarts.
pub(crate) fn times_from_one_end_to_the_other() -> Scenario {
    let mut script = rich_script(136);
    script.batch = 2;
    for now_ns in [i64::MIN, i64::MAX - 150_000_000, 0, -(1 << 62), (1 << 62) + 1, i64::MIN + 7, 1 << 53] {
        (script.next, script.now_ns, script.series) = (5, now_ns, script.series + 1);
        script.ticks(50);
        script.reference_of(-200_000_000..-100_000_000, [1e-6, -1e-6, 0.0], 1e-6);
        script.temperature("t", 25.0, i64::MAX);
    }
    told(script)
}
