//! References that the drift estimator does not believe, or believes in the end.

use std::sync::Arc;

use isotherm_correction::calibration::Calibration;
use isotherm_correction::drift::DriftParts;
use isotherm_correction::earth::Place;
use isotherm_correction::operation::Command;
use isotherm_correction::unit::UnitSettings;
use isotherm_correction::units::Span;
use isotherm_tests::calibrations::{compile, identity, lively_drift};
use isotherm_tests::script::{Kind, Odd, Scenario, Script};

use crate::plain::{RICH_CHANNELS, rich_parts};

const S: i64 = 1_000_000_000;

/// Gyros that hardly drift: one more lively than the others, one without an estimator.
fn calm() -> Arc<Calibration> {
    let mut parts = identity();
    parts.gyros.push(parts.gyros[0].clone());
    parts.gyro_orientation.rows.push([0.6, 0.0, 0.8]);
    for (gyro, sigma_rad_per_s) in parts.gyros.iter_mut().zip([1e-6, 3e-6, 1e-7]) {
        gyro.drift = Some(DriftParts {
            sigma_rad_per_s,
            correlation_time_s: 600.0,
            trend_sigma_rad_per_s2: 1e-9,
            trend_correlation_time_s: 3600.0,
            initial_sigma_rad_per_s: 3.0 * sigma_rad_per_s,
            angle_random_walk_rad_per_sqrt_s: 1e-7,
        });
    }
    compile(&parts)
}

pub(crate) fn drift_references_not_believed_at_first() -> Scenario {
    let mut script = Script::new(171, &calm(), &[("t", 23.0)]);
    (script.tick, script.batch, script.scatter) = (Span::from_ms(250), 4, 0.5);
    for (rounds, size) in [(4, 0.0), (3, 1e-2), (4, 2e-5), (14, 1e-5), (13, 3e-6), (2, 0.0)] {
        for round in 0..rounds {
            script.ticks(16);
            // Those of the third row do not agree with each other.
            let turn = if size > 1.5e-5 && round % 2 == 0 { -1.0 } else { 1.0 };
            let sigma = if round == 1 { 0.0 } else { 1e-7 };
            script.reference_of(-3 * S..-S, [turn * size, -size, 0.3 * size], sigma);
        }
    }
    // Beyond all belief however often; then of a spread that is just, or just not, that of one and the same drift.
    for _ in 0..12 {
        script.ticks(16);
        script.reference_of(-3 * S..-S, [1e-3; 3], 1e-7);
    }
    for round in 0..13 {
        script.ticks(16);
        let rate = if round % 2 == 0 { 6e-5 } else { 8.1e-5 };
        script.reference_of(-3 * S..-S, [0.0, rate, 0.0], 2e-6);
    }
    script.ticks(16);
    told(script)
}

/// Too old for what is kept; in a stretch without ticks that is just short enough; when the clock leaves them behind.
pub(crate) fn drift_references_out_of_reach() -> Scenario {
    let mut script = Script::new(172, &calm(), &[("t", 23.0)]);
    (script.tick, script.batch, script.scatter) = (Span::from_ms(200), 2, 0.5);
    script.ticks(700);
    for from_s in [-139, -128, -127, -126, -125, -100] {
        script.reference_of(from_s * S..(from_s + 2) * S, [0.0; 3], 1e-6);
        script.ticks(4);
    }
    for lost in [1, 2, 10] {
        script.ticks(60);
        script.gap(lost);
        script.ticks(60);
        script.reference_of(-20 * S..-S, [0.0; 3], 1e-6);
        script.ticks(20);
    }
    for step_s in [7200, -7200, 20, -30] {
        script.reference_of(100 * S..102 * S, [0.0; 3], 1e-6);
        script.reference_of(-2 * S..-S / 2, [1e-7, 0.0, 0.0], 1e-6);
        script.ticks(2);
        script.series += 1;
        script.now_ns += step_s * S;
        script.ticks(60);
        script.reference_of(-3 * S..-S, [1e-7, 0.0, 1e-7], 1e-6);
        script.ticks(30);
    }
    told(script)
}

/// At rest with modes and noise: nudges that grow, between two switches and over one; then it stands otherwise.
pub(crate) fn drift_at_rest_that_is_nudged() -> Scenario {
    let mut parts = rich_parts(0.0);
    parts.filter.stale_after_s = 30.0;
    parts.gyros.iter_mut().for_each(|gyro| gyro.drift = Some(lively_drift()));
    let mut script = Script::new(173, &compile(&parts), &RICH_CHANNELS);
    (script.tick, script.batch, script.switches) = (Span::from_ms(100), 10, 450);
    (script.scatter, script.warming) = (60.0, 1e-3);
    script.command(Command::Standby, true);
    script.command(Command::Rest(Place::new(55.0, 30.0, None).unwrap()), true);
    let nudges = [5e-5, 1e-4, 2e-4, 4e-4, 1e-3, 3e-3];
    for (round, nudge) in (0_u64..).zip(nudges.into_iter().flat_map(|nudge| [nudge, nudge])) {
        script.ticks(450 - script.next % 450 + 900);
        let from = script.next + if round.is_multiple_of(2) { 205 } else { 445 };
        let ticks = from..from + 12;
        script.odd = vec![
            Odd { kind: Kind::Gyro, sensor: Some(1), ticks: ticks.clone(), value: nudge },
            Odd {
                kind: Kind::Accel,
                sensor: Some(0),
                ticks: from + 250..from + 262,
                value: 0.04 + 10.0 * nudge,
            },
        ];
        script.ticks(900);
        script.forces = [40.0 + 50_000.0 * nudge, -30_000.0 * nudge, -9800.0].to_vec();
    }
    script.ticks(900);
    told(script)
}

fn told(script: Script) -> Scenario {
    let settings = UnitSettings { subtract_drift: true, ..UnitSettings::default() };
    script.scenario("", settings, Vec::new())
}
