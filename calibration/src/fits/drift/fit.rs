//! Everything that is said of one sensor, made for all of them on every processor core.

use super::markov::{Beside, DailyLine, Estimate, Fit};
use super::pieces::{Grid, Sensor};
use super::slow::{Autocorrelation, Slow};
use super::trend::Extrapolation;
use crate::fits::drift::allan::confidence::degrees_of_freedom;
use crate::fits::drift::allan::deviation::lengths;
use crate::fits::drift::allan::fit::interval;
use crate::fits::drift::allan::{Estimator, NoiseFit, Phase, PowerLaw, Variance};
use crate::fits::drift::spectrum::{Line, Spectrum};
use crate::numbers::real;
use crate::report::in_parallel;

/// Deviations at one averaging time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Deviations {
    /// Averaging time (s).
    pub tau_s: f64,
    /// Plain, overlapping, modified; `None` where the log is too short.
    pub of: [Option<Deviation>; 3],
}

/// One deviation.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Deviation {
    /// The deviation.
    #[serde(rename = "deviation")]
    pub value: f64,
    /// Ends of its 95 % interval, by χ².
    pub interval: [f64; 2],
    /// Equivalent degrees of freedom.
    pub degrees_of_freedom: f64,
}

/// Everything of one sensor.
#[derive(Debug, Clone, PartialEq)]
pub struct Analysis {
    /// Its name.
    pub name: String,
    /// Mean of the readings.
    pub mean: f64,
    /// Standard deviation of the readings.
    pub deviation: f64,
    /// Standard deviation of the means over bins.
    pub slow_deviation: f64,
    /// Allan deviations.
    pub allan: Vec<Deviations>,
    /// Overlapping variances in octaves, which the coefficients were fitted to.
    pub fitted: Vec<Variance>,
    /// The noise coefficients.
    pub noise: Option<NoiseFit>,
    /// The slow part.
    pub slow: Slow,
    /// Markov part and straight trend, and the lines of the day.
    pub markov: Option<(Fit, Vec<DailyLine>)>,
    /// Slope of the straight trend (readings per h) and the standard error that it must stand out of.
    pub slope: Option<(f64, f64)>,
    /// The same noise with a trend of second order.
    pub second_order: Option<Fit>,
    /// Autocorrelation of what is left of the slow part after trend and lines.
    pub autocorrelation: Option<Autocorrelation>,
    /// Spectrum of the readings.
    pub spectrum: Option<Spectrum>,
    /// Lines that stand out of it.
    pub lines: Vec<Line>,
    /// What a straight line through the beginning says of the rest.
    pub extrapolation: Option<Extrapolation>,
}

impl Analysis {
    /// σ and τ of the Markov part, where there is one.
    pub fn slow_drift(&self) -> Option<(Estimate, Estimate)> {
        let (fit, _) = self.markov.as_ref()?;
        fit.sigma.zip(fit.correlation_time_h)
    }

    /// The noise coefficients, where they describe the log: others are not stated.
    pub fn stated_noise(&self) -> Option<&NoiseFit> {
        self.noise.as_ref().filter(|noise| noise.describes())
    }
}

/// The estimators, in the order of the tables.
pub const ESTIMATORS: [Estimator; 3] = [Estimator::Plain, Estimator::Overlapping, Estimator::Modified];

/// What there is of a sensor before its Allan variances.
struct Prepared {
    mean: f64,
    deviation: f64,
    phase: Phase,
    slow: Slow,
    spectrum: Option<Spectrum>,
}

/// Analyses every sensor of a log; the extrapolation is fitted to so many hours.
pub fn analyse(grid: &Grid, fit_h: f64) -> Vec<Analysis> {
    let sensors = &grid.sensors;
    let prepared = in_parallel(sensors, |sensor| prepare(grid, sensor));
    // One thing of work per sensor and averaging time, the slow ones first.
    let mut work = Vec::new();
    for (index, of) in prepared.iter().enumerate() {
        for estimator in [Estimator::Modified, Estimator::Overlapping, Estimator::Plain] {
            work.extend(lengths(of.phase.longest()).into_iter().map(|m| (index, estimator, m)));
        }
    }
    let variances = in_parallel(&work, |(index, estimator, m)| {
        prepared.get(*index).and_then(|of| of.phase.variance(*estimator, *m))
    });
    let found: Vec<_> = work.into_iter().zip(variances).collect();
    let indices: Vec<usize> = (0..sensors.len()).collect();
    let finished = in_parallel(&indices, |index| {
        let of_sensor: Vec<(Estimator, Variance)> = found
            .iter()
            .filter(|((sensor, ..), _)| sensor == index)
            .filter_map(|((_, estimator, _), variance)| Some((*estimator, (*variance)?)))
            .collect();
        let (sensor, prepared) = (sensors.get(*index)?, prepared.get(*index)?);
        Some(finish(grid, sensor, prepared, &of_sensor, fit_h))
    });
    finished.into_iter().flatten().collect()
}

fn prepare(grid: &Grid, sensor: &Sensor) -> Prepared {
    let pieces: Vec<&[f64]> = sensor.pieces.iter().map(|piece| piece.readings.as_slice()).collect();
    let count = real(pieces.iter().map(|piece| piece.len()).sum::<usize>());
    // About the first reading, so that a large constant takes no digits.
    let first = pieces.first().and_then(|piece| piece.first()).copied().unwrap_or(0.0);
    let (mut sum, mut squares) = (0.0, 0.0);
    for reading in pieces.iter().copied().flatten() {
        let off = reading - first;
        sum += off;
        squares += off * off;
    }
    let mean = sum / count;
    let deviation = ((squares - sum * mean) / (count - 1.0).max(1.0)).max(0.0).sqrt();
    let mean = first + mean;
    let placed: Vec<(usize, &[f64])> =
        sensor.pieces.iter().map(|piece| (piece.start, piece.readings.as_slice())).collect();
    Prepared {
        mean,
        deviation,
        phase: Phase::new(pieces.iter().copied(), mean),
        slow: Slow::of(&placed, grid.ticks, grid.tick_s),
        spectrum: Spectrum::of(&pieces, mean, grid.tick_s),
    }
}

fn finish(
    grid: &Grid,
    sensor: &Sensor,
    prepared: &Prepared,
    variances: &[(Estimator, Variance)],
    fit_h: f64,
) -> Analysis {
    let overlapping = variances.iter().filter(|(estimator, _)| *estimator == Estimator::Overlapping);
    let fitted: Vec<Variance> = overlapping.map(|(_, variance)| *variance).collect();
    let noise = NoiseFit::of(&fitted, grid.tick_s).map(|noise| noise.of_pieces(sensor.pieces.len()));
    let slow = prepared.slow.clone();
    let markov = Fit::with_daily_lines(&slow);
    let second_order = markov
        .as_ref()
        .and_then(|(fit, _)| Fit::with_noise(&slow, &Beside { degree: 2, ..fit.beside.clone() }, fit.noise));
    let autocorrelation = markov.as_ref().map(|(fit, _)| {
        let left: Vec<f64> =
            slow.time_h.iter().zip(&slow.mean).map(|(time, mean)| mean - fit.beside_at(*time)).collect();
        Autocorrelation::of(&slow.time_h, &left, slow.width_h)
    });
    Analysis {
        name: sensor.name.clone(),
        mean: prepared.mean,
        deviation: prepared.deviation,
        slow_deviation: deviation_of(&slow.mean),
        allan: table(grid.tick_s, variances, noise.as_ref()),
        fitted,
        noise,
        slope: markov.as_ref().and_then(|(fit, _)| fit.slope(&slow)),
        extrapolation: Extrapolation::of(&slow, fit_h),
        markov,
        second_order,
        autocorrelation,
        lines: prepared.spectrum.as_ref().map(Spectrum::lines).unwrap_or_default(),
        spectrum: prepared.spectrum.clone(),
        slow,
    }
}

/// Standard deviation of some values.
fn deviation_of(values: &[f64]) -> f64 {
    let count = real(values.len());
    let mean = values.iter().sum::<f64>() / count;
    let squares: f64 = values.iter().map(|value| (value - mean) * (value - mean)).sum();
    (squares / (count - 1.0).max(1.0)).sqrt()
}

/// Deviations by averaging time, with their confidence by the kind of noise that dominates there.
fn table(tick_s: f64, variances: &[(Estimator, Variance)], noise: Option<&NoiseFit>) -> Vec<Deviations> {
    let mut factors: Vec<usize> = variances.iter().map(|(_, variance)| variance.ticks).collect();
    factors.sort_unstable();
    factors.dedup();
    let row = |m: usize| {
        let tau_s = real(m) * tick_s;
        let law = noise.map_or(PowerLaw::White, |noise| noise.dominant(tau_s).law());
        let of = ESTIMATORS.map(|estimator| {
            let same =
                |(other, variance): &&(Estimator, Variance)| *other == estimator && variance.ticks == m;
            let (_, variance) = variances.iter().find(same)?;
            let degrees = degrees_of_freedom(estimator, law, m, variance.differences);
            let [low, high] = interval(degrees);
            let value = variance.variance.sqrt();
            Some(Deviation {
                value,
                interval: [value * low.sqrt(), value * high.sqrt()],
                degrees_of_freedom: degrees,
            })
        });
        Deviations { tau_s, of }
    };
    factors.into_iter().map(row).collect()
}
