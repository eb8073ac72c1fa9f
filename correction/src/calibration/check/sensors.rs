//! Checks and compiles gyros, accelerometers and their orientations.

use super::super::defect::{DefectKind, Section};
use super::super::parts::{AccelParts, CalibrationParts, GyroParts, LagParts, TrendParts};
use super::checker::{Checker, HUGE};
use crate::channel::ThermalFilter;
use crate::curve::Curve;
use crate::drift::{DriftError, DriftModel};
use crate::orientation::{Orientation, OrientationError, OrientationParts};
use crate::reversal::ReversalError;
use crate::sample::OutputKind;
use crate::thermal::{AccelModel, GyroModel, MAX_LAGS, TermError};

pub(super) fn gyro_model(
    checker: &mut Checker,
    index: usize,
    gyro: &GyroParts,
    filter: &ThermalFilter,
    parts: &CalibrationParts,
) -> Option<GyroModel> {
    let section = Section::Gyro(index);
    checker.channel(section, "channel", gyro.channel, parts.channels.len());
    checker.within(section, "increment_weight", gyro.increment_weight.abs(), f64::MIN_POSITIVE, HUGE);
    checker.within(section, "input_limit", gyro.input_limit, f64::MIN_POSITIVE, HUGE);
    lags(checker, section, &gyro.lags, parts);
    if let Some(TrendParts { coefficients, interval_s }) = &gyro.trend {
        checker.count(section, "trend.coefficients", coefficients.len(), 1, 3);
        for &c in coefficients {
            checker.within(section, "trend.coefficients", c, -HUGE, HUGE);
        }
        checker.range(section, "trend.interval_s", *interval_s, 0.0, 1e9);
    }
    if gyro.servo.is_some() && parts.reversal.is_none() {
        checker.push(
            Section::Reversal,
            "transition_ticks",
            DefectKind::Missing { needed_by: "the gyros' servo term" },
        );
    }
    if gyro.servo.is_some() && parts.gyro_output != OutputKind::Counts {
        checker.push(section, "servo", DefectKind::NeedsCounts);
    }
    GyroModel::new(gyro, filter, &mut |field, error| {
        checker.push(
            section,
            field,
            match error {
                TermError::Curve(error) => DefectKind::Curve(error),
                TermError::Servo(error) => DefectKind::Servo(error),
            },
        );
    })
}

pub(super) fn accel_model(
    checker: &mut Checker,
    index: usize,
    accel: &AccelParts,
    filter: &ThermalFilter,
    parts: &CalibrationParts,
) -> Option<AccelModel> {
    let section = Section::Accel(index);
    checker.channel(section, "channel", accel.channel, parts.channels.len());
    checker.channel(section, "board_channel", accel.board_channel, parts.channels.len());
    if accel.board_channel.is_none() && accel.board_ratio.is_some() {
        checker.push(section, "board_channel", DefectKind::Missing { needed_by: "board_ratio" });
    }
    checker.within(section, "input_limit", accel.input_limit, f64::MIN_POSITIVE, HUGE);
    lags(checker, section, &accel.lags, parts);
    let model = AccelModel::new(accel, filter, &mut |field, error| {
        checker.push(section, field, DefectKind::Curve(error));
    })?;
    if let Some(at) = sign_change(&model.scale_factor) {
        checker.push(section, "scale_factor", DefectKind::Zero { at });
    }
    Some(model)
}

/// Number and time constants of a sensor's lags.
fn lags(checker: &mut Checker, section: Section, lags: &[LagParts], parts: &CalibrationParts) {
    checker.count(section, "lags", lags.len(), 0, MAX_LAGS);
    for LagParts { time_constant_s, .. } in lags {
        checker.within(section, "lags.time_constant_s", *time_constant_s, parts.filter.grid_step_s, 1e7);
    }
}

/// First place on a grid over the curve's range where it is zero or has changed its sign.
fn sign_change(curve: &Curve) -> Option<f64> {
    let [low, high] = curve.range();
    let first = curve.at(low).value;
    (0..=256).map(|i| low + (high - low) * f64::from(i) / 256.0).find(|&x| {
        let same_sign = curve.at(x).value * first;
        same_sign.is_nan() || same_sign <= 0.0
    })
}

pub(super) fn orientation(
    checker: &mut Checker,
    section: Section,
    parts: &OrientationParts,
    following: &[usize],
    sensors: usize,
    channels: usize,
) -> Option<Orientation> {
    checker.count(section, "rows", parts.rows.len(), sensors, sensors);
    for &index in following {
        checker.channel(section, "channels", Some(index), channels);
    }
    match Orientation::new(parts) {
        Ok(orientation) => Some(orientation),
        Err(errors) => {
            for error in errors {
                checker.push(section, orientation_field(&error), DefectKind::Orientation(error));
            }
            None
        }
    }
}

/// Field of the parts that an orientation error speaks of.
fn orientation_field(error: &OrientationError) -> &'static str {
    match error {
        OrientationError::ListCount { name, .. } | OrientationError::NotFinite { name, .. } => name,
        OrientationError::WeightNotPositive { .. } | OrientationError::WeightRatio { .. } => "weights",
        OrientationError::EmptyRange { .. } => "range_deg_c",
        OrientationError::ParityLimit { .. } => "parity_limit",
        OrientationError::ParityConfirm => "parity_confirm_ticks",
        _ => "rows",
    }
}

/// The drift of one gyro; `None` where it states none, or a wrong one.
pub(super) fn drift_model(checker: &mut Checker, index: usize, gyro: &GyroParts) -> Option<DriftModel> {
    match gyro.drift.as_ref().map(DriftModel::new)? {
        Ok(model) => Some(model),
        Err(errors) => {
            for error in errors {
                checker.push(Section::Gyro(index), drift_field(&error), DefectKind::Drift(error));
            }
            None
        }
    }
}

/// Field of the parts that a drift error speaks of.
fn drift_field(error: &DriftError) -> &'static str {
    match error {
        DriftError::OutOfRange { name, .. } => name,
    }
}

/// Field of the parts that a substitution error speaks of.
pub(super) fn reversal_field(error: &ReversalError) -> &'static str {
    match error {
        ReversalError::OutOfRange { name, .. } | ReversalError::DegreeNeedsReadings { name, .. } => name,
    }
}
