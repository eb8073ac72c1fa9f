//! The nominal calibration of a unit: scale and axes, and nothing that knows of temperature, bias or mode.

use isotherm_protocol::document::Document;

/// A document without anything that knows of temperature, bias or mode: what a fit starts from, and what "before" means in
/// its report.
#[must_use]
pub fn nominal(document: &Document) -> Document {
    let mut document = document.clone();
    document.mode_reversal = None;
    document.gyro.orientation.thermal = None;
    for sensor in &mut document.gyro.sensor {
        sensor.increment_weight_error = None;
        sensor.static_bias = None;
        sensor.magnetic_bias = None;
        sensor.slow_meander = None;
        sensor.thermal_rate = None;
        sensor.thermal_acceleration = None;
        sensor.lag.clear();
        sensor.trend = None;
        sensor.servo = None;
    }
    document
}
