//! A document of a unit that has none yet: everything as the log has it, for a fit to complete.

use isotherm_protocol::document::{AccelOutput, Channel, Document, Filter, GyroOutput, Temperature};

use isotherm_correction::sample::{MAX_SENSORS, MIN_SENSORS, OutputKind};

use crate::document::plain;
use crate::error::Error;
use crate::runs::series::Series;
use crate::runs::{Run, Watch};

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
    let filter = Filter {
        grid_step_s: 1.0,
        smoothing_s: 5.0,
        derivative_step_s: 1.0,
        stale_after_s: 60.0,
        branch_dead_band_deg_c2_per_s3: None,
    };
    let filter = (!channels.is_empty()).then_some(filter);
    let temperature = Temperature { assumed_deg_c: 25.0, filter, channel: channels };
    Ok(plain(series.unit.as_str(), GyroOutput::Mean, temperature, Some(accel_output)))
}

/// The same from a run whose readings that are no counts are in "V" or "m/s2".
///
/// # Errors
/// As [`Run::series`] and [`bare`].
pub fn of_run(run: &Run, accelerometer_unit: &str, watch: impl Watch) -> Result<Document, Error> {
    let series = run.series(watch)?;
    let output = match (series.accels.output, accelerometer_unit) {
        (Some(OutputKind::Counts), _) => AccelOutput::Counts,
        (_, "V") => AccelOutput::Volts,
        _ => AccelOutput::MetresPerSecondSquared,
    };
    bare(&series, output)
}
