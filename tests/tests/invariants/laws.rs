//! Laws of the correction, over random calibrations.

use isotherm_correction::calibration::{BranchArgument, BranchedParts, CalibrationParts};
use isotherm_correction::curve::CurveParts;
use isotherm_correction::sample::CorrectedTick;
use isotherm_tests::calibrations::{
    Feature, PutTerms, compile, constant, identity, orientation, plain_accel, plain_gyro, polynomial,
};
use isotherm_tests::drive::{self, Owned};
use isotherm_tests::streams::{accel, gyro, temperature};
use nalgebra::Vector3;
use proptest::prelude::*;

const TICK_S: f64 = 0.005;
/// Tick whose output is judged: the temperature of tick 0 is in use, and has ceased to move.
const JUDGED: u64 = 500;

/// Gives a steady state: one temperature, the same readings for ever.
fn steady(parts: &CalibrationParts, celsius: f64, rates: &[f64], outputs: &[f64]) -> CorrectedTick {
    let mut events = vec![Owned::Temperature(vec![temperature(0, celsius)])];
    for k in [0, 1, JUDGED] {
        if !parts.accels.is_empty() {
            events.push(Owned::Accel(vec![accel(k, outputs)]));
        }
        events.push(Owned::Gyro(vec![gyro(k, rates)]));
    }
    let out = drive::run(&mut drive::unit(&compile(parts)), &events);
    out.last().cloned().expect("the judged tick")
}

fn close(got: [f64; 3], expected: [f64; 3], bound: f64) -> bool {
    got.iter().zip(expected).all(|(got, expected)| (got - expected).abs() <= bound)
}

/// A unit vector near one of the case axes, or anywhere for the sensors beyond the third.
fn input_axis(index: usize, tilt: [f64; 3]) -> [f64; 3] {
    let skewed = [[1.0, 1.0, 1.0], [-1.0, 1.0, 1.0], [1.0, -1.0, 1.0], [1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]];
    let along = match index {
        0 => [1.0, 0.0, 0.0],
        1 => [0.0, 1.0, 0.0],
        2 => [0.0, 0.0, 1.0],
        _ => skewed[index - 3],
    };
    (Vector3::from(along) + 0.1 * Vector3::from(tilt)).normalize().into()
}

prop_compose! {
    /// Sensors of one kind: axes, and for each (weight or scale, its slope, bias, bias slope, bias curvature).
    fn sensors()(count in 3_usize..=8)(
        tilts in prop::collection::vec(prop::array::uniform3(-1.0..1.0), count),
        terms in prop::collection::vec((0.5..2.0, -1e-4..1e-4, -1e-3..1e-3, -1e-5..1e-5, -1e-7..1e-7), count),
    ) -> (Vec<[f64; 3]>, Vec<(f64, f64, f64, f64, f64)>) {
        (tilts.iter().enumerate().map(|(i, &tilt)| input_axis(i, tilt)).collect(), terms)
    }
}

proptest! {
    #[test]
    fn identity_calibration_is_identity(
        rates in prop::array::uniform3(-10.0..10.0), forces in prop::array::uniform3(-100.0..100.0), celsius in -50.0..90.0,
    ) {
        let tick = steady(&identity(), celsius, &rates, &forces);
        prop_assert!(close(tick.delta_angle, rates.map(|rate| rate * TICK_S), 1e-17 * 10.0));
        prop_assert!(close(tick.delta_velocity, forces.map(|force| force * TICK_S), 1e-16 * 10.0));
    }

    /// correct(distort(x)) = x within 10⁻¹² of full scale, for any valid calibration.
    #[test]
    fn correction_undoes_distortion(
        (gyro_axes, gyro_terms) in sensors(),
        (accel_axes, accel_terms) in sensors(),
        rate in prop::array::uniform3(-5.0..5.0),
        force in prop::array::uniform3(-20.0..20.0),
        celsius in -50.0..90.0,
    ) {
        let tau: f64 = celsius - 20.0;
        let mut parts = identity();
        parts.gyro_orientation = orientation(&gyro_axes);
        parts.accel_orientation = Some(orientation(&accel_axes));
        parts.gyros.clear();
        parts.accels.clear();
        // The distortion, in the physical direction: input axis, then scale, then bias.
        let mut rates = Vec::new();
        for (axis, &(weight, weight_slope, b0, b1, b2)) in gyro_axes.iter().zip(&gyro_terms) {
            let mut sensor = plain_gyro();
            sensor.increment_weight = weight;
            sensor.terms.curve(Feature::Reading, polynomial(&[0.0, weight_slope]));
            sensor.terms.curve(Feature::One, polynomial(&[b0, b1, b2]));
            parts.gyros.push(sensor);
            let along = Vector3::from(*axis).dot(&Vector3::from(rate));
            let bias = b0 + b1 * tau + b2 * tau * tau;
            rates.push((along + bias) / (weight * (1.0 + weight_slope * tau)));
        }
        let mut outputs = Vec::new();
        for (axis, &(scale, scale_slope, b0, b1, b2)) in accel_axes.iter().zip(&accel_terms) {
            let mut sensor = plain_accel();
            sensor.scale_factor = polynomial(&[scale, scale * scale_slope]);
            sensor.terms.curve(Feature::One, polynomial(&[b0, b1, b2]));
            parts.accels.push(sensor);
            let along = Vector3::from(*axis).dot(&Vector3::from(force));
            outputs.push(along * scale * (1.0 + scale_slope * tau) + b0 + b1 * tau + b2 * tau * tau);
        }
        let tick = steady(&parts, celsius, &rates, &outputs);
        prop_assert!(close(tick.delta_angle, rate.map(|w| w * TICK_S), 5.0 * TICK_S * 1e-12), "{:?}", tick);
        prop_assert!(close(tick.delta_velocity, force.map(|f| f * TICK_S), 20.0 * TICK_S * 1e-12), "{:?}", tick);
    }

    /// The order of the sensors means nothing; the order of the case axes is that of the output.
    #[test]
    fn permuted_sensors_and_axes_permute_the_result(
        (axes, terms) in sensors(), rates in prop::array::uniform8(-5.0..5.0), turn in 0_usize..8,
    ) {
        let build = |order: &[usize], swap: bool| {
            let mut parts = identity();
            parts.gyros = order.iter().map(|&i| {
                let mut sensor = plain_gyro();
                sensor.increment_weight = terms[i].0;
                sensor.terms.curve(Feature::One, constant(terms[i].2));
                sensor
            }).collect();
            let rows: Vec<[f64; 3]> = order.iter().map(|&i| {
                let [x, y, z] = axes[i];
                if swap { [z, x, y] } else { [x, y, z] }
            }).collect();
            parts.gyro_orientation = orientation(&rows);
            let rates: Vec<f64> = order.iter().map(|&i| rates[i]).collect();
            steady(&parts, 20.0, &rates, &[0.0; 3]).delta_angle
        };
        let plain: Vec<usize> = (0..axes.len()).collect();
        let mut turned = plain.clone();
        turned.rotate_left(turn % axes.len());
        let [x, y, z] = build(&plain, false);
        prop_assert!(close(build(&turned, false), [x, y, z], 1e-14));
        prop_assert!(close(build(&plain, true), [z, x, y], 1e-14));
    }

    /// No term jumps while temperature moves continuously, over every branch change: within a sample interval the
    /// corrected rate moves on a straight line, so no tick's step exceeds its share of the interval's change.
    #[test]
    fn no_term_jumps_when_temperature_or_branch_changes(
        amplitude in 1.0_f64..20.0, period_s in 20.0_f64..60.0, run_up in -1e-3..1e-3, braking in -1e-3..1e-3,
    ) {
        const PER_INTERVAL: u16 = 200;
        let per_interval = usize::from(PER_INTERVAL);
        let mut parts = identity();
        parts.filter.branch_dead_band = 1e-3;
        parts.accels.clear();
        parts.accel_orientation = None;
        parts.accel_orientation_channels.clear();
        let knots = vec![[-60.0, 1e-4], [20.0, -1e-4], [100.0, 3e-4]];
        for sensor in &mut parts.gyros {
            sensor.terms.curve(Feature::One, CurveParts::PiecewiseLinear { knots: knots.clone() });
            let branched =
                BranchedParts { argument: BranchArgument::Derivative, run_up: constant(run_up), braking: constant(braking) };
            sensor.terms.branched(Feature::ThermalRate, branched.clone());
            sensor.terms.branched(Feature::ThermalAcceleration, branched);
        }
        let mut unit = drive::unit(&compile(&parts));
        let mut out = Vec::new();
        for k in 0..40 * u32::from(PER_INTERVAL) {
            if k % u32::from(PER_INTERVAL) == 0 {
                let t = TICK_S * f64::from(k);
                let celsius = 20.0 + amplitude * (std::f64::consts::TAU * t / period_s).sin();
                drive::hand(&mut unit, &Owned::Temperature(vec![temperature(k.into(), celsius)]), &mut out);
            }
            drive::hand(&mut unit, &Owned::Gyro(vec![gyro(k.into(), &[0.0; 3])]), &mut out);
        }
        // From the second interval on: the first reading is met, not approached.
        let rates: Vec<f64> = out.iter().skip(2 * per_interval).map(|tick| tick.delta_angle[0] / TICK_S).collect();
        // Without the first and the last interval, whose change is not complete.
        let whole = rates.len() - per_interval;
        let steps: Vec<f64> = rates[per_interval..whole].windows(2).map(|pair| (pair[1] - pair[0]).abs()).collect();
        let largest_step = steps.iter().copied().fold(0.0, f64::max);
        let largest_change = rates
            .windows(per_interval + 1)
            .map(|span| (span[per_interval] - span[0]).abs())
            .fold(0.0, f64::max);
        prop_assert!(
            largest_step <= 1.01 * largest_change / f64::from(PER_INTERVAL) + 1e-18,
            "a step of {largest_step} where an interval changes by {largest_change}"
        );
    }
}
