//! Axes and scale factors of gyros over temperature: `C_0`, `C_1` and K(T) from a rate table at several temperatures [003, 004].
//!
//! Each temperature by itself gives every gyro's weight and axis with their errors; lines and a parabola are laid through them.

use isotherm_correction::thermal::Feature;
use isotherm_protocol::document::{Curve, Document, OrientationThermal, Shape};
use nalgebra::{DMatrix, DVector};

use super::fit::Wanted;
use super::measure::points;
use super::model::{GyroRates, Point, solve};
use super::read::Turned;
use crate::document::tidy;
use crate::finding::Kind;
use crate::fits::modes::document::row;
use crate::fits::positions::document::with_room;
use crate::fits::positions::model::across;
use crate::fits::positions::temperature::{levels, reference};
use crate::fits::thermal::scale::{Holds, put};
use crate::lsq::linear::{self, Linear, Weak};
use crate::numbers::{ARCSEC_PER_RAD, dot, ends, mean, norm, once_each, real};

/// Smallest share of the largest singular value of a line.
const SINGULAR: f64 = 1e-9;
/// Highest power of a scale factor error.
const HIGHEST: usize = 2;

/// One temperature.
#[derive(Debug, Clone, PartialEq)]
pub struct Level {
    /// What the axes follow (°C).
    pub deg_c: f64,
    /// The gyros' own temperatures (°C).
    pub own_deg_c: Vec<f64>,
    /// The gyros.
    pub gyros: Vec<GyroRates>,
}

/// A gyro over temperature.
#[derive(Debug, Clone, PartialEq)]
pub struct Line {
    /// C at the reference, a unit vector.
    pub axis: [f64; 3],
    /// Its change (rad/°C).
    pub slope: [f64; 3],
    /// Standard errors of the change's elements (rad/°C).
    pub slope_sigma: [f64; 3],
    /// `K_old`/K at the reference.
    pub gain: f64,
    /// Scale factor error beside that (ppm), by powers of the gyro's own temperature from the reference, from the first.
    pub scale_ppm: Vec<f64>,
    /// Standard errors of those.
    pub scale_sigma_ppm: Vec<f64>,
    /// χ² per degree of freedom of the axis about its line; no number with two temperatures.
    pub chi_square: f64,
}

/// All gyros over temperature.
#[derive(Debug, Clone, PartialEq)]
pub struct OverTemperature {
    /// Channels whose mean the axes follow.
    pub channels: Vec<String>,
    /// Reference (°C).
    pub reference_deg_c: f64,
    /// The temperatures, ascending.
    pub levels: Vec<Level>,
    /// The gyros.
    pub lines: Vec<Line>,
    /// Which level each run is of.
    level_of: Vec<usize>,
}

/// Channels that the gyros' axes follow: the document's, or the gyros' own.
fn channels(base: &Document) -> Vec<String> {
    if let Some(thermal) = &base.gyro.orientation.thermal {
        return thermal.channels.clone();
    }
    once_each(base.gyro.sensor.iter().filter_map(|sensor| sensor.channel.clone()))
}

/// The number of each run's temperature, and these temperatures (°C), where the gyros' axes follow any.
pub(super) fn levels_of(base: &Document, runs: &[Turned]) -> Option<(Vec<usize>, Vec<f64>)> {
    let channels = channels(base);
    let of_run = |run: &Turned| -> Option<f64> {
        let of = |name: &String| run.binned.channels_deg_c.get(name).copied();
        let all: Option<Vec<f64>> = channels.iter().map(of).collect();
        all.filter(|all| !all.is_empty()).map(|all| mean(&all))
    };
    Some(levels(&runs.iter().map(of_run).collect::<Option<Vec<f64>>>()?))
}

impl OverTemperature {
    /// From the runs and the true rates of their steps; `None` with one temperature.
    ///
    /// # Errors
    /// The first temperature (°C) that does not tell weights and axes of all gyros by itself.
    pub(super) fn of(
        wanted: &Wanted<'_>,
        runs: &[Turned],
        shows: &[(f64, [f64; 3])],
    ) -> Result<Option<Self>, f64> {
        let Some((level_of, levels_deg_c)) = levels_of(wanted.base, runs) else { return Ok(None) };
        if levels_deg_c.len() < 2 {
            return Ok(None);
        }
        let mut found = Vec::new();
        for (number, deg_c) in levels_deg_c.iter().enumerate() {
            let own: Vec<usize> = (0..runs.len()).filter(|run| level_of[*run] == number).collect();
            let gyro = |sensor: usize| {
                let all = points(wanted, own.iter().map(|run| &runs[*run]), sensor, shows[sensor]);
                solve(&all, row(wanted.base, sensor, f64::NAN)).ok().filter(|found| found.axis.is_some())
            };
            let gyros: Option<Vec<GyroRates>> = (0..shows.len()).map(gyro).collect();
            let Some(gyros) = gyros else { return Err(*deg_c) };
            let own_deg_c = |sensor: &isotherm_protocol::document::GyroSensor| {
                let channel = sensor.channel.as_ref();
                let of = |run: &usize| runs[*run].binned.channels_deg_c.get(channel?).copied();
                let all: Option<Vec<f64>> = own.iter().map(of).collect();
                all.map_or(*deg_c, |all| mean(&all))
            };
            found.push(Level {
                deg_c: *deg_c,
                own_deg_c: wanted.base.gyro.sensor.iter().map(own_deg_c).collect(),
                gyros,
            });
        }
        let ends = [levels_deg_c[0], levels_deg_c[levels_deg_c.len() - 1]];
        let stated = wanted.base.gyro.orientation.thermal.as_ref().map(|thermal| thermal.reference_deg_c);
        let reference_deg_c = stated.unwrap_or_else(|| reference(ends[0], ends[1]));
        let line = |sensor: usize| line(&found, sensor, reference_deg_c);
        let lines: Option<Vec<Line>> = (0..shows.len()).map(line).collect();
        let Some(lines) = lines else { return Ok(None) };
        let channels = channels(wanted.base);
        Ok(Some(Self { channels, reference_deg_c, levels: found, lines, level_of }))
    }

    /// The points of a gyro as they would be at the reference, so that one straight line holds for all of them.
    pub(super) fn at_reference(
        &self,
        wanted: &Wanted<'_>,
        runs: &[Turned],
        sensor: usize,
        shows: (f64, [f64; 3]),
    ) -> Vec<Point> {
        let line = &self.lines[sensor];
        let of_run = |run: usize| {
            let level = &self.levels[self.level_of[run]];
            let scale = 1.0 + 1e-6 * line.scale_at(level.own_deg_c[sensor] - self.reference_deg_c);
            let away = level.deg_c - self.reference_deg_c;
            let turned = line.slope.map(|slope| slope * away);
            points(wanted, [&runs[run]], sensor, shows).into_iter().map(move |point| {
                // A larger scale factor shows as a smaller gain.
                let by_axis = dot(turned, point.rate);
                Point { shown: point.shown * scale - line.gain * by_axis, ..point }
            })
        };
        (0..runs.len()).flat_map(of_run).collect()
    }

    /// Puts slopes of axes and scale factors into a document that has what holds at the reference. Gyros that were refused keep theirs.
    pub(super) fn put(&self, document: &mut Document, gyros: &[Result<GyroRates, Kind>]) {
        let ends = |of: &dyn Fn(&Level) -> f64| ends(self.levels.iter().map(of));
        let old = document.gyro.orientation.thermal.take();
        let slopes = (0..self.lines.len()).map(|sensor| {
            if gyros.get(sensor).is_some_and(Result::is_ok) {
                return self.lines[sensor].slope.map(|slope| tidy(slope * ARCSEC_PER_RAD));
            }
            let old = old.as_ref().and_then(|old| old.slopes_arcsec_per_deg_c.get(sensor));
            old.copied().unwrap_or_default()
        });
        let slopes: Vec<[f64; 3]> = slopes.collect();
        document.gyro.orientation.thermal = Some(OrientationThermal {
            channels: self.channels.clone(),
            reference_deg_c: self.reference_deg_c,
            range_deg_c: with_room(ends(&|level| level.deg_c)),
            slopes_arcsec_per_deg_c: slopes,
            hysteresis: old.map(|old| old.hysteresis).unwrap_or_default(),
        });
        let sensors = document.gyro.sensor.iter_mut().zip(&self.lines).zip(gyros).enumerate();
        for (index, ((sensor, line), found)) in sensors {
            if found.is_err() || sensor.channel.is_none() {
                continue;
            }
            let s: Vec<f64> = std::iter::once(0.0).chain(line.scale_ppm.iter().copied()).collect();
            let range = with_room(ends(&|level| level.own_deg_c[index]));
            let none = Curve::new(Shape::Constant { value: 0.0 });
            let old = sensor.terms.curve(Feature::Reading).unwrap_or(&none);
            sensor.set(Feature::Reading, put(old, (self.reference_deg_c, range), &s, Holds::Error));
        }
    }
}

impl Line {
    /// Scale factor error beside that at the reference (ppm).
    fn scale_at(&self, away: f64) -> f64 {
        self.scale_ppm.iter().rev().fold(0.0, |sum, c| (sum + c) * away)
    }
}

/// A polynomial of a degree through values with standard errors.
fn polynomial(x: &[f64], y: &[f64], sigma: &[f64], degree: usize) -> Option<Linear> {
    let power = |power: usize, x: f64| (0..power).fold(1.0, |product, _| product * x);
    let design = DMatrix::from_fn(x.len(), degree + 1, |i, j| power(j, x[i]) / sigma[i]);
    let values = DVector::from_fn(x.len(), |i, _| y[i] / sigma[i]);
    linear::solve(&design, &values, Weak::Refuse(SINGULAR)).ok()
}

/// Axis and scale factor of one gyro over temperature.
fn line(levels: &[Level], sensor: usize, reference_deg_c: f64) -> Option<Line> {
    let of = |level: &Level| level.gyros[sensor].clone();
    let first = of(levels.first()?).axis?;
    let across = across(first);

    let away: Vec<f64> = levels.iter().map(|level| level.deg_c - reference_deg_c).collect();
    let (mut axis, mut slope, mut variance) = (first, [0.0; 3], [0.0; 3]);
    let mut chi_square = 0.0;
    for direction in across {
        let angle = |level: &Level| of(level).axis.map_or(f64::NAN, |axis| dot(axis, direction));
        let sigma = |level: &Level| {
            let found = of(level);
            let d = DVector::from_column_slice(&direction);
            (found.covariance.view((0, 0), (3, 3)) * &d).dot(&d).max(0.0).sqrt() / found.gain[0].abs()
        };
        let angles: Vec<f64> = levels.iter().map(angle).collect();
        let sigmas: Vec<f64> = levels.iter().map(sigma).collect();
        let found = polynomial(&away, &angles, &sigmas, 1)?;
        chi_square += found.chi_square();
        let Linear { coefficients: c, inverse: covariance, .. } = found;
        for i in 0..3 {
            axis[i] += c[0] * direction[i];
            slope[i] += c[1] * direction[i];
            variance[i] += covariance[(1, 1)] * direction[i] * direction[i];
        }
    }
    let length = norm(axis);
    let own: Vec<f64> = levels.iter().map(|level| level.own_deg_c[sensor] - reference_deg_c).collect();
    let inverse: Vec<f64> = levels.iter().map(|level| 1.0 / of(level).gain[0]).collect();
    let sigma: Vec<f64> = levels
        .iter()
        .map(|level| {
            let [gain, sigma] = of(level).gain;
            sigma / (gain * gain)
        })
        .collect();
    let Linear { coefficients: scale, inverse: covariance, .. } =
        polynomial(&own, &inverse, &sigma, HIGHEST.min(levels.len() - 1))?;
    let at_reference = scale[0];
    let degrees = 2.0 * (real(levels.len()) - 2.0);
    let powers = 1..scale.len();
    Some(Line {
        axis: axis.map(|c| c / length),
        slope,
        slope_sigma: variance.map(f64::sqrt),
        gain: 1.0 / at_reference,
        scale_ppm: powers.clone().map(|power| 1e6 * scale[power] / at_reference).collect(),
        scale_sigma_ppm: powers
            .map(|power| 1e6 * covariance[(power, power)].sqrt() / at_reference.abs())
            .collect(),
        chi_square: chi_square / degrees,
    })
}
