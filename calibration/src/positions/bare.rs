//! A document of a unit that has none yet: everything as the log has it, for a fit to complete.

use isotherm_protocol::document::{
    Accel, AccelOutput, AccelSensor, CURRENT_SCHEMA, Channel, Curve, Document, Filter, Gyro, GyroOutput,
    GyroSensor, Orientation, Shape, Temperature, Unit,
};

use isotherm_correction::sample::{MAX_SENSORS, MIN_SENSORS, OutputKind};

use crate::error::Error;
use crate::runs::series::Series;

/// Physical range of a channel whose readings are °C already.
const RANGE_DEG_C: [f64; 2] = [-70.0, 130.0];

/// A document that passes on what a log has: gyros in rad/s with weight one, accelerometers with scale factor one, both along
/// the case axes; temperature channels that read °C.
///
/// # Errors
/// [`Error::Refused`] where the log needs a document: counts of gyros, skewed sensors, channels that do not read °C.
pub fn bare(series: &Series, accel_output: AccelOutput) -> Result<Document, Error> {
    let mut reasons = Vec::new();
    if series.gyros.output != Some(OutputKind::Mean) {
        reasons.push(
            "the log's gyro readings are counts: give a document with increment weights (--calibration)"
                .to_owned(),
        );
    }
    for (kind, count) in
        [("gyros", series.gyros.readings.len()), ("accelerometers", series.accels.readings.len())]
    {
        if count == 0 {
            reasons.push(format!("the log has no {kind}: see [file.gyro] and [file.accel] of its mapping"));
        } else if count != MIN_SENSORS {
            reasons.push(format!(
                "the log has {count} {kind}, from {MIN_SENSORS} to {MAX_SENSORS} are possible, but only three have \
                 known axes: give the nominal axes with --calibration"
            ));
        }
    }
    let (mut channels, mut other) = (Vec::new(), Vec::new());
    for (name, channel) in &series.temperatures {
        let good: Vec<f64> = channel.raw.iter().copied().filter(|raw| raw.is_finite()).collect();
        let in_range = good.iter().filter(|raw| (RANGE_DEG_C[0]..=RANGE_DEG_C[1]).contains(*raw)).count();
        if in_range * 2 < good.len() || good.is_empty() {
            other.push(format!("{name:?}"));
        }
        channels.push(Channel {
            name: name.clone(),
            conversion_deg_c: vec![0.0, 1.0],
            range_deg_c: RANGE_DEG_C,
            spike_limit_deg_c: 5.0,
        });
    }
    if !other.is_empty() {
        reasons.push(format!(
            "temperature {} {} not read °C (most readings are outside {} to {} °C, or not numbers): give the \
             conversion with --calibration",
            if other.len() == 1 { "channel" } else { "channels" },
            if other.len() == 1 { format!("{} does", other[0]) } else { format!("{} do", other.join(", ")) },
            RANGE_DEG_C[0],
            RANGE_DEG_C[1]
        ));
    }
    if !reasons.is_empty() {
        return Err(Error::Refused(reasons));
    }
    let follows = |kind: &str, index: usize| follows(&channels, kind, index);
    let names = || ["x", "y", "z"].into_iter().enumerate();
    let scale_unit = match accel_output {
        AccelOutput::Counts => Unit::CountsPerSPerMPerS2,
        AccelOutput::Volts => Unit::VPerMPerS2,
        AccelOutput::MetresPerSecondSquared => Unit::MPerS2PerMPerS2,
    };
    let gyro = names().map(|(index, name)| GyroSensor {
        channel: follows("gyro", index),
        increment_weight_rad_per_rad: Some(1.0),
        ..GyroSensor::bare(name)
    });
    let accel = names().map(|(index, name)| AccelSensor {
        channel: follows("accel", index),
        ..AccelSensor::bare(name, Curve::new(Shape::Constant { value: 1.0 }).in_unit(scale_unit))
    });
    Ok(Document {
        schema: CURRENT_SCHEMA,
        unit: series.unit.to_string(),
        created: None,
        note: None,
        origin: None,
        auxiliary: Vec::new(),
        temperature: Temperature {
            assumed_deg_c: 25.0,
            filter: (!channels.is_empty()).then_some(Filter {
                grid_step_s: 1.0,
                smoothing_s: 5.0,
                derivative_step_s: 1.0,
                stale_after_s: 60.0,
                branch_dead_band_deg_c2_per_s3: None,
            }),
            channel: channels.clone(),
        },
        gyro: Gyro {
            output: GyroOutput::Mean,
            sensor: gyro.collect(),
            orientation: Orientation::along_case_axes(),
        },
        accel: Some(Accel {
            output: accel_output,
            sensor: accel.collect(),
            orientation: Orientation::along_case_axes(),
        }),
        mode_reversal: None,
        self_test: None,
    })
}

/// The channel that a sensor follows by its name: `accel0` for the first accelerometer, or the only one that there is.
fn follows(channels: &[Channel], kind: &str, index: usize) -> Option<String> {
    let own = format!("{kind}{index}");
    let named = channels.iter().find(|channel| channel.name == own);
    let only = channels.first().filter(|_| channels.len() == 1);
    named.or(only).map(|channel| channel.name.clone())
}
