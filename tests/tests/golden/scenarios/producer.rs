//! Producers that restart, clocks that step, ticks that are lost, doubled, late or of the wrong kind.

use isotherm_correction::sample::OutputKind;
use isotherm_correction::unit::UnitSettings;
use isotherm_correction::units::Span;
use isotherm_protocol::journal::JournalEvent;
use isotherm_tests::calibrations::compile;
use isotherm_tests::script::{Accels, Scenario, Script, Step};

use crate::plain::{RICH_CHANNELS, rich_parts, rich_script, told, without_accels};

pub(crate) fn producer_restarts() -> Scenario {
    let mut script = rich_script(71);
    (script.batch, script.switches) = (4, 90);
    script.ticks(120);
    script.restart();
    script.ticks(120);
    // Its run goes on where it was.
    script.series += 1;
    script.ticks(120);
    // Ticks of the run before come in between.
    let (next, now_ns) = (script.next, script.now_ns);
    script.restart();
    script.ticks(20);
    let of_before = script.steps.len();
    (script.series, script.next, script.now_ns) = (script.series - 1, next, now_ns);
    script.ticks(12);
    let stray = script.steps.split_off(of_before);
    script.series += 1;
    script.restart();
    script.ticks(40);
    script.steps.extend(stray);
    script.ticks(60);
    script.event(JournalEvent::Flushed);
    script.restart();
    script.batch = 1;
    script.ticks(3);
    script.restart();
    script.ticks(3);
    told(script)
}

/// The run before goes on for so long that it is believed again.
pub(crate) fn producer_of_before_takes_over_again() -> Scenario {
    let mut script = rich_script(72);
    script.batch = 2;
    script.ticks(60);
    script.series += 1;
    script.ticks(4);
    script.series -= 1;
    script.ticks(700);
    told(script)
}

/// No new run, and yet the sequence begins anew, or leaps.
pub(crate) fn sequence_numbers_reset() -> Scenario {
    let mut script = rich_script(73);
    script.batch = 2;
    for next in [5, 500_000, 900, 0, u64::MAX - 60] {
        script.ticks(80);
        script.next = next;
    }
    script.ticks(60);
    script.next = 400;
    script.now_ns -= 20_000_000_000;
    script.ticks(600);
    told(script)
}

pub(crate) fn clock_steps() -> Scenario {
    let mut script = rich_script(74);
    script.batch = 2;
    for step_ns in
        [1_000_000, -1_000_000, 300_000_000_000, -300_000_000_000, 7_200_000_000_000, -7_200_000_000_000]
    {
        script.ticks(80);
        script.now_ns += step_ns;
    }
    script.ticks(700);
    told(script)
}

pub(crate) fn gaps_short_and_long() -> Scenario {
    let mut script = rich_script(75);
    (script.batch, script.switches) = (3, 77);
    for ticks in [1, 2, 9, 10, 11, 100, 127, 128, 129, 1_000_000, 3] {
        script.ticks(45);
        script.gap(ticks);
    }
    script.ticks(45);
    script.batch = 32;
    script.gap(40);
    script.ticks(96);
    told(script)
}

pub(crate) fn ticks_doubled_late_and_swapped() -> Scenario {
    let mut script = rich_script(76);
    (script.batch, script.switches) = (2, 61);
    script.ticks(60);
    for reach in [2, 3, 6, 12, 30] {
        let from = script.steps.len();
        script.ticks(80);
        script.shuffle(from, reach);
    }
    let from = script.steps.len();
    script.ticks(80);
    let frames = script.steps[from..].iter().filter(|step| matches!(step, Step::Frame(..)));
    let again: Vec<_> = frames.cloned().collect();
    script.steps.extend(again);
    script.mishaps = 6;
    script.ticks(400);
    told(script)
}

pub(crate) fn bad_durations() -> Scenario {
    let mut script = rich_script(77);
    script.batch = 2;
    let odd_ns =
        [0, 10_000_000_000, 10_000_000_001, 1, 2_500_000, 9_999_999, 20_000_000, i64::MAX, 5_000_001];
    let ticks = (1020..).step_by(15).zip(odd_ns);
    script.durations = ticks.map(|(tick, ns)| (tick, Span::from_ns(ns))).collect();
    script.ticks(200);
    told(script)
}

pub(crate) fn wrong_sensors_and_wrong_outputs() -> Scenario {
    let mut script = rich_script(78);
    script.batch = 2;
    for (output, sensors) in [
        (OutputKind::Mean, 4),
        (OutputKind::Mean, 2),
        (OutputKind::Counts, 3),
        (OutputKind::Counts, 8),
        (OutputKind::Mean, 0),
        (OutputKind::Mean, 3),
    ] {
        script.ticks(30);
        script.foreign(output, sensors);
    }
    script.ticks(40);
    told(script)
}

/// More ticks wait than are kept: first gyro ticks without accelerometers, then accelerometer ticks alone.
pub(crate) fn ticks_that_wait_too_many() -> Scenario {
    let mut script = rich_script(79);
    script.batch = 100;
    script.accels = Accels::Lost(100);
    script.ticks(8300);
    let settings = UnitSettings { pairing_window: Span::from_ms(200_000), ..UnitSettings::default() };
    script.scenario("", settings, Vec::new())
}

/// The last ticks go out by the clock; what comes later is late.
pub(crate) fn flushed_tails() -> Scenario {
    let mut script = rich_script(80);
    script.batch = 3;
    for lost in [0, 1, 5] {
        script.ticks(33);
        script.gap(lost);
        script.accels = Accels::Lost(100);
        script.ticks(6);
        script.accels = Accels::Before;
        script.event(JournalEvent::Flushed);
    }
    let from = script.steps.len();
    script.ticks(12);
    let late = script.steps.split_off(from);
    script.ticks(12);
    script.event(JournalEvent::Flushed);
    script.steps.extend(late);
    script.ticks(30);
    told(script)
}

/// Messages of other lengths, some of them without accelerometers to go with.
pub(crate) fn messages_of_other_lengths() -> Scenario {
    let mut script = rich_script(81);
    (script.switches, script.meander) = (75, 40);
    for batch in [1, 3, 8, 32, 100] {
        script.batch = batch;
        script.ticks(3 * batch.max(20));
    }
    told(script)
}

pub(crate) fn unit_without_accelerometers() -> Scenario {
    let calibration = compile(&without_accels(rich_parts(0.0)));
    let mut script = Script::new(82, &calibration, &RICH_CHANNELS);
    (script.switches, script.mishaps, script.batch) = (70, 2, 3);
    script.ticks(600);
    script.foreign(OutputKind::Mean, 3);
    script.ticks(60);
    told(script)
}
