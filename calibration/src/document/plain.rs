//! The first document of a unit: three gyros, three accelerometers or none, all along the case axes, for a fit to complete.

use isotherm_protocol::document::{
    Accel, AccelOutput, AccelSensor, CURRENT_SCHEMA, Channel, Curve, Document, Gyro, GyroOutput, GyroSensor,
    Orientation, Shape, Temperature,
};

use crate::axes::AXES;

/// A document that passes on what a log has: weights and scale factors are one, and each sensor follows the channel of its name.
pub(crate) fn plain(
    unit: &str,
    output: GyroOutput,
    temperature: Temperature,
    accel: Option<AccelOutput>,
) -> Document {
    let channel = |kind: &str, index: usize| follows(&temperature.channel, kind, index);
    let weight = |wanted: GyroOutput| (output == wanted).then_some(1.0);
    let gyro = |(index, name): (usize, &str)| GyroSensor {
        channel: channel("gyro", index),
        increment_weight_arcsec_per_count: weight(GyroOutput::Counts),
        increment_weight_rad_per_rad: weight(GyroOutput::Mean),
        ..GyroSensor::bare(name)
    };
    let accels = |output: AccelOutput| {
        let scale = Curve::new(Shape::Constant { value: 1.0 }).in_unit(output.scale_unit());
        let accel = |(index, name): (usize, &str)| AccelSensor {
            channel: channel("accel", index),
            ..AccelSensor::bare(name, scale.clone())
        };
        let sensor = AXES.into_iter().enumerate().map(accel).collect();
        Accel { output, sensor, orientation: Orientation::along_case_axes() }
    };
    Document {
        schema: CURRENT_SCHEMA,
        unit: unit.to_owned(),
        created: None,
        note: None,
        origin: None,
        auxiliary: Vec::new(),
        gyro: Gyro {
            output,
            sensor: AXES.into_iter().enumerate().map(gyro).collect(),
            orientation: Orientation::along_case_axes(),
        },
        accel: accel.map(accels),
        temperature,
        mode_reversal: None,
        self_test: None,
    }
}

/// The channel that a sensor follows by its name: `accel0` for the first accelerometer, or the only one that there is.
pub(crate) fn follows(channels: &[Channel], kind: &str, index: usize) -> Option<String> {
    let own = format!("{kind}{index}");
    let named = channels.iter().find(|channel| channel.name == own);
    let only = channels.first().filter(|_| channels.len() == 1);
    named.or(only).map(|channel| channel.name.clone())
}
