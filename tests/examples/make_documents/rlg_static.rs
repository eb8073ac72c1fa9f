//! RLG-STATIC: the parked laser gyro of the real log, by the scale factors that the log itself states.

use std::path::Path;

use isotherm_protocol::document::{
    Accel, AccelOutput, AccelSensor, Curve, Document, Gyro, GyroOutput, GyroSensor, Orientation, Origin,
    Shape,
};
use isotherm_tests::logs::RealLog;

use crate::instrument::{AXES, bare_gyro, tidy};
use crate::logs::origin;
use crate::write::{Failure, document};

/// Third header row of the log: angle per gyro count (″).
const GYRO_ARCSEC: f64 = 0.1;
/// The same row: velocity per accelerometer count (µg·s).
const ACCEL_MICRO_G_S: f64 = 125.0;
/// Second header row: what the log calls g (m/s²).
const G_M_PER_S2: f64 = 9.780_327;

const NOTE: &str = "Scale factors as the log's header states them, nothing else: no temperature was logged and no bias is \
known. One gyro count is 0.1\u{2033}. One accelerometer count is 125 \u{b5}g\u{b7}s with the g of the header's second row, \
9.780327 m/s\u{b2} (gravity on the equator), not the standard 9.80665: the mean force of the log then agrees with normal \
gravity at its place, 9.7955 m/s\u{b2}, to some \u{b5}g. Axes: x right, y forward, z up.";

/// The document of the real laser-gyro log.
///
/// # Errors
/// Where the log cannot be read.
pub(crate) fn make(data: &Path) -> Result<Document, Failure> {
    let counts_per_s = tidy(1.0 / (ACCEL_MICRO_G_S * 1e-6 * G_M_PER_S2));
    let gyro = |name: &&str| GyroSensor {
        channel: None,
        increment_weight_arcsec_per_count: Some(GYRO_ARCSEC),
        ..bare_gyro(0, name)
    };
    let accel = |name: &&str| {
        AccelSensor::bare(
            name,
            Curve::new(Shape::Constant { value: counts_per_s }).in_unit(AccelOutput::Counts.scale_unit()),
        )
    };
    Ok(Document {
        note: Some(NOTE.into()),
        origin: Some(Origin {
            method: Some("header of the log".into()),
            log: vec![origin(data, RealLog::RlgStatic)?],
            ..Origin::default()
        }),
        gyro: Gyro {
            output: GyroOutput::Counts,
            sensor: AXES.iter().map(gyro).collect(),
            orientation: Orientation::along_case_axes(),
        },
        accel: Some(Accel {
            output: AccelOutput::Counts,
            sensor: AXES.iter().map(accel).collect(),
            orientation: Orientation::along_case_axes(),
        }),
        ..document("RLG-STATIC")
    })
}
