//! Calibrations and short lives that several recordings begin with.

use std::sync::Arc;

use isotherm_correction::calibration::{
    BranchArgument, BranchedParts, Calibration, CalibrationParts, TrendParts,
};
use isotherm_correction::curve::CurveParts;
use isotherm_correction::orientation::OrientationParts;
use isotherm_correction::reversal::ReversalParts;
use isotherm_correction::sample::OutputKind;
use isotherm_correction::unit::UnitSettings;
use isotherm_tests::calibrations::{
    Feature, PutTerms, channel, compile, constant, identity, lively_drift, orientation, polynomial,
};
use isotherm_tests::script::{Scenario, Script};

/// Channels of [`rich`], with a raw value each.
pub(crate) const RICH_CHANNELS: [(&str, f64); 2] = [("t", 24.0), ("board", 30.0)];

/// A scenario of a script under the settings that a unit has where nothing is said.
pub(crate) fn told(script: Script) -> Scenario {
    script.scenario("", UnitSettings::default(), Vec::new())
}

/// Three gyros and three accelerometers with every term that there is, on a quick thermal filter; `tweak` is what differs.
pub(crate) fn rich_parts(tweak: f64) -> CalibrationParts {
    let mut parts = identity();
    parts.channels.push(channel("board"));
    parts.filter.grid_step_s = 0.05;
    parts.filter.smoothing_s = 0.2;
    parts.filter.derivative_step_s = 0.1;
    parts.filter.stale_after_s = 0.5;
    parts.reversal = Some(ReversalParts::default());
    for (i, gyro) in (0..3).zip(&mut parts.gyros) {
        gyro.increment_weight = 1.0 + 1e-3 * f64::from(i);
        gyro.terms.curve(Feature::Reading, polynomial(&[1e-5 * (1.0 + tweak), 2e-6]));
        gyro.terms.curve(Feature::One, polynomial(&[1e-4 * (1.0 + tweak), 1e-5, -1e-6 * f64::from(i)]));
        gyro.terms.curve(Feature::LasingMode, polynomial(&[2e-4, 3e-6]));
        gyro.terms.curve(Feature::Meander, polynomial(&[4e-5, 1e-6]));
        gyro.trend = Some(TrendParts { coefficients: vec![1e-5, 2e-6, -1e-6], interval_s: [0.5, 4.0] });
        gyro.terms.branched(
            Feature::ThermalRate,
            BranchedParts {
                argument: if i == 0 { BranchArgument::Derivative } else { BranchArgument::Temperature },
                run_up: polynomial(&[1e-4, 1e-6]),
                braking: polynomial(&[-2e-4, 3e-6]),
            },
        );
        gyro.terms.branched(
            Feature::ThermalAcceleration,
            BranchedParts {
                argument: if i == 1 { BranchArgument::Derivative } else { BranchArgument::Temperature },
                run_up: CurveParts::PiecewiseLinear {
                    knots: [[-60.0, 1e-5], [24.1, 4e-5], [100.0, 2e-5]].into(),
                },
                braking: CurveParts::Spline {
                    knots: [[-60.0, 1e-5], [24.0, -4e-5], [30.0, 2e-5], [99.0, 0.0]].into(),
                },
            },
        );
        gyro.terms.lags([0.3, 2.0].map(|time_constant_s| (time_constant_s, polynomial(&[1e-4, 1e-6]))));
    }
    for (i, accel) in (0..3).zip(&mut parts.accels) {
        accel.scale_factor = polynomial(&[1.01, 1e-4 * f64::from(i)]);
        accel.terms.curve(Feature::One, polynomial(&[0.01 * (1.0 + tweak), 1e-4]));
        accel.board_channel = Some(1);
        accel.board_ratio = Some(polynomial(&[1.0, 2e-5]));
        accel.terms.lags([(0.4, constant(1e-3))]);
    }
    parts.gyro_orientation.slopes_per_deg_c = vec![[1e-6, -2e-6, 3e-6]; 3];
    parts.accel_orientation.as_mut().unwrap().slopes_per_deg_c = vec![[-1e-6, 1e-6, 2e-6]; 3];
    parts.accel_orientation_channels = vec![0, 1];
    parts
}

pub(crate) fn rich(tweak: f64) -> Arc<Calibration> {
    compile(&rich_parts(tweak))
}

/// The life of a unit with it.
pub(crate) fn rich_script(seed: u64) -> Script {
    let mut script = Script::new(seed, &rich(0.0), &RICH_CHANNELS);
    (script.warming, script.swing) = (0.02, 30.0);
    script
}

/// What a unit with counting sensors has: one of its own for gyros and accelerometers.
pub(crate) fn with_outputs(
    mut parts: CalibrationParts,
    gyro: OutputKind,
    accel: OutputKind,
) -> CalibrationParts {
    (parts.gyro_output, parts.accel_output) = (gyro, accel);
    for sensor in &mut parts.gyros {
        let counts = gyro == OutputKind::Counts;
        (sensor.increment_weight, sensor.input_limit) = if counts { (4.8e-6, 7300.0) } else { (1.001, 5.0) };
    }
    for sensor in &mut parts.accels {
        let counts = accel == OutputKind::Counts;
        sensor.input_limit = if counts { 980.0 } else { 200.0 };
        if counts {
            sensor.scale_factor = polynomial(&[1020.0, 0.1]);
            sensor.terms.curve(Feature::One, polynomial(&[30.0, 0.2]));
        }
    }
    parts
}

/// No accelerometers.
pub(crate) fn without_accels(mut parts: CalibrationParts) -> CalibrationParts {
    parts.accels.clear();
    parts.accel_orientation = None;
    parts.accel_orientation_channels.clear();
    parts
}

/// Input axes of eight sensors. Roots are the same on every machine, sines need not be.
fn rows() -> [[f64; 3]; 8] {
    let third = (1.0_f64 / 3.0).sqrt();
    let half = 0.5_f64.sqrt();
    [
        [1.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [0.0, 0.0, 1.0],
        [third, third, third],
        [-half, half, 0.0],
        [half, 0.0, -half],
        [0.0, 0.6, 0.8],
        [-0.8, 0.0, 0.6],
    ]
}

/// So many gyros and accelerometers about the case axes, watched by parity, each with a bias of its own.
pub(crate) fn redundant(sensors: u8, confirm_ticks: u32) -> Arc<Calibration> {
    let mut parts = identity();
    let rows = rows();
    let rows = &rows[..usize::from(sensors)];
    let watched = |limit| OrientationParts {
        slopes_per_deg_c: vec![[2e-6, -1e-6, 1e-6]; rows.len()],
        weights: (0..sensors).map(|i| 1.0 + 0.1 * f64::from(i)).collect(),
        parity_limit: Some(limit),
        parity_confirm_ticks: confirm_ticks,
        ..orientation(rows)
    };
    parts.filter.grid_step_s = 0.05;
    parts.filter.smoothing_s = 0.1;
    parts.gyros = vec![parts.gyros[0].clone(); rows.len()];
    parts.accels = vec![parts.accels[0].clone(); rows.len()];
    for (i, gyro) in (0..sensors).zip(&mut parts.gyros) {
        gyro.terms.curve(Feature::One, polynomial(&[1e-5 * f64::from(i), 1e-7]));
        gyro.drift = (i % 2 == 0).then(lively_drift);
    }
    (parts.gyro_orientation, parts.accel_orientation) = (watched(0.05), Some(watched(0.5)));
    compile(&parts)
}

/// The life of a unit with [`redundant`] sensors, whose accelerometers agree with each other.
pub(crate) fn redundant_script(seed: u64, sensors: u8, confirm_ticks: u32) -> Script {
    let mut script = Script::new(seed, &redundant(sensors, confirm_ticks), &[("t", 23.0)]);
    script.forces = rows().map(|[_, _, down]| -9800.0 * down).to_vec();
    (script.swing, script.batch) = (0.0, 3);
    script
}

/// Frames of a hundred plain ticks, ten in each.
pub(crate) fn frames() -> Vec<Vec<u8>> {
    let mut script = rich_script(1);
    script.batch = 10;
    script.ticks(100);
    let scenario = told(script);
    let mut stream = scenario.stream();
    let (mut frames, mut frame) = (Vec::new(), Vec::new());
    for step in &scenario.steps {
        crate::recording::give(&mut stream, step);
        while stream.next_frame(&mut frame).is_some() {
            frames.push(frame.clone());
        }
    }
    frames
}
