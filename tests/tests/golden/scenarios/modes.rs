//! Mode switches and what follows them.

use isotherm_correction::reversal::{FitWindow, ReversalParts, Transition};
use isotherm_correction::sample::OutputKind;
use isotherm_correction::servo::{ServoForm, ServoParts};
use isotherm_correction::unit::At;
use isotherm_correction::units::Span;
use isotherm_tests::calibrations::{compile, polynomial};
use isotherm_tests::lives::{FULL_CHANNELS, full};
use isotherm_tests::script::{Scenario, Script};

use crate::plain::{RICH_CHANNELS, rich_parts, rich_script, told, with_outputs};

/// A life with modes, which no clock switches.
fn with_modes(mut script: Script, commands: impl IntoIterator<Item = u64>) -> Script {
    script.switches = u64::MAX;
    script.commands = commands.into_iter().collect();
    script
}

pub(crate) fn mode_switches_alone() -> Scenario {
    let mut script = with_modes(rich_script(41), [1003, 1060, 1200, 1450]);
    script.batch = 1;
    script.ticks(600);
    told(script)
}

/// The command is lost; the ticks before it, or behind it, are lost; the producer is away meanwhile, or restarts.
pub(crate) fn mode_switches_in_gaps() -> Scenario {
    let mut script = with_modes(rich_script(42), []);
    script.batch = 1;
    for (place, lost) in [
        (60, 1),
        (58, 2),
        (61, 1),
        (61, 2),
        (63, 1),
        (64, 3),
        (59, 3),
        (57, 8),
        (60, 70),
        (65, 1),
        (66, 1),
        (52, 3),
    ] {
        script.commands = vec![script.next + 60];
        script.ticks(place);
        script.gap(lost);
        script.ticks(40);
    }
    script.commands = vec![script.next + 1];
    script.ticks(3);
    script.restart();
    script.commands = vec![script.next + 2];
    script.ticks(60);
    told(script)
}

pub(crate) fn mode_switches_few_ticks_apart() -> Scenario {
    let mut script = Script::new(43, &full(), &FULL_CHANNELS);
    (script.batch, script.swing) = (1, 50.0);
    for apart in [10, 10, 4, 5, 6, 7, 3, 2, 1] {
        script.switches = apart;
        script.ticks(70);
    }
    told(script)
}

/// Other figures of the substitution, each over the same switches.
pub(crate) fn mode_switches_by_other_fits() -> Scenario {
    let [mut short, mut long, mut flat] = [ReversalParts::default(); 3];
    (short.transition, short.predict_readings, short.fit_readings_after) = (Transition::Ticks(1), 3, 1);
    (long.predict_readings, long.predict_degree, long.transition) = (8, 2, Transition::Ticks(2));
    (long.fit_readings_before, long.fit_readings_after, long.fit_degree) = (8, 5, 3);
    (flat.predict_readings, flat.predict_degree, flat.fit_degree) = (1, 0, 1);
    let mut script = rich_script(44);
    (script.switches, script.batch) = (50, 2);
    script.durations = (0..60).map(|tick| (1000 + 13 * tick, Span::from_ns(4_990_000 + 1000 * 7))).collect();
    for reversal in [short, long, flat] {
        let mut parts = rich_parts(0.0);
        parts.reversal = Some(reversal);
        script.give(compile(&parts), At::NextTick, Span::ZERO);
        script.ticks(300);
    }
    let mut parts = rich_parts(0.0);
    parts.reversal = None;
    script.ticks(52);
    script.give(compile(&parts), At::NextTick, Span::ZERO);
    script.ticks(20);
    told(script)
}

/// The transition as a time over ticks of several lengths, and a window that adapts.
pub(crate) fn mode_switches_of_a_stated_time() -> Scenario {
    let mut script = rich_script(49);
    (script.switches, script.batch) = (70, 2);
    for (tick_ms, fit_window) in [(5, FitWindow::Adaptive), (1, FitWindow::Adaptive), (1, FitWindow::Fixed)] {
        let mut parts = rich_parts(0.0);
        parts.reversal = Some(ReversalParts {
            transition: Transition::Time(0.015),
            fit_readings_before: 8,
            fit_readings_after: 7,
            fit_window,
            ..ReversalParts::default()
        });
        script.tick = Span::from_ms(tick_ms);
        script.give(compile(&parts), At::NextTick, Span::ZERO);
        script.ticks(300);
    }
    told(script)
}

pub(crate) fn servo(seed: u64, halves: bool) -> Script {
    let mut parts = with_outputs(rich_parts(0.0), OutputKind::Counts, OutputKind::Counts);
    for (gyro, form) in
        parts.gyros.iter_mut().zip([ServoForm::Measured, ServoForm::Modelled, ServoForm::Modelled])
    {
        gyro.servo = Some(ServoParts {
            form,
            time_constant_s: 0.04,
            rest_frequency: polynomial(&[119_500.0, -18.0]),
            settle_time_constants: 4.0,
        });
    }
    parts.gyros[2].servo = None;
    let mut script = Script::new(seed, &compile(&parts), &RICH_CHANNELS);
    (script.switches, script.halves, script.batch) = (100, halves, 4);
    (script.scatter, script.swing, script.dither_hz) = (9.0, 30.0, 120_000.0);
    script
}

pub(crate) fn servo_with_half_period_counts() -> Scenario {
    let mut script = servo(45, true);
    script.ticks(700);
    script.gap(30);
    script.ticks(71);
    script.gap(3);
    script.ticks(100);
    told(script)
}

/// The negative half comes first in the minus mode; one gyro in each form.
pub(crate) fn servo_of_a_dither_that_turns_with_the_mode() -> Scenario {
    let mut parts = with_outputs(rich_parts(0.0), OutputKind::Counts, OutputKind::Counts);
    let forms = [ServoForm::Measured, ServoForm::Modelled, ServoForm::Fitted];
    for (gyro, form) in parts.gyros.iter_mut().zip(forms) {
        gyro.servo = Some(ServoParts {
            form,
            time_constant_s: 0.04,
            rest_frequency: polynomial(&[59_700.0, -9.0]),
            settle_time_constants: 6.0,
        });
    }
    let mut script = Script::new(48, &compile(&parts), &RICH_CHANNELS);
    (script.switches, script.dither_turns, script.batch) = (100, true, 4);
    (script.scatter, script.swing) = (9.0, 30.0);
    script.ticks(650);
    script.gap(3);
    script.ticks(150);
    told(script)
}

/// They are missing; then they come from the middle of a transient on, and cease in another.
pub(crate) fn servo_without_half_period_counts() -> Scenario {
    let mut script = servo(46, false);
    script.ticks(310);
    script.halves = true;
    script.ticks(96);
    script.ticks(106);
    script.halves = false;
    script.ticks(200);
    told(script)
}

pub(crate) fn slow_meander_and_trend() -> Scenario {
    let mut script = rich_script(47);
    (script.switches, script.meander, script.batch) = (130, 70, 6);
    script.ticks(1000);
    told(script)
}
