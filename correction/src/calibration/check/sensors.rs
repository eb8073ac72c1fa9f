//! Checks and compiles gyros, accelerometers and their orientations.

use alloc::format;

use super::super::parts::{AccelParts, CalibrationParts, GyroParts, Source, TermParts, TrendParts};
use crate::channel::ThermalFilter;
use crate::curve::Curve;
use crate::defect::{Checker, Defect, DefectKind, HUGE};
use crate::orientation::{Orientation, OrientationParts};
use crate::sample::OutputKind;
use crate::servo::Servo;
use crate::sigma::{MAX_BIAS_TERMS, SigmaParts};
use crate::thermal::{
    ACCEL_TERMS, AccelModel, Feature, GYRO_TERMS, GyroModel, MAX_PLAYS, MotionTerms, Parameter, Term,
    TermForm,
};

/// Farthest that an accelerometer may sit from the reference point along an axis (m).
const MOST_POSITION_M: f64 = 100.0;

pub(super) fn gyro_model(
    checker: &mut Checker,
    index: usize,
    gyro: &GyroParts,
    filter: &ThermalFilter,
    parts: &CalibrationParts,
) -> Option<(GyroModel, MotionTerms)> {
    checker.element("gyro.sensor", index);
    channel(checker, "channel", gyro.channel, parts);
    let counts = parts.gyro_output == OutputKind::Counts;
    let weight = if counts { "increment_weight_arcsec" } else { "increment_weight_rad" };
    checker.positive(weight, gyro.increment_weight.abs());
    checker.positive("input_limit", gyro.input_limit);
    checker.within("delay_ticks", gyro.delay_ticks, 0.0, 1.0);
    terms(checker, (gyro.channel, &gyro.terms), &GYRO_TERMS, parts);
    if let Some(TrendParts { coefficients, interval_s }) = &gyro.trend {
        checker.coefficients("trend.coefficients", coefficients, 3);
        checker.range("trend.interval", *interval_s, 0.0, 1e9);
    }
    if gyro.servo.is_some() && parts.reversal.is_none() {
        let kind = DefectKind::Missing { needed_by: "the gyros' servo term" };
        checker.defects.push(Defect { path: "mode_reversal".into(), kind });
    }
    if gyro.servo.is_some() && !counts {
        checker.push("servo", DefectKind::NeedsCounts);
    }
    sigma(checker, gyro.sigma.as_ref());
    let servo = gyro.servo.as_ref().and_then(|servo| checker.compiled("servo", Servo::new(servo)));
    let model = GyroModel::new(gyro, servo, filter, checker);
    let over_rate = gyro.increment_weight_over_rate.as_ref();
    model.zip(MotionTerms::new(gyro.channel, (&GYRO_TERMS, &gyro.terms), over_rate, filter, checker))
}

pub(super) fn accel_model(
    checker: &mut Checker,
    index: usize,
    accel: &AccelParts,
    filter: &ThermalFilter,
    parts: &CalibrationParts,
) -> Option<(AccelModel, MotionTerms)> {
    checker.element("accel.sensor", index);
    channel(checker, "channel", accel.channel, parts);
    channel(checker, "board_channel", accel.board_channel, parts);
    if accel.board_channel.is_none() && accel.board_ratio.is_some() {
        checker.push("board_channel", DefectKind::Missing { needed_by: "board_ratio_error" });
    }
    for metres in accel.position_m {
        checker.within("position_m", metres, -MOST_POSITION_M, MOST_POSITION_M);
    }
    checker.positive("input_limit", accel.input_limit);
    checker.within("delay_ticks", accel.delay_ticks, 0.0, 1.0);
    terms(checker, (accel.channel, &accel.terms), &ACCEL_TERMS, parts);
    sigma(checker, accel.sigma.as_ref());
    let model = AccelModel::new(accel, filter, checker);
    if let Some(at) = model.as_ref().and_then(|model| sign_change(&model.scale_factor)) {
        checker.push("scale_factor", DefectKind::Zero { at });
    }
    model.zip(MotionTerms::new(accel.channel, (&ACCEL_TERMS, &accel.terms), None, filter, checker))
}

/// Standard errors are numbers from 0 on, and correlations those of a covariance.
fn sigma(checker: &mut Checker, parts: Option<&SigmaParts>) {
    let Some(parts) = parts else { return };
    let stated = [
        ("sigma.random_walk", parts.random_walk),
        ("sigma.quantisation", parts.quantisation),
        ("sigma.instability", Some(parts.instability)),
        ("sigma.rate_random_walk", Some(parts.rate_random_walk)),
        ("sigma.scale", parts.scale),
        ("sigma.misalignment", parts.misalignment),
        ("sigma.clamping", parts.clamping_per_deg_c),
    ];
    for (field, value) in stated {
        checker.within(field, value.unwrap_or(0.0), 0.0, HUGE);
    }
    let Some(bias) = &parts.bias else { return };
    checker.count("sigma.bias.sigma", bias.sigma.len(), 1, MAX_BIAS_TERMS);
    for sigma in &bias.sigma {
        checker.within("sigma.bias.sigma", *sigma, 0.0, HUGE);
    }
    checker.within("sigma.bias.reference", bias.reference_deg_c, -HUGE, HUGE);
    if !bias.is_covariance() {
        checker.push("sigma.bias.correlation", DefectKind::NoCovariance);
    }
}

/// Number of a sensor's terms of each feature, and what they need beside coefficients; `channel` is the sensor's own.
fn terms(
    checker: &mut Checker,
    (channel, terms): (Option<usize>, &[TermParts]),
    declared: &[Term],
    parts: &CalibrationParts,
) {
    let grid_step_s = parts.filter.grid_step_s;
    for term in declared {
        let stated = terms.iter().filter(|stated| stated.feature == term.feature);
        checker.count(term.key, stated.clone().count(), 0, term.form.most());
        for (index, TermParts { parameter, regressor, .. }) in stated.enumerate() {
            let path = term.path(index);
            match term.form {
                TermForm::Each(Parameter { key, range: [least, most], .. }) => {
                    let path = format!("{path}.{key}");
                    checker.within(&path, *parameter, least, most);
                    if term.feature == Feature::Lag && *parameter < grid_step_s {
                        checker.push(&path, DefectKind::BelowGridStep { time_s: *parameter, grid_step_s });
                    }
                }
                TermForm::Regressors(_) => match regressor {
                    Some(regressor) => {
                        for stated in regressor.channels() {
                            source(checker, &path, stated, parts);
                        }
                        checker.within(&format!("{path}.reference"), regressor.reference, -HUGE, HUGE);
                        if channel.is_none() {
                            checker.push("channel", DefectKind::Missing { needed_by: "regressor" });
                        }
                    }
                    None => checker.push(&path, DefectKind::Missing { needed_by: "its coefficient" }),
                },
                TermForm::Curve | TermForm::Branches | TermForm::PartOf(_) => {}
            }
        }
    }
}

/// A place on a grid over the curve's range, or else a knot, where it is zero or has changed its sign.
fn sign_change(curve: &Curve) -> Option<f64> {
    let [low, high] = curve.range();
    let first = curve.at(low).value;
    let grid = (0..=256).map(|i| low + (high - low) * f64::from(i) / 256.0);
    grid.chain(curve.knots()).find(|&x| {
        let same_sign = curve.at(x).value * first;
        same_sign.is_nan() || same_sign <= 0.0
    })
}

/// A channel that is named by its index.
fn channel(checker: &mut Checker, field: &str, index: Option<usize>, parts: &CalibrationParts) {
    if let Some(index) = index {
        source(checker, field, Source::Temperature(index), parts);
    }
}

/// A channel of either kind.
fn source(checker: &mut Checker, field: &str, source: Source, parts: &CalibrationParts) {
    let (index, channels) = match source {
        Source::Temperature(index) => (index, parts.channels.len()),
        Source::Auxiliary(index) => (index, parts.auxiliaries.len()),
    };
    if index >= channels {
        checker.push(field, DefectKind::NoSuchChannel { index, channels });
    }
}

/// An orientation of so many sensors that follows channels.
pub(super) fn orientation(
    checker: &mut Checker,
    (stated, following): (&OrientationParts, &[usize]),
    sensors: usize,
    parts: &CalibrationParts,
) -> Option<Orientation> {
    checker.count("thermal.hysteresis", stated.plays.len(), 0, MAX_PLAYS);
    for &index in following {
        channel(checker, "thermal.channels", Some(index), parts);
    }
    // As many of everything as there are sensors, not as there are rows.
    let got = stated.rows.len();
    if got != sensors {
        checker.push("rows", DefectKind::ListCount { got, sensors });
    }
    stated.check_lists(sensors, checker);
    let compiled = Orientation::new(stated).map_err(|mut defects| {
        defects.retain(|defect| !matches!(defect.kind, DefectKind::ListCount { .. }));
        defects
    });
    checker.compiled("", compiled)
}
