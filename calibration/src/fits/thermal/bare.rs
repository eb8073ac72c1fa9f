//! A unit without the terms that a thermal fit gives it, and a nominal document for a log that comes without one.

use isotherm_correction::sample::OutputKind;
use isotherm_correction::thermal::Feature;
use isotherm_protocol::document::{AccelOutput, Document, Filter, GyroOutput, Orientation, Temperature};

use super::checks::median_step_s;
use crate::axes::AXES;
use crate::document::{ASSUMED_DEG_C, channels, faults, follows, plain, reads_deg_c};
use crate::error::Error;
use crate::numbers::percentile;
use crate::runs::{self, series::Series};

/// Longest step of a grid that a document may state (s).
const LONGEST_GRID_STEP_S: f64 = 3600.0;
/// Grid points between two readings that they can carry: between readings there are only straight lines.
const FINEST_GRID: f64 = 3.0;
/// Distances of readings over which a temperature must not become stale.
const FRESH_READINGS: f64 = 2.0;
/// Where the readings of a thermometer without a conversion must lie to be °C.
pub const DEG_C: [f64; 2] = [-100.0, 200.0];

/// Terms that hold with the filter that they were fitted with only.
pub const DYNAMIC: [Feature; 3] = [Feature::ThermalRate, Feature::ThermalAcceleration, Feature::Lag];

/// The document without what the fit finds of sensors that follow a channel: static and thermal terms.
/// Scale, axes, mode and magnetic terms stay.
pub fn bare(document: &Document) -> Document {
    let mut document = document.clone();
    let stays = |feature: Feature| feature != Feature::One && !DYNAMIC.contains(&feature);
    for sensor in document.gyro.sensor.iter_mut().filter(|sensor| sensor.channel.is_some()) {
        sensor.terms.retain(stays);
        sensor.trend = None;
    }
    let accels = document.accel.iter_mut().flat_map(|accel| &mut accel.sensor);
    for sensor in accels.filter(|sensor| sensor.channel.is_some()) {
        sensor.terms.retain(stays);
    }
    document
}

/// The document with sensors along the case axes by threes, some of them turned round, so that what comes out along an axis is
/// the mean of its sensors. Pattern 0 turns none; pattern p turns the sensors 3·p to 3·p + 2.
pub fn along_axes(document: &Document, pattern: usize) -> Document {
    let mut document = document.clone();
    let rows = |count: usize| {
        (0..count).map(|index| {
            let sign = if pattern > 0 && index / 3 == pattern { -1.0 } else { 1.0 };
            let mut row = [0.0; 3];
            row[index % 3] = sign;
            row
        })
    };
    let gyros = rows(document.gyro.sensor.len()).collect();
    document.gyro.orientation = Orientation { rows: gyros, weights: None, thermal: None, parity: None };
    if let Some(accel) = &mut document.accel {
        let accels = rows(accel.sensor.len()).collect();
        accel.orientation = Orientation { rows: accels, weights: None, thermal: None, parity: None };
    }
    document
}

/// The document of a unit of which nothing is known but its log, for a fit over temperature.
///
/// # Errors
/// [`Error::Refused`] where the log does not allow it: counts, other than three sensors, thermometers that are not in °C or whose
/// sensors cannot be told.
pub fn nominal_of(series: &Series) -> Result<Document, Error> {
    let reasons = faults(series, false, DEG_C);
    if !reasons.is_empty() {
        return Err(Error::Refused(reasons));
    }
    let nominal = nominal(series);
    if nominal.gyro.sensor.iter().all(|gyro| gyro.channel.is_some()) {
        return Ok(nominal);
    }
    let list = series.temperatures.keys().map(String::as_str).collect::<Vec<_>>().join(", ");
    Err(Error::refused(if list.is_empty() {
        "the log has no temperature: a thermal fit needs at least one channel; name it in the mapping"
            .to_owned()
    } else {
        format!(
            "the names of the temperature channels ({list}) do not tell which gyro follows which: name them \
             gyro0, gyro1, gyro2 (and accel0 …) in the mapping, or give a document (--calibration)"
        )
    }))
}

/// The document of a unit of three gyros of which nothing is known but its log: weights and scale factors of one, orthogonal axes;
/// the accelerometers where they are three and no counts, the thermometers where they read °C.
pub fn nominal(series: &Series) -> Document {
    let mut channels = channels(series, DEG_C, spike_limit);
    channels.retain(|channel| reads_deg_c(&series.temperatures[&channel.name], DEG_C));
    let of = |kind| (0..AXES.len()).filter_map(|index| follows(&channels, kind, index)).collect::<Vec<_>>();
    let followed = [of("gyro"), of("accel")].concat();
    channels.retain(|channel| followed.contains(&channel.name));
    let step =
        series.temperatures.values().map(|channel| median_step_s(&channel.time_ns)).fold(0.0, f64::max);
    let filter = (!channels.is_empty()).then(|| filter(step));
    let temperature = Temperature { assumed_deg_c: ASSUMED_DEG_C, filter, channel: channels };
    let counts = series.gyros.output == Some(OutputKind::Counts);
    let output = if counts { GyroOutput::Counts } else { GyroOutput::Mean };
    let ours = series.accels.readings.len() == AXES.len() && series.accels.output == Some(OutputKind::Mean);
    plain(series.unit.as_str(), output, temperature, ours.then_some(AccelOutput::MetresPerSecondSquared))
}

/// A filter for readings that come every so many seconds.
pub fn filter(step_s: f64) -> Filter {
    // Readings about a second apart belong on a grid of a second; lags need some points between those that come seldom.
    let own_s = if step_s > FINEST_GRID { step_s / FINEST_GRID } else { step_s };
    let grids = [0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 30.0, 60.0];
    let minutes = || (60.0 * libm::ceil(own_s / 60.0)).min(LONGEST_GRID_STEP_S);
    let grid = grids.into_iter().find(|step| *step > 0.8 * own_s).unwrap_or_else(minutes);
    Filter {
        grid_step_s: grid,
        smoothing_s: 10.0 * grid,
        derivative_step_s: 10.0 * grid,
        stale_after_s: 20.0 * grid,
        branch_dead_band_deg_c2_per_s3: None,
    }
}

/// Has a document carry readings that are so far apart (s): without a grid between them, and with spike limits beyond what a ramp does
/// from one to the next. Gives the step of the grid that it had, and of the one that it has now; `None` where it can carry them.
pub fn carry(document: &mut Document, runs: &[Series], step_s: f64) -> Option<[f64; 2]> {
    let stated = document.temperature.filter.as_ref()?;
    let stated_s = stated.grid_step_s;
    if step_s <= FINEST_GRID * stated_s && FRESH_READINGS * step_s <= stated.stale_after_s {
        return None;
    }
    for channel in &mut document.temperature.channel {
        let limit = |readings: &runs::series::Channel| {
            let powers = &channel.conversion_deg_c;
            let deg_c = |raw: &f64| powers.iter().rev().fold(0.0, |sum, power| sum * raw + power);
            spike_limit(&readings.raw.iter().map(deg_c).collect::<Vec<f64>>())
        };
        let limits = runs.iter().filter_map(|series| series.temperatures.get(&channel.name)).map(limit);
        channel.spike_limit_deg_c = limits.fold(channel.spike_limit_deg_c, f64::max);
    }
    let carried = filter(step_s);
    let grids = [stated_s, carried.grid_step_s];
    document.temperature.filter = Some(carried);
    Some(grids)
}

/// A spike limit that the log's own slope does not touch.
fn spike_limit(raw: &[f64]) -> f64 {
    let high = percentile(raw.iter().zip(raw.iter().skip(1)).map(|(a, b)| (b - a).abs()), 99);
    if high > 0.2 { libm::ceil(10.0 * high) } else { 2.0 }
}
