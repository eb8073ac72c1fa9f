//! Checks that every part holds before it is compiled.

mod checker;
mod self_test;
mod sensors;

use alloc::boxed::Box;
use alloc::vec::Vec;

use super::Calibration;
use super::defect::{Defect, DefectKind, Section};
use super::parts::CalibrationParts;
use crate::channel::{Channel, ChannelParts, MAX_GRID_POINTS, ThermalFilter, ThermalFilterParts};
use crate::lanes::Lanes;
use crate::reversal::Reversal;
use crate::sample::{MAX_SENSORS, MIN_SENSORS};
use crate::thermal::Trends;

use checker::{Checker, HUGE};
pub use self_test::MAX_SELF_TEST_READINGS;
use self_test::check_self_test;
use sensors::{accel_model, drift_model, gyro_model, orientation, reversal_field};

/// Validates and compiles.
pub(super) fn compile(parts: &CalibrationParts) -> Result<Calibration, Vec<Defect>> {
    let mut checker = Checker { defects: Vec::new() };
    check_filter(&mut checker, &parts.filter);
    let filter = ThermalFilter::new(&parts.filter);
    check_channels(&mut checker, &parts.channels);
    let channels = parts.channels.len();

    checker.count(Section::Gyros, "sensors", parts.gyros.len(), MIN_SENSORS, MAX_SENSORS);
    let gyros = parts
        .gyros
        .iter()
        .enumerate()
        .filter_map(|(i, gyro)| gyro_model(&mut checker, i, gyro, &filter, parts));
    let gyros: Vec<_> = gyros.collect();
    let drifts = parts.gyros.iter().enumerate().map(|(i, gyro)| drift_model(&mut checker, i, gyro)).collect();
    let gyro_orientation = orientation(
        &mut checker,
        Section::GyroOrientation,
        &parts.gyro_orientation,
        &parts.gyro_orientation_channels,
        parts.gyros.len(),
        channels,
    );

    let mut accels = Vec::new();
    if !parts.accels.is_empty() {
        checker.count(Section::Accels, "sensors", parts.accels.len(), MIN_SENSORS, MAX_SENSORS);
        accels = parts
            .accels
            .iter()
            .enumerate()
            .filter_map(|(i, accel)| accel_model(&mut checker, i, accel, &filter, parts))
            .collect();
        if parts.accel_orientation.is_none() {
            checker.push(Section::AccelOrientation, "rows", DefectKind::Missing { needed_by: "accel" });
        }
    }
    let accel_orientation = parts.accel_orientation.as_ref().and_then(|orientation_parts| {
        orientation(
            &mut checker,
            Section::AccelOrientation,
            orientation_parts,
            &parts.accel_orientation_channels,
            parts.accels.len(),
            channels,
        )
    });
    let reversal = match parts.reversal.as_ref().map(Reversal::new) {
        None => None,
        Some(Ok(reversal)) => Some(reversal),
        Some(Err(errors)) => {
            for error in errors {
                checker.push(Section::Reversal, reversal_field(&error), DefectKind::Reversal(error));
            }
            None
        }
    };
    check_self_test(&mut checker, &parts.self_test);
    match gyro_orientation {
        Some(gyro_orientation) if checker.defects.is_empty() => Ok(Calibration {
            filter,
            channels: parts.channels.iter().cloned().map(Channel).collect(),
            gyro_output: parts.gyro_output,
            gyro_limits: limits(gyros.iter().map(|gyro| gyro.input_limit)),
            accel_limits: limits(accels.iter().map(|accel| accel.input_limit)),
            trends: Trends::of(&gyros).map(Box::new),
            has_servo: gyros.iter().any(|gyro| gyro.servo.is_some()),
            gyros,
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
        _ => Err(checker.defects),
    }
}

/// A lane for each sensor; infinite where there is none.
fn limits(stated: impl Iterator<Item = f64>) -> Lanes {
    let mut lanes = [f64::INFINITY; MAX_SENSORS];
    lanes.iter_mut().zip(stated).for_each(|(lane, limit)| *lane = limit);
    lanes
}

fn check_filter(checker: &mut Checker, filter: &ThermalFilterParts) {
    let section = Section::Filter;
    checker.within(section, "grid_step_s", filter.grid_step_s, 1e-3, 3600.0);
    #[expect(clippy::cast_precision_loss, reason = "a small constant")]
    let longest = filter.grid_step_s * MAX_GRID_POINTS as f64;
    checker.within(section, "smoothing_s", filter.smoothing_s, 0.0, longest);
    checker.within(section, "derivative_step_s", filter.derivative_step_s, 0.0, longest);
    // Bounded in grid steps too: a reading after a silence walks over all of them at once.
    checker.within(
        section,
        "stale_after_s",
        filter.stale_after_s,
        filter.grid_step_s,
        1e4 * filter.grid_step_s,
    );
    checker.within(section, "assumed_deg_c", filter.assumed_deg_c, -273.15, 1000.0);
    checker.within(section, "branch_dead_band", filter.branch_dead_band, f64::MIN_POSITIVE, HUGE);
}

fn check_channels(checker: &mut Checker, channels: &[ChannelParts]) {
    for (i, channel) in channels.iter().enumerate() {
        let section = Section::Channel(i);
        if let Some(other) = channels.iter().take(i).position(|earlier| earlier.name == channel.name) {
            checker.push(section, "name", DefectKind::DuplicateName { of: "channel", other });
        }
        checker.count(section, "conversion", channel.conversion.len(), 1, 8);
        for &a in &channel.conversion {
            checker.within(section, "conversion", a, -HUGE, HUGE);
        }
        checker.range(section, "range", channel.range_deg_c, -HUGE, HUGE);
        checker.within(section, "spike_limit", channel.spike_limit_deg_c, f64::MIN_POSITIVE, HUGE);
    }
}
