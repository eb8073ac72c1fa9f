//! Places where one step more or less makes another decision.

use isotherm_correction::calibration::{BranchArgument, BranchedParts};
use isotherm_correction::curve::CurveParts;
use isotherm_correction::operation::Command;
use isotherm_correction::reversal::{ReversalParts, Transition};
use isotherm_correction::sample::OutputKind;
use isotherm_correction::unit::{At, Uncalibrated, UnitSettings};
use isotherm_correction::units::Span;
use isotherm_protocol::key::{Input, RawStream};
use isotherm_tests::calibrations::{Feature, PutTerms, compile, identity, polynomial};
use isotherm_tests::lives::{FULL_CHANNELS, full};
use isotherm_tests::script::{Accels, Kind, Odd, Scenario, Script, Step};

use super::modes::servo;
use crate::plain::{RICH_CHANNELS, redundant_script, rich, rich_parts, rich_script, told, with_outputs};

const GYRO: Input = Input::Raw(RawStream::Gyro);

/// The axes leave the temperatures that they were stated for, and no other term does.
pub(crate) fn edge_of_an_orientation_s_range() -> Scenario {
    let mut parts = rich_parts(0.0);
    parts.gyro_orientation.range_deg_c = [-10.0, 24.2];
    parts.accel_orientation.as_mut().unwrap().range_deg_c = [-10.0, 27.3];
    let mut script = Script::new(151, &compile(&parts), &RICH_CHANNELS);
    (script.batch, script.warming) = (2, 0.02);
    script.ticks(400);
    told(script)
}

/// Branched terms over a derivative that leaves the range of one branch only.
pub(crate) fn edge_of_a_branch_s_range() -> Scenario {
    let mut parts = rich_parts(0.0);
    let narrow = |range| CurveParts::Polynomial { reference: 0.0, coefficients: vec![1e-4, 1e-5], range };
    // As they are, over the derivative.
    let argument = BranchArgument::Derivative;
    let (run_up, braking) = (narrow([-1e-3, 1e-3]), narrow([-50.0, 50.0]));
    parts.gyros[0].terms.branched(Feature::ThermalRate, BranchedParts { argument, run_up, braking });
    let (run_up, braking) = (narrow([-500.0, 500.0]), narrow([-1e-3, 1e-3]));
    parts.gyros[1].terms.branched(Feature::ThermalAcceleration, BranchedParts { argument, run_up, braking });
    let mut script = Script::new(152, &compile(&parts), &RICH_CHANNELS);
    (script.batch, script.warming) = (1, 0.1);
    script.ticks(300);
    told(script)
}

/// One channel after the other is silent.
pub(crate) fn edge_of_the_board_s_freshness() -> Scenario {
    let mut script = rich_script(153);
    (script.batch, script.thermometers) = (2, false);
    for silent in ["board", "t"] {
        for _ in 0..30 {
            script.temperature("t", 24.2, -10_000_000);
            script.temperature("board", 30.1, -10_000_000);
            script.ticks(6);
        }
        for _ in 0..30 {
            let other = if silent == "t" { ("board", 30.2) } else { ("t", 24.1) };
            script.temperature(other.0, other.1, -10_000_000);
            script.ticks(6);
        }
    }
    told(script)
}

/// Readings come in unequal steps, so that terms reach what they move to and stay there.
pub(crate) fn edge_of_a_line_s_end() -> Scenario {
    let mut script = rich_script(169);
    (script.batch, script.thermometers) = (2, false);
    let mut raw = 24.0;
    for ticks in [10, 30, 10, 60, 20, 70, 10, 40, 40, 30, 14, 80] {
        raw += 0.37;
        script.temperature("t", raw, -3_000_000);
        script.temperature("board", 2.0 * raw - 20.0, -3_000_000);
        script.ticks(ticks);
    }
    told(script)
}

/// More ticks are claimed than the time can hold, by so little that it is believed, or is not.
pub(crate) fn edge_of_a_plausible_step() -> Scenario {
    let mut script = rich_script(154);
    script.batch = 1;
    for (ticks, of_time) in [(10, 6), (10, 5), (10, 4), (100, 51), (100, 49), (3, 1), (1, 40), (2, 700_000)] {
        script.ticks(30);
        script.gap(ticks);
        script.now_ns += (of_time - i64::try_from(ticks).unwrap()) * script.tick.as_ns();
    }
    script.ticks(60);
    told(script)
}

/// Ticks come again, and some for the first time, as late as can still be told.
pub(crate) fn edge_of_what_is_late() -> Scenario {
    let mut script = rich_script(155);
    script.batch = 1;
    script.ticks(300);
    let gyros = |script: &Script| -> Vec<Step> {
        let steps =
            script.steps.iter().filter(|step| matches!(step, Step::Frame(input, _) if *input == GYRO));
        steps.cloned().collect()
    };
    let sent = gyros(&script);
    for age in [1, 2, 64, 126, 127, 128, 129, 130, 200] {
        script.steps.push(sent[sent.len() - 1 - age].clone());
    }
    // Lost ones that come in the end.
    let mut lost = rich_script(156);
    lost.batch = 1;
    (lost.next, lost.now_ns) = (script.next, script.now_ns);
    lost.ticks(3);
    script.gap(3);
    script.ticks(126);
    for step in gyros(&lost) {
        script.steps.push(step);
        script.ticks(1);
    }
    told(script)
}

/// Ticks that wait where a run begins: of the run before, of the new one, from far away.
pub(crate) fn edge_of_a_restart() -> Scenario {
    let mut script = rich_script(157);
    script.batch = 2;
    for (step_ns, far_ns) in [
        (50_000_000, 0),
        (3_000_000_000, 11_000_000_000),
        (-200_000_000, 9_000_000_000),
        (7_200_000_000_000, 10_000_000_001),
        (-7_300_000_000_000, 5_000_000),
    ] {
        script.ticks(60);
        // Accelerometer ticks from the future; gyro ticks that wait for one that is lost.
        let mut future = rich_script(158);
        (future.batch, future.now_ns) = (2, script.now_ns + far_ns + 60_000_000);
        future.ticks(4);
        let accel = Input::Raw(RawStream::Accel);
        script.steps.extend(
            future.steps.into_iter().filter(|step| matches!(step, Step::Frame(input, _) if *input == accel)),
        );
        script.gap(2);
        script.ticks(4);
        script.series += 1;
        script.next = 30;
        script.now_ns += step_ns;
        script.accels = if far_ns % 2 == 0 { Accels::Before } else { Accels::After };
    }
    script.ticks(60);
    told(script)
}

/// The producer reports the mode as it is: later than it is commanded, even behind the transition.
pub(crate) fn edge_of_modes_as_they_are() -> Scenario {
    let mut script = rich_script(159);
    (script.batch, script.switches) = (1, 50);
    for late in 0..8 {
        script.mode_late = late;
        script.ticks(100);
    }
    told(script)
}

/// Gaps behind a switch that are just bridged, and just not.
pub(crate) fn edge_of_a_switch_s_reach() -> Scenario {
    let mut script = rich_script(160);
    script.batch = 1;
    script.switches = u64::MAX;
    for (place, lost) in (10..20).flat_map(|lost| [(31, lost), (33, lost), (34, lost)]) {
        script.commands = vec![script.next + 30];
        script.ticks(place);
        script.gap(lost);
        script.ticks(12);
    }
    told(script)
}

/// Swaps to another substitution at each tick behind a switch.
pub(crate) fn edge_of_other_fits_in_a_transition() -> Scenario {
    let long = ReversalParts {
        fit_readings_after: 6,
        fit_readings_before: 6,
        fit_degree: 3,
        ..ReversalParts::default()
    };
    let short =
        ReversalParts { fit_readings_after: 1, transition: Transition::Ticks(1), ..ReversalParts::default() };
    let sets = [long, short].map(|reversal| {
        let mut parts = rich_parts(0.0);
        parts.reversal = Some(reversal);
        compile(&parts)
    });
    let mut script = rich_script(161);
    (script.batch, script.switches) = (1, u64::MAX);
    for place in 31..41 {
        script.give(sets[0].clone(), At::NextTick, Span::ZERO);
        script.commands = vec![script.next + 30];
        script.ticks(place);
        script.give(sets[1].clone(), At::NextTick, Span::ZERO);
        script.ticks(12);
    }
    told(script)
}

/// A suspicion that is interrupted: by a reading that is no number, by a tick that is right, by another suspect.
pub(crate) fn edge_of_a_suspicion() -> Scenario {
    let mut script = redundant_script(162, 6, 20);
    script.batch = 1;
    let odd = |sensor, from: u64, ticks: u64, value| Odd {
        kind: Kind::Gyro,
        sensor: Some(sensor),
        ticks: from..from + ticks,
        value,
    };
    script.odd = vec![
        odd(1, 1050, 15, 0.4),
        odd(1, 1066, 15, 0.4),
        odd(4, 1100, 25, 0.4),
        odd(0, 1115, 1, f64::NAN),
        odd(5, 1150, 25, 0.4),
        odd(1, 1165, 1, f64::NAN),
        odd(4, 1200, 19, 0.4),
        odd(4, 1230, 30, 0.4),
        odd(5, 1300, 10, 0.4),
        odd(0, 1310, 15, 0.4),
    ];
    script.ticks(400);
    told(script)
}

/// Spikes where the median is one of few readings.
pub(crate) fn edge_of_a_median() -> Scenario {
    let mut script = rich_script(163);
    (script.batch, script.thermometers) = (1, false);
    for readings in
        [&[24.0, 43.0, 45.0, 24.0, 62.5][..], &[24.0, 30.0, 36.0, 42.0, 61.9, 50.0], &[40.0, 21.0, 44.0, 2.0]]
    {
        for raw in readings {
            script.temperature("t", *raw, -60_000_000);
            script.ticks(12);
        }
        script.restart();
        script.ticks(20);
    }
    told(script)
}

/// Sensors that stand still over a mode switch, and one that is excluded meanwhile.
pub(crate) fn edge_of_a_self_test() -> Scenario {
    let mut script = Script::new(164, &full(), &FULL_CHANNELS);
    (script.tick, script.batch, script.switches) = (Span::from_ms(50), 5, 60);
    // Stuck for 1.5 s, in the midst of which the mode is switched; and for as long elsewhere.
    script.odd = [(1, 1065), (2, 1095)]
        .map(|(sensor, from)| Odd {
            kind: Kind::Gyro,
            sensor: Some(sensor),
            ticks: from..from + 30,
            value: 9.0,
        })
        .to_vec();
    script.command(Command::Standby, true);
    script.command(Command::SelfTest, true);
    script.ticks(210);
    let calibration = redundant_script(0, 6, 20).calibration;
    script.give(calibration.clone(), At::NextTick, Span::ZERO);
    let forces = redundant_script(0, 6, 20).forces;
    (script.calibration, script.forces, script.switches) = (calibration, forces, 0);
    script.channels = vec![("t".try_into().unwrap(), 23.0)];
    script.odd = vec![Odd { kind: Kind::Gyro, sensor: Some(4), ticks: 1230..1400, value: 0.4 }];
    script.command(Command::SelfTest, true);
    script.ticks(210);
    told(script)
}

/// A restart in the middle of a servo's transient, whose clock goes on.
pub(crate) fn edge_of_a_servo_at_a_restart() -> Scenario {
    let mut script = servo(165, true);
    (script.batch, script.switches) = (1, 50);
    for place in [51, 54, 56, 60, 70] {
        script.ticks(50 - script.next % 50 + place);
        script.series += 1;
        script.ticks(20);
    }
    // Counts of ticks that are far, and not too far, apart.
    for lost in [7, 8, 9, 14, 15, 16, 17] {
        script.ticks(50 - script.next % 50 + 5);
        script.gap(lost);
        script.ticks(3);
    }
    told(script)
}

/// What stands in for a reading that is no number, behind swaps, gaps and restarts.
pub(crate) fn edge_of_the_last_good_rate() -> Scenario {
    let mut script = rich_script(166);
    script.batch = 1;
    for what in 0..4 {
        script.ticks(20);
        let from = script.next;
        for kind in [Kind::Gyro, Kind::Accel] {
            script.odd.push(Odd { kind, sensor: Some(1), ticks: from..from + 3, value: f64::NAN });
        }
        match what {
            0 => script.give(rich(0.3), At::NextTick, Span::ZERO),
            1 => script.give(rich(0.6), At::NextTick, Span::from_ms(50)),
            2 => script.restart(),
            _ => script.series += 1,
        }
    }
    script.ticks(20);
    told(script)
}

/// Between sets of as many sensors with other outputs there is no way, whatever time is given.
pub(crate) fn edge_of_other_outputs() -> Scenario {
    let [counts, means] = [OutputKind::Counts, OutputKind::Mean];
    let sets = [(means, means), (counts, means), (counts, counts), (means, counts), (means, means)]
        .map(|(gyro, accel)| compile(&with_outputs(rich_parts(0.0), gyro, accel)));
    let mut script = Script::new(167, &sets[0], &RICH_CHANNELS);
    script.batch = 2;
    for set in sets {
        script.give(set.clone(), At::NextTick, Span::from_ms(300));
        script.calibration = set;
        script.ticks(80);
    }
    told(script)
}

/// Ticks that were never corrected are missing to what comes later, a restart among them.
pub(crate) fn edge_of_a_calibration_that_comes_late() -> Scenario {
    let mut parts = identity();
    parts.gyros[1].terms.curve(Feature::One, polynomial(&[1e-4]));
    let mut script = Script::new(168, &compile(&parts), &[("t", 24.0)]);
    let first = script.steps.remove(0);
    script.batch = 1;
    script.ticks(30);
    script.restart();
    script.ticks(31);
    script.steps.push(first);
    script.ticks(30);
    let settings = UnitSettings { uncalibrated: Uncalibrated::Hold, ..UnitSettings::default() };
    script.scenario("", settings, Vec::new())
}
