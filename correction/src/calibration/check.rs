//! Checks that every part holds before it is compiled.

mod checker;
mod self_test;
mod sensors;

use alloc::boxed::Box;
use alloc::format;
use alloc::vec::Vec;

use super::Calibration;
use super::defect::{Defect, DefectKind, Section};
use super::parts::CalibrationParts;
use crate::channel::{Channel, ChannelParts, MAX_GRID_POINTS, ThermalFilter, ThermalFilterParts};
use crate::drift::DriftModel;
use crate::lanes::Lanes;
use crate::reversal::Reversal;
use crate::sample::{MAX_SENSORS, MIN_SENSORS, OutputKind};
use crate::servo::Servo;
use crate::sigma::SigmaModel;
use crate::thermal::{AccelModel, GyroModel, Motion, MotionTerms, Trends};

use checker::{Checker, HUGE};
pub use self_test::MAX_SELF_TEST_READINGS;
use self_test::check_self_test;
use sensors::{accel_model, gyro_model, orientation};

/// Validates and compiles.
pub(super) fn compile(parts: &CalibrationParts) -> Result<Calibration, Vec<Defect>> {
    let mut checker = Checker::new(parts.channels.len(), parts.auxiliaries.len());
    let checker = &mut checker;
    check_filter(checker.at(Section::Filter), &parts.filter);
    let filter = ThermalFilter::new(&parts.filter);
    check_channels(checker, &parts.channels, &parts.auxiliaries);

    checker.at(Section::Gyros).count("sensor", parts.gyros.len(), MIN_SENSORS, MAX_SENSORS);
    let gyros = parts.gyros.iter().enumerate();
    let models: Vec<_> =
        gyros.clone().filter_map(|(i, gyro)| gyro_model(checker, i, gyro, &filter, parts)).collect();
    let gyros_in_motion: Vec<_> = gyros
        .clone()
        .filter_map(|(i, gyro)| {
            let checker = checker.at(Section::Gyro(i));
            MotionTerms::of_gyro(gyro, &filter, &mut |key, error| checker.curve(key, error))
        })
        .collect();
    let drifts = gyros.map(|(i, gyro)| {
        let drift = gyro.drift.as_ref().map(DriftModel::new)?;
        checker.at(Section::Gyro(i)).compiled(drift, |error| format!("drift.{}", error.quantity()))
    });
    let drifts = drifts.collect();
    let gyro_orientation = orientation(
        checker.at(Section::GyroOrientation),
        &parts.gyro_orientation,
        &parts.gyro_orientation_channels,
        parts.gyros.len(),
    );

    if !parts.accels.is_empty() {
        checker.at(Section::Accels).count("sensor", parts.accels.len(), MIN_SENSORS, MAX_SENSORS);
    }
    let accels = parts.accels.iter().enumerate();
    let accels_in_motion: Vec<_> = accels
        .clone()
        .filter_map(|(i, accel)| {
            let checker = checker.at(Section::Accel(i));
            MotionTerms::of_accel(accel, &filter, &mut |key, error| checker.curve(key, error))
        })
        .collect();
    let accels: Vec<_> =
        accels.filter_map(|(i, accel)| accel_model(checker, i, accel, &filter, parts)).collect();
    checker.at(Section::AccelOrientation);
    if !parts.accels.is_empty() && parts.accel_orientation.is_none() {
        checker.push("rows", DefectKind::Missing { needed_by: "accel" });
    }
    let accel_orientation = parts.accel_orientation.as_ref().and_then(|stated| {
        orientation(checker, stated, &parts.accel_orientation_channels, parts.accels.len())
    });
    checker.at(Section::Reversal);
    let reversal = parts.reversal.as_ref().map(Reversal::new);
    let reversal = reversal.and_then(|reversal| checker.compiled(reversal, |error| error.field().into()));
    check_self_test(checker, &parts.self_test);
    let servos = models.iter().filter_map(|gyro| gyro.servo.as_ref());
    match gyro_orientation {
        Some(gyro_orientation) if checker.defects.is_empty() => Ok(Calibration {
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
            sigma: sigma_model(parts, &models, &accels).map(Box::new),
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
        }),
        _ => Err(core::mem::take(&mut checker.defects)),
    }
}

/// What is stated of the sensors' errors; a count is worth as much as it is at the assumed temperature.
fn sigma_model(parts: &CalibrationParts, gyros: &[GyroModel], accels: &[AccelModel]) -> Option<SigmaModel> {
    let counted = |output, size: Option<f64>| size.filter(|_| output == OutputKind::Counts).map(f64::abs);
    let gyro = |lane: usize| counted(parts.gyro_output, gyros.get(lane).map(|gyro| gyro.increment_weight));
    let assumed_deg_c = parts.filter.assumed_deg_c;
    let accel = |lane: usize| {
        let accel: Option<&AccelModel> = accels.get(lane);
        counted(parts.accel_output, accel.map(|accel| 1.0 / accel.scale_factor.at(assumed_deg_c).value))
    };
    SigmaModel::of(&parts.gyros, &parts.accels, [&gyro, &accel])
}

/// A lane for each sensor; infinite where there is none.
fn limits(stated: impl Iterator<Item = f64>) -> Lanes {
    let mut lanes = [f64::INFINITY; MAX_SENSORS];
    lanes.iter_mut().zip(stated).for_each(|(lane, limit)| *lane = limit);
    lanes
}

fn check_filter(checker: &mut Checker, filter: &ThermalFilterParts) {
    checker.within("grid_step_s", filter.grid_step_s, 1e-3, 3600.0);
    #[expect(clippy::cast_precision_loss, reason = "a small constant")]
    let longest = filter.grid_step_s * MAX_GRID_POINTS as f64;
    checker.within("smoothing_s", filter.smoothing_s, 0.0, longest);
    checker.within("derivative_step_s", filter.derivative_step_s, 0.0, longest);
    // Bounded in grid steps too: a reading after a silence walks over all of them at once.
    checker.within("stale_after_s", filter.stale_after_s, filter.grid_step_s, 1e4 * filter.grid_step_s);
    checker.within("assumed_deg_c", filter.assumed_deg_c, -273.15, 1000.0);
    checker.positive("branch_dead_band", filter.branch_dead_band);
}

fn check_channels(checker: &mut Checker, temperatures: &[ChannelParts], auxiliaries: &[ChannelParts]) {
    let temperatures =
        temperatures.iter().enumerate().map(|(i, channel)| ("temperature.channel", i, channel));
    let all =
        temperatures.chain(auxiliaries.iter().enumerate().map(|(i, channel)| ("auxiliary", i, channel)));
    let names = all.clone().map(|(kind, i, channel)| (kind, i, channel.name));
    for (before, (kind, i, channel)) in all.enumerate() {
        let section = if kind == "auxiliary" { Section::Auxiliary(i) } else { Section::Channel(i) };
        checker.at(section).unique(channel.name, names.clone().take(before));
        checker.coefficients("conversion", &channel.conversion, 8);
        checker.range("range", channel.range_deg_c, -HUGE, HUGE);
        checker.positive("spike_limit", channel.spike_limit_deg_c);
    }
}
