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

use isotherm_protocol::document::{AccelSensor, Curve, Document, Shape};

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

/// A curve that has one value everywhere.
pub(crate) fn constant(value: f64) -> Curve {
    Curve::new(Shape::Constant { value: tidy(value) })
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
