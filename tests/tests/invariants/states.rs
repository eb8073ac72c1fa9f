//! The states of a unit (models §7): what goes out in each, and what may follow what.

use std::collections::BTreeSet;

use isotherm_correction::earth::Place;
use isotherm_correction::operation::{CheckItem, Command, Refusal, SelfTest, State};
use isotherm_correction::prelaunch::PreLaunchSettings;
use isotherm_correction::sample::{CorrectedTick, TickFlags};
use isotherm_correction::unit::{Event, PreLaunchView, Unit, UnitSettings};
use isotherm_tests::calibrations::{compile, identity};
use isotherm_tests::drive::{self, Owned};
use isotherm_tests::streams::{accel, gyro, temperature};

fn pre_launch() -> Command {
    let place = Place::new(55.0, 30.0, None).unwrap();
    Command::PreLaunch(PreLaunchSettings { place: Some(place), ..PreLaunchSettings::default() })
}

fn commands() -> Vec<Command> {
    vec![
        Command::Standby,
        Command::SelfTest,
        pre_launch(),
        Command::Abort,
        Command::Run { reversal: Some(false) },
        Command::Rest(Place::new(55.0, 30.0, None).unwrap()),
        Command::EndRest,
    ]
}

/// Ticks of a sensor that moves.
fn feed(unit: &mut Unit, ticks: std::ops::Range<u64>, out: &mut Vec<CorrectedTick>) {
    for k in ticks {
        if k % 100 == 0 {
            drive::hand(unit, &Owned::Temperature(vec![temperature(k, 20.0)]), out);
        }
        let moving = 1e-6 * f64::from(u32::try_from(k % 7).unwrap());
        drive::hand(unit, &Owned::Accel(vec![accel(k, &[moving, moving, -9.8 + moving])]), out);
        drive::hand(unit, &Owned::Gyro(vec![gyro(k, &[moving; 3])]), out);
    }
}

/// A calibrated unit in a state.
fn in_state(state: State) -> Unit {
    let mut unit = drive::unit(&compile(&identity()));
    let way: &[Command] = match state {
        State::Standby => &[Command::Standby],
        State::SelfTest => &[Command::Standby, Command::SelfTest],
        State::PreLaunchCalibration => &[Command::Standby, pre_launch()],
        State::RunningWithReversal | State::RunningWithoutReversal => &[],
    };
    for command in way {
        unit.command(command).unwrap();
    }
    unit
}

#[test]
fn every_command_in_every_state_is_carried_out_or_refused_with_what_is_possible() {
    let states =
        [State::Standby, State::SelfTest, State::PreLaunchCalibration, State::RunningWithoutReversal];
    let mut refused = BTreeSet::new();
    for state in states {
        for command in commands() {
            let mut unit = in_state(state);
            assert_eq!(unit.state(), state);
            match unit.command(&command) {
                Ok(after) => assert_eq!(unit.state(), after),
                Err(refusal) => {
                    assert_eq!(unit.state(), state, "a refusal changes nothing");
                    if let Refusal::State { .. } = refusal {
                        let words = refusal.to_string();
                        let allowed = state.allowed().join(", ");
                        assert!(words.contains(command.name()) && words.ends_with(&allowed), "{words}");
                        refused.insert((state.name(), command.name()));
                    }
                }
            }
        }
    }
    let expected = [
        ("pre-launch calibration", "end-rest"),
        ("pre-launch calibration", "pre-launch"),
        ("pre-launch calibration", "rest"),
        ("pre-launch calibration", "run"),
        ("pre-launch calibration", "self-test"),
        ("pre-launch calibration", "standby"),
        ("running without mode reversal", "abort"),
        ("running without mode reversal", "pre-launch"),
        ("running without mode reversal", "self-test"),
        ("self-test", "end-rest"),
        ("self-test", "pre-launch"),
        ("self-test", "rest"),
        ("self-test", "run"),
        ("self-test", "self-test"),
        ("self-test", "standby"),
        ("standby", "abort"),
    ];
    assert_eq!(refused.into_iter().collect::<Vec<_>>(), expected);
}

#[test]
fn what_a_command_needs_is_said() {
    let mut bare = Unit::new(UnitSettings { in_standby: true, ..UnitSettings::default() });
    assert!(matches!(bare.command(&pre_launch()), Err(Refusal::Uncalibrated { .. })));
    assert_eq!(bare.command(&Command::SelfTest), Ok(State::Standby));
    assert!(!bare.self_test().unwrap().passed(), "without a calibration there is nothing to pass");
    let mut unit = drive::unit(&compile(&identity()));
    assert_eq!(unit.command(&Command::Run { reversal: Some(true) }), Err(Refusal::NoReversal));
    let rest = Command::Rest(Place::new(55.0, 30.0, None).unwrap());
    assert_eq!(unit.command(&rest), Err(Refusal::NoDrift));
}

#[test]
fn in_standby_ticks_are_held_and_announced_and_the_filters_go_on() {
    let mut plain = drive::unit(&compile(&identity()));
    let (mut all, mut out) = (Vec::new(), Vec::new());
    feed(&mut plain, 0..900, &mut all);
    let mut unit = drive::unit(&compile(&identity()));
    feed(&mut unit, 0..300, &mut out);
    unit.command(&Command::Standby).unwrap();
    feed(&mut unit, 300..600, &mut out);
    assert_eq!(unit.counters().ticks_held, 300);
    unit.command(&Command::Run { reversal: None }).unwrap();
    feed(&mut unit, 600..900, &mut out);
    let first = out.iter().position(|tick| tick.missed > 0).unwrap();
    assert_eq!((out[first].sequence, out[first].missed), (all[first].sequence + 300, 300));
    assert!(out[first].flags.contains(TickFlags::GAP));
    let carried: u64 = out.iter().map(|tick| 1 + tick.missed).sum();
    assert_eq!(carried, all.len() as u64, "each tick once, or announced");
    for tick in &out[first + 1..] {
        let same = all.iter().find(|plain| plain.sequence == tick.sequence);
        assert_eq!(Some(tick), same, "the correction went on in standby");
    }
}

#[test]
fn a_unit_may_begin_in_standby() {
    let mut unit = Unit::new(UnitSettings { in_standby: true, ..UnitSettings::default() });
    unit.install(compile(&identity()), 1);
    let mut out = Vec::new();
    feed(&mut unit, 0..100, &mut out);
    unit.handle(Event::Flush, &mut |tick| out.push(tick.clone()));
    assert!(out.is_empty() && unit.state() == State::Standby);
}

#[test]
fn a_self_test_ends_by_itself_and_says_what_it_measured() {
    let mut unit = in_state(State::SelfTest);
    let mut out = Vec::new();
    feed(&mut unit, 0..2100, &mut out);
    assert_eq!((unit.state(), out.len()), (State::Standby, 0));
    let report = unit.self_test().unwrap();
    assert!(report.passed(), "{report:?}");
    assert!(report.length >= SelfTest::LENGTH);
    let has = |item| report.checks.iter().any(|check| check.item == item);
    assert!(
        (0..3).all(|i| has(CheckItem::Gyro(i)) && has(CheckItem::Accel(i))) && has(CheckItem::Calibration)
    );
}

#[test]
fn a_self_test_without_ticks_is_ended_by_the_clock_and_failed() {
    let mut unit = in_state(State::SelfTest);
    unit.expire_self_test();
    let report = unit.self_test().unwrap();
    let failed = report.checks.iter().filter(|check| !check.passed && check.value.is_none());
    assert!(failed.count() >= 6, "no gyro and no accelerometer is alive: {report:?}");
    assert_eq!(unit.state(), State::Standby);
}

#[test]
fn a_dead_gyro_fails_the_self_test() {
    let mut unit = in_state(State::SelfTest);
    let mut out = Vec::new();
    for k in 0..2100 {
        let moving = 1e-6 * f64::from(u32::try_from(k % 7).unwrap());
        drive::hand(&mut unit, &Owned::Accel(vec![accel(k, &[moving, moving, -9.8 + moving])]), &mut out);
        drive::hand(&mut unit, &Owned::Gyro(vec![gyro(k, &[moving, 0.125, moving])]), &mut out);
    }
    let report = unit.self_test().unwrap();
    let gyros = report.checks.iter().filter_map(|check| match check.item {
        CheckItem::Gyro(i) => Some((i, check.passed)),
        _ => None,
    });
    assert_eq!(gyros.collect::<Vec<_>>(), [(0, true), (1, false), (2, true)]);
}

#[test]
fn a_pre_launch_calibration_may_be_aborted_and_ends_when_its_calibration_is_swapped() {
    let mut unit = in_state(State::PreLaunchCalibration);
    let mut out = Vec::new();
    feed(&mut unit, 0..500, &mut out);
    assert!(
        matches!(unit.pre_launch(), Some(PreLaunchView::Running(progress)) if progress.elapsed.as_s() > 2.0)
    );
    let before = unit.calibration().map(|(calibration, revision)| (calibration.clone(), revision));
    unit.command(&Command::Abort).unwrap();
    assert_eq!((unit.state(), unit.pre_launch()), (State::Standby, Some(PreLaunchView::Aborted)));
    assert_eq!(unit.calibration().map(|(calibration, revision)| (calibration.clone(), revision)), before);
    unit.command(&pre_launch()).unwrap();
    unit.install(compile(&identity()), 2);
    assert_eq!((unit.state(), unit.pre_launch()), (State::Standby, Some(PreLaunchView::Aborted)));
}
