//! What the service's own drift estimator leaves of a drift.
//!
//! The estimator is `isotherm_correction::drift::DriftEstimator` itself, fed tick by tick as the service feeds it: the
//! residual rate of each gyro in, a reference each minute while the true rate is known, what it would subtract out.

use isotherm_correction::drift::{DriftEstimator, DriftModel, DriftParts, DriftSettings, Reference};
use isotherm_correction::observation::{GyroSeen, Observation};
use isotherm_correction::sample::{SensorFlags, Sensors};
use isotherm_correction::units::{Span, Timestamp};

use super::scenario::{Drift, Voyage};
use crate::axes::AXES;

/// Length of a tick (s); drifts take hours.
pub const TICK_S: f64 = 10.0;
/// Length of a reference (s), that of the ones at rest.
pub const REFERENCE_S: f64 = 60.0;
/// Ticks of a reference.
pub const REFERENCE_TICKS: usize = 6;

/// What is left of the drifts (rad/s) of the gyros x, y, z after the estimate, tick by tick.
///
/// In the voyage's calibration the rate of every gyro is known, afterwards that of the level ones, where a velocity log aids them. `parts`
/// is what the estimator is to expect of each.
///
/// # Errors
/// Everything that is wrong with the parts.
pub fn residual(
    voyage: &Voyage,
    drift: &Drift,
    parts: &[DriftParts; 3],
) -> Result<Vec<[f64; 3]>, Vec<String>> {
    let mut errors = Vec::new();
    let mut models = Vec::new();
    for (axis, parts) in AXES.into_iter().zip(parts) {
        match DriftModel::new(parts) {
            Ok(model) => models.push(model),
            Err(found) => errors.extend(found.iter().map(|error| format!("drift of gyro {axis}: {error}"))),
        }
    }
    if !errors.is_empty() {
        return Err(errors);
    }
    let settings = DriftSettings { delay: Span::from_ms(0), subtract: true };
    // One estimator per gyro: a reference is for all gyros of an estimator, and the azimuth's ends with the calibration.
    let mut estimators: Vec<DriftEstimator> =
        models.into_iter().map(|model| DriftEstimator::new(&[Some(model)], settings)).collect();
    let mut left = Vec::with_capacity(drift.truth.len());
    let mut end = Timestamp::default();
    let tick = Span::from_s(TICK_S);
    let project = |_: [f64; 3]| std::iter::once(0.0).collect::<Sensors<f64>>();
    for (index, (truth, measured)) in drift.truth.iter().zip(&drift.measured).enumerate() {
        end = end + tick;
        let mut of_tick = *truth;
        for (axis, estimator) in estimators.iter_mut().enumerate() {
            let known = index < voyage.calibration_ticks() || (axis < 2 && voyage.log_aids_level);
            estimator.advance(end, false, &project);
            let gyro = GyroSeen { rate: measured[axis], flags: SensorFlags::VALID, ..GyroSeen::default() };
            let observation = Observation {
                end_time: end,
                duration: tick,
                settled: true,
                gyros: std::iter::once(gyro).collect(),
                ..Observation::default()
            };
            of_tick[axis] -= estimator.subtrahend(0, end);
            estimator.observe(&observation);
            if known && (index + 1) % REFERENCE_TICKS == 0 {
                let reference = Reference {
                    start: end - Span::from_s(REFERENCE_S),
                    end,
                    angular_rate: [0.0; 3],
                    sigma: voyage.reference_sigma_rad_per_s,
                };
                // It is as long as one may be, and of a time that is kept.
                if let Err(refusal) = estimator.submit_at_rest(&reference) {
                    return Err(vec![refusal.to_string()]);
                }
            }
        }
        left.push(of_tick);
    }
    Ok(left)
}
