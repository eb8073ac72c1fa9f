//! A run as windows: what each sensor put out without the terms of the fit, and when.

use std::collections::BTreeMap;

use isotherm_correction::sample::{ChannelName, TemperatureReading};
use isotherm_correction::thermal::Feature;
use isotherm_correction::units::Timestamp;
use isotherm_log::offline::Loaded;
use isotherm_protocol::document::{Curve, Document, Shape};

use super::bare::along_axes;
use super::checks::median_step_s;
use super::noise::Thermometer;
use super::thermometer::without_noise;
use crate::document::{Written, accelerometers};
use crate::error::Error;
use crate::numbers::{median, real};
use crate::runs::series::Series;
use crate::runs::table::{Rows, Table};
use crate::runs::{Run, Troubles};

/// One run.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Samples {
    /// What the run is called.
    pub name: String,
    /// Begin of the first tick (ns on the producer's clock).
    pub start_ns: i64,
    /// Length of a window (s).
    pub window_s: f64,
    /// Middle of each window since the start (s).
    pub time_s: Vec<f64>,
    /// Mean rate of each gyro (°/h); a window of which a fifth or more is missing has no number.
    pub gyros: Vec<Vec<f64>>,
    /// Mean output of each accelerometer less nothing but what its scale needs: specific force (m/s²).
    pub forces: Vec<Vec<f64>>,
    /// Specific force (m/s²) that one unit of each accelerometer's output stands for.
    pub responses: Vec<Vec<f64>>,
    /// Temperature readings by channel, without the noise of the thermometers.
    pub temperatures: BTreeMap<String, Vec<TemperatureReading>>,
    /// The thermometers by channel.
    pub thermometers: BTreeMap<String, Thermometer>,
    /// Smoothed temperatures by channel at the end of each window (°C).
    pub deg_c: BTreeMap<String, Vec<f64>>,
    /// What the correction passed over.
    pub troubles: Troubles,
}

impl Samples {
    /// Takes a run through the corrector with the bare document.
    ///
    /// # Errors
    /// As [`Run::correct_together`], and [`Error::Document`].
    pub fn of(run: &Run, series: &Series, bare: &Document, window_s: f64) -> Result<Self, Error> {
        let gyro_count = bare.gyro.sensor.len();
        let accel_count = accelerometers(bare).len();
        // Patterns of turned sensors, then the same with a bias of one on every accelerometer.
        let patterns = gyro_count.max(accel_count).div_ceil(3);
        let biased = with_unit_bias(bare);
        let kinds = if accel_count > 0 { vec![bare, &biased] } else { vec![bare] };
        let documents =
            kinds.iter().flat_map(|document| (0..patterns).map(|pattern| along_axes(document, pattern)));
        let loaded: Vec<Loaded> =
            documents.map(|document| Written::compiled(&document)).collect::<Result<_, Error>>()?;
        let tables = Table::together(run, &loaded, Rows::mostly_valid(window_s))?;
        let rates: Vec<[&[f64]; 3]> =
            tables.iter().take(patterns).map(|table| [0, 1, 2].map(|axis| table.rate(axis))).collect();
        let forces: Vec<[&[f64]; 3]> =
            tables.iter().map(|table| [0, 1, 2].map(|axis| table.force(axis))).collect();
        let of_forces = by_sensor(forces.get(..patterns).unwrap_or(&[]), accel_count);
        let biased = by_sensor(forces.get(patterns..).unwrap_or(&[]), accel_count);
        let difference = |(plain, biased): (&Vec<f64>, &Vec<f64>)| {
            plain.iter().zip(biased).map(|(plain, biased)| plain - biased).collect()
        };
        let responses = of_forces.iter().zip(&biased).map(difference).collect();
        let gyros = by_sensor(&rates, gyro_count);
        let Table { time_s, troubles, temperature_deg_c, .. } = tables.into_iter().next().unwrap_or_default();
        let (temperatures, thermometers) = thermometers(series);
        Ok(Self {
            name: run.name.clone(),
            start_ns: start_ns(series),
            window_s,
            time_s,
            gyros,
            forces: of_forces,
            responses,
            temperatures,
            thermometers,
            deg_c: temperature_deg_c,
            troubles,
        })
    }

    /// Windows of a sensor that have numbers, and all.
    pub fn complete(&self, gyro: bool, index: usize) -> [usize; 2] {
        let outputs = if gyro { &self.gyros } else { &self.forces };
        let own = outputs.get(index).map_or(&[][..], Vec::as_slice);
        [own.iter().filter(|value| value.is_finite()).count(), own.len()]
    }
}

/// Begin of the first gyro tick (ns).
fn start_ns(series: &Series) -> i64 {
    #[expect(clippy::cast_possible_truncation, reason = "a tick is at most some seconds")]
    let first = series.gyros.duration_s.first().map_or(0, |length| (length * 1e9) as i64);
    series.gyros.end_ns.first().map_or(0, |end| end.saturating_sub(first))
}

/// The temperature readings of a series by channel, without the noise of the thermometers, and the thermometers: see [`without_noise`].
fn thermometers(
    series: &Series,
) -> (BTreeMap<String, Vec<TemperatureReading>>, BTreeMap<String, Thermometer>) {
    let (mut temperatures, mut thermometers) = (BTreeMap::new(), BTreeMap::new());
    for (name, channel) in &series.temperatures {
        let (raw, sigma) = without_noise(&channel.since_s(), &channel.raw);
        let (usual, step_s) = (median(&channel.raw), median_step_s(&channel.time_ns));
        thermometers.insert(name.clone(), Thermometer { usual, sigma, step_s });
        let Ok(channel_name) = ChannelName::from(name) else { continue };
        let reading = |(time, raw): (&i64, f64)| TemperatureReading {
            channel: channel_name,
            time: Timestamp::from_ns(*time),
            raw,
        };
        temperatures.insert(name.clone(), channel.time_ns.iter().zip(raw).map(reading).collect());
    }
    (temperatures, thermometers)
}

/// A constant bias of one output unit on every accelerometer.
fn with_unit_bias(bare: &Document) -> Document {
    let mut document = bare.clone();
    for sensor in document.accel.iter_mut().flat_map(|accel| &mut accel.sensor) {
        sensor.set(Feature::One, Curve::new(Shape::Constant { value: 1.0 }));
    }
    document
}

/// The outputs of single sensors from the means of those that share an axis.
///
/// An axis with G sensors has `m_0 = Σs/G`, and `m_p` with the p-th turned round: `s_p = G·(m_0 − m_p)/2`.
fn by_sensor(patterns: &[[&[f64]; 3]], count: usize) -> Vec<Vec<f64>> {
    let mut sensors = vec![Vec::new(); count];
    for axis in 0..3.min(count) {
        let mine: Vec<usize> = (axis..count).step_by(3).collect();
        let shared = real(mine.len());
        let Some(mean) = patterns.first().map(|pattern| pattern[axis]) else { continue };
        let mut rest: Vec<f64> = mean.iter().map(|mean| shared * mean).collect();
        for (pattern, sensor) in patterns.iter().skip(1).zip(mine.iter().skip(1)) {
            let turned = pattern[axis];
            let own: Vec<f64> =
                mean.iter().zip(turned).map(|(all, turned)| 0.5 * shared * (all - turned)).collect();
            rest.iter_mut().zip(&own).for_each(|(rest, own)| *rest -= own);
            sensors[*sensor] = own;
        }
        sensors[axis] = rest;
    }
    sensors
}

#[expect(clippy::cast_precision_loss, reason = "small numbers")]
#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sensors_that_share_an_axis_are_told_apart() {
        let truth = [1.0, 2.0, 3.0, 40.0, 50.0, 60.0, 700.0];
        let mean = |pattern: usize, axis: usize| {
            let mine: Vec<usize> = (axis..truth.len()).step_by(3).collect();
            let sign = |sensor: usize| if pattern > 0 && sensor / 3 == pattern { -1.0 } else { 1.0 };
            mine.iter().map(|&sensor| sign(sensor) * truth[sensor]).sum::<f64>() / mine.len() as f64
        };
        let means: Vec<[Vec<f64>; 3]> = (0..3).map(|p| [0, 1, 2].map(|axis| vec![mean(p, axis)])).collect();
        let patterns: Vec<[&[f64]; 3]> =
            means.iter().map(|axes| [&axes[0][..], &axes[1][..], &axes[2][..]]).collect();
        for (found, truth) in by_sensor(&patterns, 7).iter().zip(truth) {
            assert!((found[0] - truth).abs() < 1e-12, "{found:?} {truth}");
        }
    }
}
