//! I5: over a mode switch the accumulated angle is that of the two-sided fit (models §5), in a stream with gaps too.

use std::f64::consts::{PI, TAU};

use isotherm_correction::calibration::GyroParts;
use isotherm_correction::curve::CurveParts;
use isotherm_correction::reversal::{ReversalParts, Transition};
use isotherm_correction::sample::{CorrectedTick, GyroTick, LasingMode, SensorFlags, TickFlags};
use isotherm_correction::units::Span;
use isotherm_tests::calibrations::{
    ALONG_CASE_AXES, MAGNETIC_BIAS_RAD_PER_S, compile, mode_reversed, orientation, plain_gyro,
};
use isotherm_tests::drive::{self, Owned};
use isotherm_tests::streams;

const TICK_S: f64 = 0.005;
const ARCSEC: f64 = PI / 180.0 / 3600.0;
const AMPLITUDE_RAD: f64 = PI / 180.0;
/// Tick of j = 0, the last good one of the old mode.
const LAST_GOOD: u64 = 20;
const TICKS: u64 = 60;
const PHASES: u32 = 180;

/// Angle increment of tick `k` under sine motion (rad), exactly integrated.
fn truth(k: u64, frequency_hz: f64, phase: f64) -> f64 {
    let angle = |t: f64| AMPLITUDE_RAD * (TAU * frequency_hz * t + phase).sin();
    #[expect(clippy::cast_precision_loss, reason = "a small tick number")]
    let end = k as f64 * TICK_S;
    angle(end) - angle(end - TICK_S)
}

/// A tick as the gyros would give it: the magnetic bias in it, rubbish while nothing lases.
fn raw(k: u64, frequency_hz: f64, phase: f64, switches: &[u64], n: u64) -> GyroTick {
    let done = switches.iter().filter(|&&s| k >= s).count();
    let mode = if done % 2 == 0 { LasingMode::Plus } else { LasingMode::Minus };
    let lost = switches.iter().any(|&s| (s..s + n).contains(&k));
    let motion = truth(k, frequency_hz, phase) / TICK_S;
    let rates = [1.0, -0.5, 2.0]
        .map(|share| if lost { 1e3 } else { motion + mode.sign() * share * MAGNETIC_BIAS_RAD_PER_S });
    GyroTick { mode: Some(mode), switch_command: switches.contains(&k), ..streams::gyro(k, &rates) }
}

/// Runs one phase through the state machine; `missing` ticks never arrive.
fn run(
    parts: ReversalParts,
    frequency_hz: f64,
    phase: f64,
    switches: &[u64],
    missing: &[u64],
) -> Vec<CorrectedTick> {
    let calibration = compile(&mode_reversed(parts));
    let n = u64::from(parts.transition.ticks(Span::from_s(TICK_S)));
    let ticks = (0..TICKS).filter(|k| !missing.contains(k)).map(|k| raw(k, frequency_hz, phase, switches, n));
    drive::run(&mut drive::unit(&calibration), &[Owned::Gyro(ticks.collect())])
}

/// Accumulated error of the published ticks from `from` to `to`, about the first axis (rad).
fn error(out: &[CorrectedTick], from: u64, to: u64, frequency_hz: f64, phase: f64) -> f64 {
    let published = out.iter().filter(|tick| (from..=to).contains(&tick.sequence));
    published.map(|tick| tick.delta_angle[0] - truth(tick.sequence, frequency_hz, phase)).sum()
}

/// Root mean square over phase (″).
fn rms_over_phase(error_at: impl Fn(f64) -> f64) -> f64 {
    let sum: f64 = (0..PHASES).map(|i| error_at(TAU * f64::from(i) / f64::from(PHASES)).powi(2)).sum();
    (sum / f64::from(PHASES)).sqrt() / ARCSEC
}

#[test]
fn i5_the_reference_table_is_reproduced_through_the_whole_state_machine() {
    // models §5: 1° amplitude, 5 ms, n = 3; constant, linear, parabola after step 2, then after step 4 (″).
    let table = [
        (1.0, [26.35, 1.380, 0.053, 0.000_27]),
        (5.0, [642.9, 169.7, 32.68, 0.842]),
        (10.0, [2381.0, 1288.0, 503.8, 25.96]),
    ];
    let (first, last) = (LAST_GOOD + 1, LAST_GOOD + 3);
    for (frequency, figures) in table {
        for (degree, expected) in (0_u8..).zip(&figures[..3]) {
            let parts = ReversalParts { predict_degree: degree, ..ReversalParts::default() };
            let got = rms_over_phase(|phase| {
                error(&run(parts, frequency, phase, &[first], &[]), first, last, frequency, phase)
            });
            assert!(
                (got / expected - 1.0).abs() < 0.01,
                "{frequency} Hz, degree {degree}: {got} ″, table {expected} ″"
            );
        }
        let got = rms_over_phase(|phase| {
            let out = run(ReversalParts::default(), frequency, phase, &[first], &[]);
            error(&out, first, TICKS, frequency, phase)
        });
        let expected = figures[3];
        assert!(
            (got / expected - 1.0).abs() < 0.02,
            "{frequency} Hz, after step 4: {got} ″, table {expected} ″"
        );
    }
}

#[test]
fn i5_the_restored_angle_does_not_depend_on_how_the_prediction_was_made() {
    let first = LAST_GOOD + 1;
    let sums = [0, 1, 2].map(|predict_degree| {
        let parts = ReversalParts { predict_degree, ..ReversalParts::default() };
        error(&run(parts, 5.0, 0.3, &[first], &[]), first, TICKS, 5.0, 0.3)
    });
    assert!((sums[0] - sums[2]).abs() < 1e-15 && (sums[1] - sums[2]).abs() < 1e-15, "{sums:?}");
}

#[test]
fn i5_shorter_transitions_are_bridged_too() {
    let first = LAST_GOOD + 1;
    for n in 1..=3 {
        let parts = ReversalParts { transition: Transition::Ticks(n), ..ReversalParts::default() };
        let out = run(parts, 1.0, 0.7, &[first], &[]);
        assert_eq!(out.iter().filter(|t| t.flags.contains(TickFlags::INTERPOLATED)).count(), usize::from(n));
        let restored: Vec<_> = out.iter().filter(|t| t.flags.contains(TickFlags::ANGLE_RESTORED)).collect();
        assert_eq!(restored.len(), 1);
        assert_eq!(restored[0].sequence, LAST_GOOD + u64::from(n) + 3, "the correction goes into j = n + 3");
        assert!(error(&out, first, TICKS, 1.0, 0.7).abs() < 0.001 * ARCSEC);
    }
}

#[test]
fn i5_what_a_gyro_reads_in_a_transition_is_beyond_no_range() {
    let mut parts = mode_reversed(ReversalParts::default());
    for gyro in &mut parts.gyros {
        gyro.increment_weight_over_rate =
            Some(CurveParts::PiecewiseLinear { knots: vec![[-1.0, 1e-6], [1.0, 2e-6]] });
    }
    let ticks: Vec<_> = (0..TICKS).map(|k| raw(k, 1.0, 0.7, &[LAST_GOOD + 1], 3)).collect();
    let out = drive::run(&mut drive::unit(&compile(&parts)), &[Owned::Gyro(ticks)]);
    for tick in &out {
        let clamped = tick.gyro_flags.iter().any(|flags| flags.contains(SensorFlags::CLAMPED_RATE));
        assert!(!clamped, "tick {}: {:?}", tick.sequence, tick.flags);
    }
    assert_eq!(out.iter().filter(|tick| tick.flags.contains(TickFlags::INTERPOLATED)).count(), 3);
}

#[test]
fn i5_a_switch_during_a_gap() {
    // The command and one more tick of the transition are lost: the published ticks still add up to the two-sided fit.
    let first = LAST_GOOD + 1;
    for missing in [
        vec![first],
        vec![first, first + 1],
        vec![first - 1, first],
        vec![first + 1],
        vec![first + 4],
        vec![first + 3, first + 4],
    ] {
        let got = rms_over_phase(|phase| {
            let out = run(ReversalParts::default(), 1.0, phase, &[first], &missing);
            let announced: u64 = out.iter().map(|tick| tick.missed).sum();
            assert_eq!(announced, missing.len() as u64);
            assert_eq!(out.len() as u64, TICKS - announced);
            error(&out, 0, TICKS, 1.0, phase)
        });
        assert!(got < 0.02, "missing {missing:?}: {got} ″ rms");
    }
}

#[test]
fn i5_two_switches_ten_ticks_apart() {
    let switches = [LAST_GOOD + 1, LAST_GOOD + 11];
    for (frequency, limit) in [(1.0, 0.001), (5.0, 2.0)] {
        let got = rms_over_phase(|phase| {
            let out = run(ReversalParts::default(), frequency, phase, &switches, &[]);
            assert_eq!(out.iter().filter(|t| t.flags.contains(TickFlags::ANGLE_RESTORED)).count(), 2);
            assert_eq!(out.iter().filter(|t| t.flags.contains(TickFlags::INTERPOLATED)).count(), 6);
            error(&out, 0, TICKS, frequency, phase)
        });
        assert!(got < limit, "{frequency} Hz: {got} ″ rms");
    }
}

#[test]
fn i5_the_mode_dependent_bias_leaves_no_trace() {
    // At rest the magnetic bias changes its sign at the switch; fitted over it, it would look like motion.
    let first = LAST_GOOD + 1;
    let calibration = compile(&mode_reversed(ReversalParts::default()));
    let ticks = (0..TICKS).map(|k| {
        let mode = if k < first { LasingMode::Plus } else { LasingMode::Minus };
        let rates = [1.0, -0.5, 2.0].map(|share| mode.sign() * share * MAGNETIC_BIAS_RAD_PER_S);
        GyroTick { mode: Some(mode), switch_command: k == first, ..streams::gyro(k, &rates) }
    });
    let out = drive::run(&mut drive::unit(&calibration), &[Owned::Gyro(ticks.collect())]);
    // The first tick comes before any temperature, when the terms stand at their reference.
    for tick in out.iter().filter(|tick| tick.sequence > 0) {
        assert!(tick.delta_angle.iter().all(|angle| angle.abs() < 1e-17), "{tick:?}");
    }
}

#[test]
fn i5_a_gyro_that_is_held_back_loses_nothing_and_the_next_two_ticks_are_flagged_too() {
    let parts = ReversalParts::default();
    let calibration = |delay_ticks| {
        let mut stated = mode_reversed(parts);
        stated.gyros[1].delay_ticks = delay_ticks;
        compile(&stated)
    };
    let n = u64::from(parts.transition.ticks(Span::from_s(TICK_S)));
    let ticks: Vec<_> = (0..TICKS).map(|k| raw(k, 1.0, 0.3, &[LAST_GOOD + 1], n)).collect();
    let [plain, held] = [0.0, 0.6]
        .map(|delay| drive::run(&mut drive::unit(&calibration(delay)), &[Owned::Gyro(ticks.clone())]));
    let angle = |out: &[CorrectedTick]| out.iter().map(|tick| tick.delta_angle[0]).sum::<f64>();
    // The first tick is taken to go on what was before it; the last one holds part of itself back.
    let (first, before, last) = (&plain[0], &plain[plain.len() - 2], &plain[plain.len() - 1]);
    let step = last.delta_angle[0] - before.delta_angle[0];
    let ends = 0.6 * (first.delta_angle[0] - last.delta_angle[0]) - 0.5 * 0.6 * 0.4 * step;
    assert!((angle(&held) - angle(&plain) - ends).abs() < 1e-15, "{} {}", angle(&held), angle(&plain));
    let marked = |out: &[CorrectedTick]| {
        let marks = TickFlags::INTERPOLATED | TickFlags::ANGLE_RESTORED;
        let marked = out.iter().filter(|tick| tick.flags.intersects(marks));
        marked.map(|tick| tick.sequence).collect::<Vec<_>>()
    };
    let (plain, held) = (marked(&plain), marked(&held));
    assert!(plain.iter().all(|k| held.contains(k)), "{plain:?} {held:?}");
    assert_eq!(held.last().copied(), plain.last().map(|k| k + 2), "{plain:?} {held:?}");
}

#[test]
fn i5_a_gyro_that_is_not_used_has_no_part_in_the_bridge() {
    let (parts, switches, n) = (ReversalParts::default(), [LAST_GOOD + 1], 3);
    let restored = LAST_GOOD + n + 3;
    let mut three = mode_reversed(parts);
    three.gyros.iter_mut().for_each(|gyro| gyro.input_limit = 1.0);
    let mut four = three.clone();
    four.gyros.push(GyroParts { input_limit: 1.0, ..plain_gyro() });
    let skewed = 3_f64.sqrt().recip();
    four.gyro_orientation = orientation(&[ALONG_CASE_AXES.as_slice(), &[[skewed; 3]]].concat());
    let run = |parts, gyro: usize, reads: f64, from: u64, to: u64| {
        let ticks = (0..TICKS).map(|k| {
            let mut tick = raw(k, 1.0, 0.3, &switches, n);
            if gyro == 3 {
                tick.readings.push(3_f64.sqrt() * truth(k, 1.0, 0.3) / TICK_S);
            }
            if (from..to).contains(&k) {
                tick.readings[gyro] = reads;
            }
            tick
        });
        drive::run(&mut drive::unit(&compile(parts)), &[Owned::Gyro(ticks.collect())])
    };
    let flags = |out: &[CorrectedTick]| out.iter().fold(TickFlags::empty(), |all, tick| all | tick.flags);
    for reads in [f64::NAN, 5.0, -1e9] {
        for (from, to) in [(18, 19), (20, 21), (16, 21), (24, 25), (24, 26), (24, 60), (26, 27), (0, 60)] {
            let out = run(&four, 3, reads, from, to);
            let error = error(&out, LAST_GOOD, restored, 1.0, 0.3) / ARCSEC;
            assert!(error.abs() < 1.0, "{reads} in {from}…{to}: {error}″");
            assert!(!flags(&out).intersects(TickFlags::SWITCH_UNRESOLVED | TickFlags::ANGLE_INVALID));
            let at = |tick: &&CorrectedTick| tick.sequence == restored;
            let used = out.iter().find(at).unwrap().gyro_flags[3].contains(SensorFlags::VALID);
            assert_eq!(used, ![(16, 21), (24, 26), (24, 60), (26, 27), (0, 60)].contains(&(from, to)));
        }
        // The other two do not do without.
        let unresolved = run(&three, 0, reads, 10, 60);
        let unresolved = unresolved.iter().filter(|tick| tick.flags.contains(TickFlags::SWITCH_UNRESOLVED));
        assert_eq!(unresolved.map(|tick| tick.sequence).collect::<Vec<_>>(), [21, 22, 23, restored]);
    }
}
