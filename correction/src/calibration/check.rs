//! Checks that every part holds before it is compiled.

mod sensors;

use alloc::boxed::Box;
use alloc::vec::Vec;

use super::Calibration;
use super::parts::CalibrationParts;
use crate::channel::{Channel, ChannelParts, MAX_GRID_POINTS, ThermalFilter, ThermalFilterParts};
use crate::defect::{Checker, Defect, DefectKind, HUGE};
use crate::drift::DriftModel;
use crate::lanes::Lanes;
use crate::operation::SelfTestParts;
use crate::reversal::Reversal;
use crate::sample::{MAX_SENSORS, MIN_SENSORS};
use crate::servo::Servo;
use crate::sigma::SigmaModel;
use crate::thermal::{Motion, Trends};

use sensors::{accel_model, gyro_model, orientation};

/// Most voltages, and most counters, that a self-test may look at.
pub const MAX_SELF_TEST_READINGS: usize = 32;

/// Validates and compiles.
pub(super) fn compile(parts: &CalibrationParts) -> Result<Calibration, Vec<Defect>> {
    let checker = &mut Checker::default();
    check_filter(checker, &parts.filter);
    let filter = ThermalFilter::new(&parts.filter);
    check_channels(checker, &parts.channels, &parts.auxiliaries);

    checker.at("gyro").count("sensor", parts.gyros.len(), MIN_SENSORS, MAX_SENSORS);
    let gyros = parts.gyros.iter().enumerate();
    let models = gyros.clone().filter_map(|(i, gyro)| gyro_model(checker, i, gyro, &filter, parts));
    let (models, gyros_in_motion): (Vec<_>, Vec<_>) = models.unzip();
    let drifts = gyros.map(|(i, gyro)| {
        let drift = DriftModel::new(gyro.drift.as_ref()?);
        let drift = drift.map_err(|errors| errors.into_iter().map(Defect::from));
        checker.element("gyro.sensor", i).compiled("drift", drift)
    });
    let drifts = drifts.collect();
    let stated = (&parts.gyro_orientation, &*parts.gyro_orientation_channels);
    let gyro_orientation = orientation(checker.at("gyro.orientation"), stated, parts.gyros.len(), parts);

    if !parts.accels.is_empty() {
        checker.at("accel").count("sensor", parts.accels.len(), MIN_SENSORS, MAX_SENSORS);
    }
    let accels = parts.accels.iter().enumerate();
    let accels = accels.filter_map(|(i, accel)| accel_model(checker, i, accel, &filter, parts));
    let (accels, accels_in_motion): (Vec<_>, Vec<_>) = accels.unzip();
    checker.at("accel.orientation");
    if !parts.accels.is_empty() && parts.accel_orientation.is_none() {
        checker.push("rows", DefectKind::Missing { needed_by: "accel" });
    }
    let accel_orientation = parts.accel_orientation.as_ref().and_then(|stated| {
        orientation(checker, (stated, &parts.accel_orientation_channels), parts.accels.len(), parts)
    });
    let reversal = parts.reversal.as_ref();
    let reversal =
        reversal.and_then(|stated| checker.at("mode_reversal").compiled("", Reversal::new(stated)));
    check_self_test(checker, &parts.self_test);
    let servos = models.iter().filter_map(|gyro| gyro.servo.as_ref());
    match gyro_orientation {
        Some(gyro_orientation) if checker.defects.is_empty() => Ok(with_sigma(
            parts,
            Calibration {
                filter,
                channels: parts.channels.iter().chain(&parts.auxiliaries).cloned().map(Channel).collect(),
                temperatures: parts.channels.len(),
                regresses: models.iter().any(|gyro| !gyro.terms.regressors().is_empty())
                    || accels.iter().any(|accel| !accel.terms.regressors().is_empty()),
                gyro_output: parts.gyro_output,
                gyro_limits: limits(models.iter().map(|gyro| gyro.input_limit)),
                accel_limits: limits(accels.iter().map(|accel| accel.input_limit)),
                motion: Motion::of(
                    gyros_in_motion,
                    accels_in_motion,
                    parts.accels.iter().map(|accel| accel.position_m),
                    [
                        parts.gyros.iter().map(|gyro| gyro.delay_ticks).collect(),
                        parts.accels.iter().map(|accel| accel.delay_ticks).collect(),
                    ],
                ),
                sigma: None,
                trends: Trends::of(&models).map(Box::new),
                servos_settle_s: servos.map(Servo::settle_time_s).reduce(f64::max),
                gyros: models,
                drifts,
                gyro_orientation,
                gyro_orientation_channels: parts.gyro_orientation_channels.clone(),
                accel_output: parts.accel_output,
                accels,
                accel_orientation,
                accel_orientation_channels: parts.accel_orientation_channels.clone(),
                reversal,
                self_test: parts.self_test.clone(),
            },
        )),
        _ => Err(core::mem::take(&mut checker.defects)),
    }
}

/// With what is stated of the sensors' errors.
fn with_sigma(parts: &CalibrationParts, calibration: Calibration) -> Calibration {
    let sigma = SigmaModel::of(parts, &calibration).map(Box::new);
    Calibration { sigma, ..calibration }
}

/// A lane for each sensor; infinite where there is none.
fn limits(stated: impl Iterator<Item = f64>) -> Lanes {
    let mut lanes = [f64::INFINITY; MAX_SENSORS];
    lanes.iter_mut().zip(stated).for_each(|(lane, limit)| *lane = limit);
    lanes
}

fn check_filter(checker: &mut Checker, filter: &ThermalFilterParts) {
    checker.at("temperature").within("assumed_deg_c", filter.assumed_deg_c, -273.15, 1000.0);
    checker.at("temperature.filter").within("grid_step_s", filter.grid_step_s, 1e-3, 3600.0);
    #[expect(clippy::cast_precision_loss, reason = "a small constant")]
    let longest = filter.grid_step_s * MAX_GRID_POINTS as f64;
    checker.within("smoothing_s", filter.smoothing_s, 0.0, longest);
    checker.within("derivative_step_s", filter.derivative_step_s, 0.0, longest);
    // Bounded in grid steps too: a reading after a silence walks over all of them at once.
    checker.within("stale_after_s", filter.stale_after_s, filter.grid_step_s, 1e4 * filter.grid_step_s);
    checker.positive("branch_dead_band", filter.branch_dead_band);
}

fn check_channels(checker: &mut Checker, temperatures: &[ChannelParts], auxiliaries: &[ChannelParts]) {
    let temperatures =
        temperatures.iter().enumerate().map(|(i, channel)| ("temperature.channel", i, channel));
    let all =
        temperatures.chain(auxiliaries.iter().enumerate().map(|(i, channel)| ("auxiliary", i, channel)));
    let names = all.clone().map(|(kind, i, channel)| (kind, i, channel.name));
    for (before, (kind, i, channel)) in all.enumerate() {
        checker.element(kind, i).unique(channel.name, names.clone().take(before));
        checker.coefficients("conversion", &channel.conversion, 8);
        checker.range("range", channel.range_deg_c, -HUGE, HUGE);
        checker.positive("spike_limit", channel.spike_limit_deg_c);
    }
}

/// Every limit is one, and no name stands for two readings: both kinds come in on one topic.
fn check_self_test(checker: &mut Checker, SelfTestParts { voltages, counters }: &SelfTestParts) {
    checker.at("self_test").count("voltage", voltages.len(), 0, MAX_SELF_TEST_READINGS);
    checker.count("counter", counters.len(), 0, MAX_SELF_TEST_READINGS);
    let voltage_names =
        voltages.iter().enumerate().map(|(i, voltage)| ("self_test.voltage", i, voltage.name));
    let counter_names =
        counters.iter().enumerate().map(|(i, counter)| ("self_test.counter", i, counter.name));
    let names = voltage_names.chain(counter_names);
    for (before, (list, i, name)) in names.clone().enumerate() {
        checker.element(list, i);
        if name.is_empty() {
            checker.push("name", DefectKind::NoName);
        } else {
            checker.unique(name, names.clone().take(before));
        }
    }
    for (i, voltage) in voltages.iter().enumerate() {
        checker.element("self_test.voltage", i).range("range_v", voltage.range_v, -HUGE, HUGE);
    }
    for (i, counter) in counters.iter().enumerate() {
        checker.element("self_test.counter", i).within("max_increase", counter.max_increase, 0.0, HUGE);
    }
}
