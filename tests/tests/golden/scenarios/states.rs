//! What a unit is told to do: self-test, pre-launch calibration, rest, standby; and the drift that it estimates.

use isotherm_correction::earth::Place;
use isotherm_correction::operation::Command;
use isotherm_correction::prelaunch::PreLaunchSettings;
use isotherm_correction::sample::OutputKind;
use isotherm_correction::unit::{At, UnitSettings};
use isotherm_correction::units::Span;
use isotherm_protocol::journal::JournalEvent;
use isotherm_tests::calibrations::compile;
use isotherm_tests::lives::{FULL_CHANNELS, full, place, skewed};
use isotherm_tests::script::{Kind, Odd, Scenario, Script};

use crate::plain::{RICH_CHANNELS, redundant_script, rich, rich_parts, rich_script, told};

/// A unit that begins in standby, with sensors that stand still, fail and come back in its self-tests.
pub(crate) fn self_tests() -> Scenario {
    let mut script = Script::new(111, &full(), &FULL_CHANNELS);
    (script.tick, script.batch, script.switches) = (Span::from_ms(50), 5, 60);
    script.command(Command::SelfTest, true);
    script.odd = vec![
        Odd { kind: Kind::Gyro, sensor: Some(1), ticks: 1050..1100, value: 7.0 },
        Odd { kind: Kind::Gyro, sensor: Some(2), ticks: 1010..1200, value: 8000.0 },
        Odd { kind: Kind::Accel, sensor: Some(0), ticks: 1000..1200, value: 3.0 },
        Odd { kind: Kind::Accel, sensor: Some(2), ticks: 1100..1102, value: 2000.0 },
    ];
    script.ticks(210);
    script.command(Command::SelfTest, true);
    script.thermometers = false;
    script.ticks(100);
    script.command(Command::SelfTest, false);
    script.ticks(110);
    script.command(Command::SelfTest, true);
    script.event(JournalEvent::SelfTestExpired);
    script.command(Command::SelfTest, true);
    script.ticks(20);
    script.event(JournalEvent::SelfTestExpired);
    script.command(Command::SelfTest, true);
    script.ticks(20);
    script.command(Command::Abort, true);
    script.command(Command::Run { reversal: None }, true);
    script.ticks(30);
    let settings = UnitSettings { in_standby: true, ..UnitSettings::default() };
    script.scenario("", settings, Vec::new())
}

/// What a state refuses; what a unit without a calibration can be told.
pub(crate) fn commands_refused_and_taken() -> Scenario {
    let mut script = rich_script(112);
    let first = script.steps.remove(0);
    let commands = |accepted| {
        let all = [
            Command::Run { reversal: Some(true) },
            Command::Run { reversal: Some(false) },
            Command::Rest(place()),
            Command::EndRest,
            Command::Abort,
            Command::Standby,
            Command::SelfTest,
            Command::PreLaunch(PreLaunchSettings::default()),
            Command::Run { reversal: None },
        ];
        all.map(|command| (command, accepted))
    };
    script.batch = 2;
    for round in 0..2 {
        for (command, accepted) in commands(round == 0) {
            script.command(command, accepted);
            script.ticks(6);
        }
        script.steps.push(first.clone());
    }
    script.command(Command::Abort, true);
    script.ticks(20);
    told(script)
}

/// A gap, a mode switch, a restart and a swap while nothing goes out.
pub(crate) fn standby_and_run() -> Scenario {
    let mut script = rich_script(113);
    (script.batch, script.switches) = (3, 70);
    script.ticks(100);
    for what in 0..5 {
        script.command(Command::Standby, true);
        script.ticks(20);
        match what {
            1 => script.gap(7),
            2 => script.restart(),
            3 => script.give(rich(0.5), At::NextTick, Span::from_ms(200)),
            4 => script.foreign(OutputKind::Counts, 3),
            _ => {}
        }
        script.ticks(21);
        script.command(Command::Run { reversal: Some(what % 2 == 0) }, true);
        script.ticks(60);
    }
    told(script)
}

fn pre_launch_of(place: Place, duration_s: u32, change_rad_per_s: f64) -> Command {
    let mut settings = PreLaunchSettings {
        duration: Span::from_ms(1000 * duration_s),
        place: Some(place),
        ..PreLaunchSettings::default()
    };
    settings.limits.time_per_mode = Span::from_ms(30_000);
    settings.limits.static_bias_change_rad_per_s = change_rad_per_s;
    settings.limits.magnetic_bias_change_rad_per_s = change_rad_per_s;
    Command::PreLaunch(settings)
}

/// Accepted, with modes, levelled or not; then refused for a limit, modes of unequal time, a move, a restart, a short time.
pub(crate) fn pre_launch_calibrations() -> Scenario {
    let mut parts = rich_parts(0.0);
    parts.filter.stale_after_s = 30.0;
    let mut script = Script::new(114, &compile(&parts), &RICH_CHANNELS);
    (script.tick, script.batch, script.switches) = (Span::from_ms(100), 10, 400);
    (script.swing, script.scatter, script.warming) = (0.0, 5.0, 1e-3);
    let levelled = Place::new(55.0, 30.0, None).unwrap();
    script.command(Command::Standby, true);
    for (place, duration_s, change) in
        [(levelled, 160, 1.0), (place(), 160, 1.0), (place(), 160, 1e-9), (place(), 120, 1.0)]
    {
        // Whole stretches between two switches.
        script.ticks(400 - script.next % 400);
        script.command(pre_launch_of(place, duration_s, change), true);
        script.ticks(u64::from(10 * duration_s + 20));
    }
    for moves in [true, false] {
        script.command(pre_launch_of(place(), 80, 1.0), true);
        script.ticks(400);
        let ticks = script.next..script.next + 20;
        if moves {
            script.odd = vec![Odd { kind: Kind::Gyro, sensor: Some(1), ticks, value: 0.02 }];
        } else {
            script.restart();
        }
        script.ticks(420);
    }
    script.command(pre_launch_of(place(), 80, 1.0), true);
    script.ticks(300);
    script.event(JournalEvent::PreLaunchEnded);
    script.command(Command::Run { reversal: None }, true);
    script.ticks(30);
    told(script)
}

/// Of a unit without modes, eight gyros, of which one fails meanwhile and some ticks are lost.
pub(crate) fn pre_launch_calibration_without_modes() -> Scenario {
    let mut script = redundant_script(115, 8, 20);
    (script.tick, script.batch, script.scatter) = (Span::from_ms(100), 10, 5.0);
    script.command(Command::Standby, true);
    script.command(pre_launch_of(place(), 60, 1.0), true);
    script.ticks(300);
    script.gap(9);
    script.ticks(350);
    script.odd = vec![Odd {
        kind: Kind::Gyro,
        sensor: Some(3),
        ticks: script.next + 100..script.next + 9000,
        value: 0.5,
    }];
    script.command(pre_launch_of(place(), 60, 1.0), true);
    script.ticks(650);
    told(script)
}

/// At rest: still, pushed, turned, and still again; then a change of place.
pub(crate) fn rest_and_moves() -> Scenario {
    let mut script = redundant_script(116, 4, 20);
    (script.tick, script.batch, script.scatter) = (Span::from_ms(100), 10, 5.0);
    script.command(Command::Rest(place()), true);
    script.ticks(1100);
    let from = script.next + 50;
    script.odd = vec![
        Odd { kind: Kind::Gyro, sensor: Some(0), ticks: from..from + 30, value: 0.01 },
        Odd { kind: Kind::Accel, sensor: None, ticks: from + 500..from + 520, value: 3.0 },
    ];
    script.ticks(1300);
    script.command(Command::Rest(Place::new(-33.0, 200.0, None).unwrap()), true);
    script.ticks(1400);
    script.command(Command::EndRest, true);
    script.ticks(50);
    let settings = UnitSettings { subtract_drift: true, ..UnitSettings::default() };
    script.scenario("", settings, Vec::new())
}

/// References that overlap, are too old, lie in a gap, are beyond belief, are too many.
pub(crate) fn drift_references_good_and_bad() -> Scenario {
    let mut script = redundant_script(117, 6, 20);
    (script.tick, script.batch, script.scatter) = (Span::from_ms(20), 5, 0.5);
    let s = 1_000_000_000;
    for (span, rate, sigma) in [
        (-2 * s..-s, [1e-5, 2e-5, -1e-5], 1e-6),
        (-2 * s..-s, [1e-5, 2e-5, -1e-5], 1e-6),
        (-3 * s..-s / 2, [1e-5, 2e-5, -1e-5], 1e-6),
        (-s..s / 5, [1e-5, 0.0, 0.0], 1e-5),
        (-s / 2..s / 5, [1e-5, 0.0, 0.0], 1e-5),
        (-130 * s..s, [1e-5, 0.0, 0.0], 1e-5),
        (s..2 * s, [0.0, 1e-5, 0.0], 0.0),
        (-s..0, [9.0, -9.0, 9.0], 1e-6),
        (-s..0, [2e3, 0.0, 0.0], 1e-6),
        (-s..0, [0.0; 3], 2.0),
        (-40 * s..-30 * s, [0.0; 3], 1e-6),
    ] {
        script.reference_of(span, rate, sigma);
        script.ticks(120);
    }
    script.gap(100);
    script.reference_of(-s..0, [0.0; 3], 1e-6);
    script.ticks(100);
    for far in 0..40 {
        script.reference_of(far * s / 5..far * s / 5 + s, [1e-6, 0.0, 1e-6], 1e-6);
    }
    script.ticks(400);
    // A row of them that agree with each other is believed in the end.
    for _ in 0..12 {
        script.reference_of(-s..0, [0.5, 0.5, 0.5], 1e-6);
        script.ticks(60);
    }
    script.reference_of(-s..2 * s, [0.0; 3], 1e-6);
    script.restart();
    script.ticks(200);
    script.reference();
    script.ticks(100);
    let settings =
        UnitSettings { subtract_drift: true, reference_delay: Span::from_ms(300), ..UnitSettings::default() };
    script.scenario("", settings, Vec::new())
}

/// The same estimates where they are not subtracted.
pub(crate) fn drift_estimated_and_not_subtracted() -> Scenario {
    let mut script = Script::new(118, &skewed(0.0), &[("t", 24.0)]);
    (script.tick, script.batch, script.scatter) = (Span::from_ms(50), 5, 0.5);
    script.mishaps = 1;
    for _ in 0..12 {
        script.ticks(50);
        script.reference();
    }
    script.ticks(100);
    told(script)
}
