//! The first document of a unit: three gyros, three accelerometers or none, all along the case axes, for a fit to complete.

use isotherm_correction::sample::OutputKind;
use isotherm_protocol::document::{
    Accel, AccelOutput, AccelSensor, CURRENT_SCHEMA, Channel, Curve, Document, Gyro, GyroOutput, GyroSensor,
    Orientation, Shape, Temperature,
};

use crate::axes::AXES;
use crate::runs::series::{Channel as Readings, Series};

/// Temperature that a first document assumes where none is read (°C).
pub(crate) const ASSUMED_DEG_C: f64 = 25.0;

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

/// Why a log by itself does not tell a document: readings that are counts, other than three sensors, thermometers that do not read °C
/// within a range. `of_accelerometers` where accelerometers are needed, as they are, counts or not.
pub(crate) fn faults(series: &Series, of_accelerometers: bool, [low, high]: [f64; 2]) -> Vec<String> {
    let kinds = [("gyro", &series.gyros, true), ("accelerometer", &series.accels, of_accelerometers)];
    let mut reasons = Vec::new();
    for (kind, ticks, needed) in kinds {
        if ticks.output == Some(OutputKind::Counts) && (kind == "gyro" || !of_accelerometers) {
            reasons.push(format!(
                "the {kind} readings are counts: give a document with their scale (--calibration)"
            ));
        }
        match ticks.readings.len() {
            0 if needed => {
                reasons.push(format!(
                    "the log has no {kind} ticks: see [file.gyro] and [file.accel] of its mapping"
                ));
            }
            0 | 3 => {}
            count => reasons.push(format!(
                "the log has {count} {kind}s: without a document (--calibration) only three have known axes"
            )),
        }
    }
    for (name, channel) in &series.temperatures {
        if !reads_deg_c(channel, [low, high]) {
            reasons.push(format!(
                "temperature channel {name:?} has readings outside {low} to {high} °C: it is not a temperature in °C: name \
                 the right column in the mapping, or give a document with the channel's conversion (--calibration)"
            ));
        }
    }
    reasons
}

/// Whether a thermometer's readings may be °C: half of them are within a range.
pub(crate) fn reads_deg_c(channel: &Readings, [low, high]: [f64; 2]) -> bool {
    let good = channel.raw.iter().filter(|raw| (low..=high).contains(*raw)).count();
    2 * good >= channel.raw.len()
}

/// The temperature channels of a log that read °C, each with its limits: range and spikes.
pub(crate) fn channels(
    series: &Series,
    range: [f64; 2],
    spike_limit: impl Fn(&[f64]) -> f64,
) -> Vec<Channel> {
    let channel = |(name, readings): (&String, &Readings)| Channel {
        name: name.clone(),
        conversion_deg_c: vec![0.0, 1.0],
        range_deg_c: range,
        spike_limit_deg_c: spike_limit(&readings.raw),
    };
    series.temperatures.iter().map(channel).collect()
}
