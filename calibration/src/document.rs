//! Calibration documents: on their way to a file, compared, merged, shown.
//!
//! | module | holds |
//! |---|---|
//! | `written`, `provenance`, `plain` | a document on its way to a file; where its numbers come from; the first of a unit |
//! | [`diff`] | what has changed between documents |
//! | [`merge`] | parts of a calibration in one document |
//! | [`show`] | a document in words and curves |

pub mod diff;
mod fitted;
pub mod merge;
mod plain;
mod provenance;
pub mod show;
mod written;

use isotherm_correction::thermal::{GYRO_TERMS, Makes};
use isotherm_correction::units::Angle;
use isotherm_protocol::document::{
    AccelSensor, Curve, Document, GyroSensor, OrientationThermal, Shape, StatedTerm,
};

pub use fitted::{About, Fitted};
pub(crate) use fitted::{by_name, rows};
pub use isotherm_document::tidy;
pub(crate) use plain::{ASSUMED_DEG_C, channels, faults, follows, plain, reads_deg_c};
pub(crate) use provenance::{BASE, are_copies, base_of, files_of};
pub use provenance::{TOOL, command_line, origin, recordings_in};
pub use written::{Written, name_of, write_file};

/// Name of a gyro of a document by its number; a question mark where there is none.
pub(crate) fn gyro_name(document: &Document, index: usize) -> &str {
    document.gyro.sensor.get(index).map_or("?", |sensor| &sensor.name)
}

/// Likewise of an accelerometer.
pub(crate) fn accel_name(document: &Document, index: usize) -> &str {
    accelerometers(document).get(index).map_or("?", |sensor| &sensor.name)
}

/// The accelerometers of a document.
pub fn accelerometers(document: &Document) -> &[AccelSensor] {
    document.accel.as_ref().map_or(&[], |accel| &accel.sensor)
}

/// How a document turns an input axis at a temperature, within the range of its slopes, from where it lies at their reference (rad): not
/// at all without slopes, or where the temperature is no number.
pub(crate) fn turned(thermal: Option<&OrientationThermal>, sensor: usize, deg_c: f64) -> [f64; 3] {
    let thermal = thermal.filter(|_| deg_c.is_finite());
    let of_sensor = thermal.and_then(|thermal| Some((thermal, thermal.slopes_arcsec_per_deg_c.get(sensor)?)));
    let Some((thermal, slopes)) = of_sensor else { return [0.0; 3] };
    let [low, high] = thermal.range_deg_c;
    let away = deg_c.clamp(low, high) - thermal.reference_deg_c;
    slopes.map(|slope| Angle::from_arcsec(slope).as_rad() * away)
}

/// A curve that has one value everywhere.
pub(crate) fn constant(value: f64) -> Curve {
    Curve::new(Shape::Constant { value: tidy(value) })
}

/// The increment weight of a gyro, in the unit of its readings.
pub(crate) fn weight(gyro: &GyroSensor) -> Option<f64> {
    gyro.increment_weight_arcsec_per_count.or(gyro.increment_weight_rad_per_rad)
}

/// Gives a gyro another increment weight. All terms of its bias Ω grow alike, and so does all that it reads, K·P − Ω (models §2): where it
/// read nothing it still does.
pub(crate) fn reweigh(gyro: &mut GyroSensor, new: f64) {
    let old = [&mut gyro.increment_weight_arcsec_per_count, &mut gyro.increment_weight_rad_per_rad];
    let Some(old) = old.into_iter().find_map(Option::as_mut) else { return };
    let factor = new / std::mem::replace(old, new);
    if factor.to_bits() == 1.0_f64.to_bits() {
        return;
    }
    let is_bias =
        |feature| GYRO_TERMS.iter().any(|term| term.feature == feature && term.makes == Makes::Bias);
    let times = |curve: &Curve| {
        let new = Curve::new(curve.shape().scaled(1.0, factor, 0.0)).in_unit(curve.unit());
        curve.argument().map_or(new.clone(), |argument| new.over(argument))
    };
    let terms: Vec<StatedTerm> = gyro.terms.iter().filter(|term| is_bias(term.feature)).cloned().collect();
    gyro.terms.retain(|feature| !is_bias(feature));
    for term in terms {
        let (coefficient, braking) = (times(&term.coefficient), term.braking.as_ref().map(times));
        gyro.put(StatedTerm { coefficient, braking, ..term });
    }
    let trend = gyro.trend.iter_mut().flat_map(|trend| &mut trend.coefficients_deg_per_h);
    trend.for_each(|coefficient| *coefficient *= factor);
}

/// The scale factor that a document states of an accelerometer at a temperature (°C); 1 where it states none there.
pub(crate) fn scale_at(sensor: &AccelSensor, deg_c: f64) -> f64 {
    sensor.scale_factor.shape().at(deg_c).unwrap_or(1.0)
}

/// r of an accelerometer's board that a document states at the board's temperature (°C); 1 where it states none there.
pub(crate) fn board_ratio_at(sensor: &AccelSensor, board_deg_c: f64) -> f64 {
    let error = || sensor.board_ratio_error.as_ref()?.shape().at(board_deg_c);
    1.0 + error().unwrap_or(0.0) * 1e-6
}

/// Temperature that a polynomial is given about (°C).
pub(crate) fn about(curve: Option<&Curve>) -> Option<f64> {
    match curve?.shape() {
        Shape::Polynomial { reference, .. } => Some(*reference),
        _ => None,
    }
}
