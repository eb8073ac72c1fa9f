//! Commands of the unit: a calibration that is given up, or refused, leaves everything as it was.

use std::sync::Arc;

use isotherm_correction::operation::{Command, State};
use isotherm_correction::prelaunch::{Outcome, Refusal};
use isotherm_correction::unit::{Event, PreLaunchView, Unit, UnitSettings};
use isotherm_correction::units::Span;
use isotherm_simulator::{Scenario, Simulation};

use crate::bench::{LEAD_S, accepted, calibration, coarse_zeeman, feed, given, run};

/// A unit in standby that has seen the lead, and the rest of its stream.
fn after_lead(scenario: &Scenario) -> (Unit, Simulation) {
    let mut unit = Unit::new(UnitSettings { in_standby: true, ..UnitSettings::default() });
    unit.install(calibration("ZLG-0001"), 1);
    let mut simulation = Simulation::new(scenario).unwrap();
    for step in simulation.by_ref() {
        feed(&mut unit, scenario, &step);
        if step.gyro.end_time.as_ns() >= Span::from_s(LEAD_S).as_ns() {
            break;
        }
    }
    (unit, simulation)
}

#[test]
fn a_calibration_by_command_is_the_same_as_of_the_core_alone() {
    let scenario = coarse_zeeman(21);
    let (mut unit, simulation) = after_lead(&scenario);
    unit.command(&Command::PreLaunch(given())).unwrap();
    for step in simulation {
        feed(&mut unit, &scenario, &step);
    }
    let Some(PreLaunchView::Ended(outcome)) = unit.pre_launch() else { panic!("{:?}", unit.pre_launch()) };
    let alone = accepted(run(&calibration("ZLG-0001"), &scenario, &given()));
    for (by_command, alone) in accepted(outcome.clone()).iter().zip(&alone) {
        let difference = by_command.static_bias_change_rad_per_s - alone.static_bias_change_rad_per_s;
        assert!(difference.abs() < 0.1 * alone.static_bias_sigma_rad_per_s);
    }
    assert_eq!(unit.state(), State::Standby);
}

#[test]
fn a_calibration_that_is_given_up_or_too_short_changes_nothing() {
    let mut scenario = coarse_zeeman(22);
    scenario.duration_s = 300.0;
    for abort in [true, false] {
        let (mut unit, simulation) = after_lead(&scenario);
        let before = Arc::clone(unit.calibration().unwrap().0);
        unit.command(&Command::PreLaunch(given())).unwrap();
        for step in simulation {
            feed(&mut unit, &scenario, &step);
        }
        if abort {
            unit.command(&Command::Abort).unwrap();
            assert_eq!(unit.pre_launch(), Some(PreLaunchView::Aborted));
        } else {
            unit.handle(Event::Flush, &mut |_| {});
            unit.end_pre_launch();
            let view = unit.pre_launch();
            let Some(PreLaunchView::Ended(Outcome::Refused(refusals))) = view else { panic!("{view:?}") };
            assert!(matches!(refusals.as_slice(), [Refusal::TooShort { .. }]));
        }
        let (after, revision) = unit.calibration().unwrap();
        assert!(Arc::ptr_eq(&before, after) && revision == 1);
    }
}
