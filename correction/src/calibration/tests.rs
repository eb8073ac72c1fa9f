//! The checks between parts, and the comparison of two calibrations against what the state machine does under them.

use alloc::sync::Arc;
use alloc::vec;
use alloc::vec::Vec;

use super::*;
use crate::channel::{ChannelParts, ThermalFilterParts, ThermalState};
use crate::curve::CurveParts;
use crate::drift::DriftParts;
use crate::operation::{SelfTestCounter, SelfTestVoltage};
use crate::orientation::OrientationParts;
use crate::reversal::ReversalParts;
use crate::sample::{AccelTick, ChannelName, CorrectedTick, GyroTick, LasingMode, TemperatureReading};
use crate::thermal::Feature;
use crate::unit::{Event, Unit, UnitSettings};
use crate::units::{AngularRate, STANDARD_GRAVITY_M_PER_S2, Span, Timestamp};

const EARTH_RATE_RAD_PER_S: f64 = 7.292e-5;
const TICK: Span = Span::from_ns(100_000_000);

fn polynomial(coefficients: &[f64], range: [f64; 2]) -> CurveParts {
    CurveParts::Polynomial { reference: 20.0, coefficients: coefficients.to_vec(), range }
}

fn deg_per_h(value: f64) -> f64 {
    AngularRate::from_deg_per_h(value).as_rad_per_s()
}

fn channel(name: &str) -> ChannelParts {
    ChannelParts {
        name: ChannelName::from(name).unwrap(),
        conversion: vec![0.0, 1.0],
        range_deg_c: [-100.0, 150.0],
        spike_limit_deg_c: 20.0,
    }
}

fn axes(rows: &[[f64; 3]], range_deg_c: [f64; 2]) -> OrientationParts {
    OrientationParts {
        reference_deg_c: 20.0,
        rows: rows.to_vec(),
        slopes_per_deg_c: vec![[0.0, 2e-6, -1e-6], [1e-6, 0.0, 3e-6], [-2e-6, 1e-6, 0.0]],
        plays: vec![],
        weights: Vec::new(),
        range_deg_c,
        parity_limit: None,
        parity_confirm_ticks: 1,
    }
}

/// Three gyros on channel "block" with every thermal term, three accelerometers on "accel" and "board".
fn parts() -> CalibrationParts {
    let gyro = |c0: f64| GyroParts {
        channel: Some(0),
        increment_weight: 1.001,
        input_limit: 10.0,
        terms: vec![
            TermParts::new(Feature::Reading, polynomial(&[0.0, 2e-6], [-40.0, 70.0])),
            TermParts::new(Feature::One, polynomial(&[deg_per_h(c0), deg_per_h(0.02)], [-50.0, 60.0])),
            TermParts::new(
                Feature::LasingMode,
                polynomial(&[deg_per_h(3.0), deg_per_h(0.01)], [-45.0, 80.0]),
            ),
            TermParts::new(Feature::Meander, polynomial(&[deg_per_h(0.1)], [-60.0, 90.0])),
            TermParts::branched(
                Feature::ThermalRate,
                BranchedParts {
                    argument: BranchArgument::Derivative,
                    run_up: polynomial(&[deg_per_h(100.0)], [-1.0, 1.0]),
                    braking: polynomial(&[deg_per_h(80.0)], [-1.0, 1.0]),
                },
            ),
            TermParts::lag(30.0, polynomial(&[deg_per_h(40.0)], [-60.0, 90.0])),
        ],
        increment_weight_over_rate: None,
        trend: Some(TrendParts { coefficients: vec![deg_per_h(0.5), 1e-10], interval_s: [0.0, 10.0] }),
        servo: None,
        drift: None,
        delay_ticks: 0.0,
        sigma: None,
    };
    let accel = |bias: f64| AccelParts {
        channel: Some(1),
        board_channel: Some(2),
        scale_factor: polynomial(&[2.0, 1e-4], [-40.0, 65.0]),
        terms: vec![TermParts::new(Feature::One, polynomial(&[bias, 1e-4], [-35.0, 70.0]))],
        board_ratio: Some(polynomial(&[1.0, 2e-5], [-30.0, 85.0])),
        position_m: [0.0; 3],
        input_limit: 1e3,
        delay_ticks: 0.0,
        sigma: None,
    };
    CalibrationParts {
        filter: ThermalFilterParts {
            grid_step_s: 1.0,
            smoothing_s: 1.0,
            derivative_step_s: 1.0,
            stale_after_s: 60.0,
            branch_dead_band: 1e-6,
            assumed_deg_c: 20.0,
        },
        channels: vec![channel("block"), channel("accel"), channel("board"), channel("spare")],
        auxiliaries: Vec::new(),
        gyro_output: OutputKind::Mean,
        gyros: vec![gyro(1.0), gyro(-2.0), gyro(0.5)],
        gyro_orientation: axes(
            &[[0.999_999, 1.4e-3, 0.0], [0.0, 1.0, 0.0], [0.0, -1e-3, 0.999_999_5]],
            [-40.0, 58.0],
        ),
        gyro_orientation_channels: vec![0],
        accel_output: OutputKind::Mean,
        accels: vec![accel(0.02), accel(-0.03), accel(0.01)],
        accel_orientation: Some(axes(&[[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], [-40.0, 60.0])),
        accel_orientation_channels: vec![1, 2],
        reversal: Some(ReversalParts::default()),
        self_test: SelfTestParts::default(),
    }
}

fn compile(parts: &CalibrationParts) -> Calibration {
    Calibration::new(parts).unwrap()
}

/// Last corrected tick of a unit whose sensors read the same throughout, while its temperatures rise by `ramp` °C/s
/// from 10 °C, and its channels' state at the end.
fn settled(
    calibration: &Calibration,
    gyros: [f64; 3],
    accels: [f64; 3],
    ramp: f64,
) -> (CorrectedTick, Vec<(ChannelName, ThermalState)>) {
    let mut unit = Unit::new(UnitSettings::default());
    unit.install(Arc::new(calibration.clone()), 1);
    let mut last = CorrectedTick::default();
    let mut emit = |tick: &CorrectedTick| last = tick.clone();
    for second in 0..400_i32 {
        let start = Timestamp::from_ns(i64::from(second) * 1_000_000_000);
        let readings = ["block", "accel", "board"].map(|name| TemperatureReading {
            channel: ChannelName::from(name).unwrap(),
            time: start,
            raw: 10.0 + ramp * f64::from(second),
        });
        unit.handle(Event::Temperature(&readings), &mut emit);
        for tick in 0..10_i32 {
            let sequence = u64::try_from(second * 10 + tick).unwrap();
            let end_time = start + Span::from_ns(i64::from(tick + 1) * TICK.as_ns());
            let accel =
                AccelTick { sequence, end_time, duration: TICK, readings: accels.into_iter().collect() };
            unit.handle(Event::Accel { output: OutputKind::Mean, ticks: &[accel] }, &mut emit);
            let gyro = GyroTick {
                sequence,
                end_time,
                duration: TICK,
                readings: gyros.into_iter().collect(),
                mode: Some(LasingMode::Minus),
                ..GyroTick::default()
            };
            unit.handle(Event::Gyro { output: OutputKind::Mean, ticks: &[gyro] }, &mut emit);
        }
    }
    unit.handle(Event::Flush, &mut emit);
    let states = unit.channels().filter_map(|channel| Some((channel.name, channel.state?))).collect();
    (last, states)
}

/// Mean rate (rad/s) and specific force (m/s²) of a tick.
fn outputs(tick: &CorrectedTick) -> ([f64; 3], [f64; 3]) {
    let duration_s = tick.duration.as_s();
    (tick.delta_angle.map(|angle| angle / duration_s), tick.delta_velocity.map(|v| v / duration_s))
}

fn steady(calibration: &Calibration, states: &[(ChannelName, ThermalState)]) -> Steady {
    let state = |name: &ChannelName| states.iter().find(|(n, _)| n == name).map(|(_, state)| *state);
    calibration.steady(state, Some(LasingMode::Minus))
}

#[test]
fn the_steady_correction_is_what_the_state_machine_subtracts_on_a_long_ramp() {
    let calibration = compile(&parts());
    // A sensor that reads nothing shows what is subtracted.
    let (tick, states) = settled(&calibration, [0.0; 3], [0.0; 3], 0.05);
    let (rate, force) = outputs(&tick);
    let steady = steady(&calibration, &states);
    for axis in 0..3 {
        // The state machine is up to one reading behind: 0.05 °C of 0.03 °/h per °C.
        let (got, want) = (steady.gyro_rate_in_case[axis], -rate[axis]);
        assert!((got - want).abs() < deg_per_h(0.003), "gyro axis {axis}: {got} {want}");
        let (got, want) = (steady.accel_force_in_case[axis], -force[axis]);
        assert!((got - want).abs() < 1e-5, "accelerometer axis {axis}: {got} {want}");
    }
    // Lag, rate, trend and both signs are in it: none of them is small.
    assert!(
        (steady.gyro_bias[0] - deg_per_h(1.0 + 0.2 + 4.5 + 1.967 - 3.1 + 0.1 + 0.5)).abs() < deg_per_h(0.01)
    );
    assert!((steady.accel_scale[0] - 2.001 / 1.0002).abs() < 1e-5);
}

#[test]
fn a_jump_bounds_the_step_of_the_output_at_every_attitude_and_is_met_at_one() {
    let before = parts();
    let mut after = before.clone();
    after.gyros[0].increment_weight *= 1.0 + 3e-3;
    after.gyros[1].terms[1] = TermParts::new(Feature::One, polynomial(&[deg_per_h(-1.99)], [-50.0, 60.0]));
    after.gyro_orientation.rows[2] = [0.0, 1e-3, 0.999_999_5];
    after.accels[0].scale_factor = polynomial(&[2.004, 1e-4], [-40.0, 65.0]);
    after.accels[2].terms[0] = TermParts::new(Feature::One, polynomial(&[0.0101, 1e-4], [-35.0, 70.0]));
    let (before, after) = (compile(&before), compile(&after));
    let (_, states) = settled(&before, [0.0; 3], [0.0; 3], 0.0);
    let (old, new) = (steady(&before, &states), steady(&after, &states));
    let jump = old.jump(&new).unwrap();

    let mut largest = ([0.0_f64; 3], [0.0_f64; 3]);
    for attitude in 0..60 {
        // Spread over the sphere.
        let z = -1.0 + (2.0 * f64::from(attitude) + 1.0) / 60.0;
        let (radius, turn) = (libm::sqrt(1.0 - z * z), 2.4 * f64::from(attitude));
        let up = [radius * libm::cos(turn), radius * libm::sin(turn), z];
        let dot = |row: &[f64; 3]| row[0] * up[0] + row[1] * up[1] + row[2] * up[2];
        // What the sensors read for it, if the first calibration is right.
        let gyros = [0, 1, 2]
            .map(|i| (EARTH_RATE_RAD_PER_S * dot(&old.gyro_axes[i]) + old.gyro_bias[i]) / old.gyro_weight[i]);
        let accels = [0, 1, 2].map(|i| {
            (STANDARD_GRAVITY_M_PER_S2 * dot(&old.accel_axes[i]) + old.accel_bias[i]) * old.accel_scale[i]
        });
        let (rate, force) = outputs(&settled(&before, gyros, accels, 0.0).0);
        let (next_rate, next_force) = outputs(&settled(&after, gyros, accels, 0.0).0);
        for axis in 0..3 {
            largest.0[axis] = largest.0[axis].max((next_rate[axis] - rate[axis]).abs());
            largest.1[axis] = largest.1[axis].max((next_force[axis] - force[axis]).abs());
        }
    }
    for axis in 0..3 {
        for (largest, bound, dust) in [
            (largest.0[axis], jump.angular_rate[axis].abs(), 1e-12),
            (largest.1[axis], jump.specific_force[axis].abs(), 1e-9),
        ] {
            assert!(largest <= bound * 1.0001 + dust, "axis {axis}: {largest} beyond {bound}");
            assert!(largest >= bound * 0.9 - dust, "axis {axis}: {largest} far below {bound}");
        }
    }
    assert!(jump.angular_rate.iter().chain(&jump.specific_force).all(|step| step.abs() > 1e-9), "{jump:?}");
}

#[test]
fn the_same_calibration_makes_no_jump_and_other_sensors_have_none() {
    let calibration = compile(&parts());
    let here = calibration.steady(|_| None, None);
    let jump = here.jump(&here.clone()).unwrap();
    assert!(jump.angular_rate.iter().all(|step| step.abs() < 1e-18), "{jump:?}");
    assert!(jump.specific_force.iter().all(|step| step.abs() < 1e-14), "{jump:?}");

    let mut gyros_only = parts();
    gyros_only.accels.clear();
    gyros_only.accel_orientation = None;
    gyros_only.accel_orientation_channels.clear();
    let gyros_only = compile(&gyros_only).steady(|_| None, None);
    assert_eq!(here.jump(&gyros_only), None);
    assert_eq!(gyros_only.jump(&gyros_only.clone()).unwrap().specific_force, [0.0; 3]);
    let mut counts = parts();
    counts.gyro_output = OutputKind::Counts;
    assert_eq!(here.jump(&compile(&counts).steady(|_| None, None)), None);
}

#[test]
fn the_range_of_a_channel_is_what_all_its_curves_have_in_common() {
    let calibration = compile(&parts());
    // Bias up to 60, weight from -40, axes up to 58; K1 is over the rate and says nothing about temperature.
    assert_eq!(calibration.range_of(0), Some([-40.0, 58.0]));
    assert_eq!(calibration.range_of(1), Some([-35.0, 60.0]));
    assert_eq!(calibration.range_of(2), Some([-30.0, 60.0]));
    assert_eq!(calibration.range_of(3), None);
    assert_eq!(calibration.range_of(4), None);
    let at = |block: f64| {
        calibration.steady(
            |name| {
                let temperature = if name == "block" { block } else { -32.0 };
                Some(ThermalState { temperature, ..ThermalState::default() })
            },
            None,
        )
    };
    assert_eq!(at(58.0).outside, [2]);
    assert_eq!(at(58.1).outside, [0, 2]);
    // What is outside is what the state machine flags.
    let mut constant = parts();
    for gyro in &mut constant.gyros {
        *gyro = GyroParts {
            terms: vec![TermParts::new(
                Feature::One,
                CurveParts::Polynomial { reference: 0.0, coefficients: vec![1e-6], range: [-1e9, 1e9] },
            )],
            ..gyro.clone()
        };
    }
    constant.gyro_orientation_channels.clear();
    assert_eq!(compile(&constant).range_of(0), None);
}

#[test]
fn what_the_drift_estimator_expects_is_no_part_of_the_thermal_memory() {
    let mut with_drift = parts();
    with_drift.gyros[1].drift = Some(DriftParts {
        sigma_rad_per_s: deg_per_h(0.003),
        correlation_time_s: 3e4,
        trend_sigma_rad_per_s2: 0.0,
        trend_correlation_time_s: 1e5,
        initial_sigma_rad_per_s: deg_per_h(0.05),
        angle_random_walk_rad_per_sqrt_s: 1e-7,
    });
    let (plain, with_drift) = (compile(&parts()), compile(&with_drift));
    assert!(plain.same_thermal_basis(&with_drift));
    assert_eq!(plain.gyros, with_drift.gyros);
    assert_ne!(plain, with_drift);
    assert_eq!((with_drift.drift(0), with_drift.drift(8)), (None, None));
    assert!(with_drift.drift(1).is_some());
}

#[test]
fn a_scale_factor_that_crosses_zero_anywhere_is_refused() {
    for (knots, sound) in [
        (vec![[-40.0, 2.0], [19.9, 2.0], [20.0, -0.1], [20.1, 2.0], [65.0, 2.0]], false),
        (vec![[-40.0, 2.0], [19.9, 2.0], [20.0, 0.1], [20.1, 2.0], [65.0, 2.0]], true),
        (vec![[-40.0, -2.0], [65.0, 2.0]], false),
    ] {
        let mut parts = parts();
        parts.accels[1].scale_factor = CurveParts::PiecewiseLinear { knots: knots.clone() };
        let kinds = Calibration::new(&parts).err().unwrap_or_default();
        let crosses = |defect: &Defect| {
            defect.path == "accel.sensor[1].scale_factor" && matches!(defect.kind, DefectKind::Zero { .. })
        };
        assert_eq!((kinds.is_empty(), kinds.iter().any(crosses)), (sound, !sound), "{knots:?}");
    }
}

#[test]
fn limits_of_the_self_test_and_numbers_of_the_drift_are_checked_at_once() {
    let name = |name| ChannelName::from(name).unwrap();
    let mut broken = parts();
    broken.self_test = SelfTestParts {
        voltages: vec![
            SelfTestVoltage { name: name("u"), range_v: [2.0, 1.0] },
            SelfTestVoltage { name: name("u"), range_v: [0.0, f64::INFINITY] },
            SelfTestVoltage { name: name(""), range_v: [0.0, 1.0] },
        ],
        counters: vec![SelfTestCounter { name: name("u"), max_increase: f64::NAN }; 33],
    };
    broken.gyros[2].drift = Some(DriftParts {
        sigma_rad_per_s: -1.0,
        correlation_time_s: 3e4,
        trend_sigma_rad_per_s2: 0.0,
        trend_correlation_time_s: f64::NAN,
        initial_sigma_rad_per_s: 1e-8,
        angle_random_walk_rad_per_sqrt_s: 1e-7,
    });
    let defects = Calibration::new(&broken).unwrap_err();
    let found = |path| defects.iter().filter(|defect| defect.path == path).count();
    assert_eq!(found("self_test.voltage[0].range_v"), 1);
    assert_eq!(found("self_test.voltage[1].range_v"), 1);
    assert_eq!(found("self_test.voltage[1].name"), 1);
    assert_eq!(found("self_test.voltage[2].name"), 1);
    assert_eq!(found("self_test.counter"), 1);
    assert_eq!(found("self_test.counter[0].name"), 1);
    assert_eq!(found("self_test.counter[32].max_increase"), 1);
    assert_eq!(found("gyro.sensor[2].drift.sigma"), 1);
    assert_eq!(found("gyro.sensor[2].drift.trend_correlation_time"), 1);
    assert_eq!(defects.len(), 5 + 33 + 33 + 2);
}
