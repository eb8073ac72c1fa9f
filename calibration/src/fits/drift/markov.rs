//! First-order Markov drift beside white noise, a trend and daily lines, by restricted maximum likelihood.
//!
//! ```text
//! y(t) = X(t)·β + ε1(t) + white,    ε1 with sigma σ and correlation time τ
//! ```
//!
//! The autocorrelation of a log of a few correlation times, less its mean and trend, falls far too early: mean and trend
//! have been fitted to the drift itself. The restricted likelihood takes account of that. A Kalman filter over the one
//! state makes the rows independent; gaps are only longer steps.

mod likelihood;

use nalgebra::{DMatrix, DVector};

use super::slow::Slow;
use crate::lsq::correlated::Noise;
use crate::lsq::linear;
use crate::report::{short, within};
use likelihood::{Problem, Solution, noise};

/// Fewest bins.
pub const FEWEST_BINS: usize = 24;
/// Least likelihood ratio that a slope's error is made of: where nothing bears the slope out the error is ten times the slope.
const LEAST_RATIO: f64 = 1e-2;
/// Twice the gain in log-likelihood that makes a Markov part observable: 1 % for two parameters.
const LEAST_GAIN: f64 = 9.21;
/// χ² of two degrees of freedom beyond which a daily line is one: 0.1 %.
const LINE_CHI_SQUARE: f64 = 13.8;
/// A line shows from so many periods on.
const PERIODS: f64 = 2.0;

/// What stands beside the noise.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Beside {
    /// Degree of the trend (0…2).
    pub degree: u32,
    /// Periods of lines (h).
    pub periods_h: Vec<u32>,
}

/// Noise without a Markov part.
pub const WHITE: Noise = Noise { white: 1.0, markov: None };

/// A fit.
#[derive(Debug, Clone, PartialEq)]
pub struct Fit {
    /// What stands beside the noise.
    pub beside: Beside,
    /// σ of the Markov part; `None` where the log shows none.
    pub sigma: Option<Estimate>,
    /// τ (h); `None` where the log shows no Markov part.
    pub correlation_time_h: Option<Estimate>,
    /// Standard deviation of the white part of a bin.
    pub white: f64,
    /// β: polynomial of (t − middle)/half length, then cosine and sine of each line.
    pub beta: Vec<f64>,
    /// Covariance of β.
    pub covariance: DMatrix<f64>,
    /// −2·ln of the plain likelihood, which fits with other things beside the noise can be compared by.
    pub minus_two_log_of_readings: f64,
    /// Middle and half length of the log (h).
    pub span_h: [f64; 2],
    /// Noise by bins, its times in h: the Markov part has the variance one, the white part its share of that.
    pub noise: Noise,
}

/// A number with the ends of its 95 % interval.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Estimate {
    /// The number.
    pub value: f64,
    /// Ends of the interval; `None` where the log does not bound it.
    pub interval: Option<[f64; 2]>,
}

impl Estimate {
    /// The number with its interval, as text.
    pub fn words(&self) -> String {
        match self.interval {
            Some(interval) => within(self.value, interval),
            None => format!("{} (not bounded)", short(self.value)),
        }
    }
}

/// A line at a period of the day.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DailyLine {
    /// Period (h).
    pub period_h: u32,
    /// Amplitude.
    pub amplitude: f64,
    /// χ² of two degrees of freedom against there being none.
    pub chi_square: f64,
}

impl DailyLine {
    /// Whether it stands out.
    pub fn stands_out(&self) -> bool {
        self.chi_square > LINE_CHI_SQUARE
    }
}

/// Variance of a Markov process of unit variance averaged over a bin of `x` correlation times.
fn share_of_mean(x: f64) -> f64 {
    if x < 1e-3 { 1.0 - x / 3.0 } else { 2.0 * (x + libm::expm1(-x)) / (x * x) }
}

impl Fit {
    /// The most likely noise and what stands beside it; `None` with fewer than [`FEWEST_BINS`] bins.
    pub fn of(slow: &Slow, beside: &Beside) -> Option<Self> {
        if slow.mean.len() < FEWEST_BINS {
            return None;
        }
        let problem = Problem::new(slow, beside);
        let without = problem.solve(WHITE)?;
        let found = noise(problem.best());
        let with = problem.solve(found)?;
        if without.minus_two_log() - with.minus_two_log() > LEAST_GAIN {
            Some(Self::build(&problem, beside, found, &with))
        } else {
            Some(Self::build(&problem, beside, WHITE, &without))
        }
    }

    /// With the noise of another fit.
    pub fn with_noise(slow: &Slow, beside: &Beside, noise: Noise) -> Option<Self> {
        let problem = Problem::new(slow, beside);
        let solution = problem.solve(noise)?;
        Some(Self::build(&problem, beside, noise, &solution))
    }

    /// The same, with the lines of the day that stand out beside the trend, and what is to be said of each:
    /// lines of the hall must not count as the gyro's drift, so σ and τ are those without them.
    pub fn with_daily_lines(slow: &Slow) -> Option<(Self, Vec<DailyLine>)> {
        let length_h = slow.length_h();
        let resolved = |period: &u32| {
            f64::from(*period) * PERIODS <= length_h && f64::from(*period) > 4.0 * slow.width_h
        };
        let periods_h: Vec<u32> = [24, 8].into_iter().filter(resolved).collect();
        let all = Self::of(slow, &Beside { degree: 1, periods_h })?;
        let lines = all.lines();
        let stay: Vec<u32> =
            lines.iter().filter(|line| line.stands_out()).map(|line| line.period_h).collect();
        if stay.len() == lines.len() {
            return Some((all, lines));
        }
        Some((Self::of(slow, &Beside { degree: 1, periods_h: stay })?, lines))
    }

    fn build(problem: &Problem<'_>, beside: &Beside, noise: Noise, solution: &Solution) -> Self {
        let variance = solution.of.chi_square / solution.degrees;
        let (mut sigma, mut correlation_time_h) = (None, None);
        if let Some([_, tau]) = noise.markov {
            let value = (variance / share_of_mean(problem.slow.width_h / tau)).sqrt();
            let sigmas = problem.sigmas(noise, variance);
            let around = |value: f64, at: usize| {
                let factor = sigmas.and_then(|sigmas| sigmas.get(at).map(|s| libm::exp(1.96 * s)));
                Estimate { value, interval: factor.map(|factor| [value / factor, value * factor]) }
            };
            (sigma, correlation_time_h) = (Some(around(value, 0)), Some(around(tau, 1)));
        }
        Self {
            beside: beside.clone(),
            sigma,
            correlation_time_h,
            white: (variance * noise.white).sqrt(),
            beta: solution.of.coefficients.iter().copied().collect(),
            covariance: &solution.of.covariance * variance,
            minus_two_log_of_readings: solution.minus_two_log_of_readings(),
            span_h: problem.span_h,
            noise,
        }
    }

    /// Trend at a time (h).
    pub fn trend_at(&self, time_h: f64) -> f64 {
        let u = (time_h - self.span_h[0]) / self.span_h[1];
        let terms = self.beta.iter().take(self.beside.degree as usize + 1);
        terms.rev().fold(0.0, |sum, beta| sum * u + beta)
    }

    /// Trend and lines at a time (h).
    pub fn beside_at(&self, time_h: f64) -> f64 {
        let waves = self.beta.get(self.beside.degree as usize + 1..).unwrap_or(&[]).chunks_exact(2);
        let waves = self.beside.periods_h.iter().zip(waves).map(|(period, wave)| {
            let (sine, cosine) = libm::sincos(std::f64::consts::TAU * time_h / f64::from(*period));
            wave.iter().zip([cosine, sine]).map(|(beta, value)| beta * value).sum::<f64>()
        });
        self.trend_at(time_h) + waves.sum::<f64>()
    }

    /// Coefficient of a power of (t − middle) in readings per hourⁿ, and its standard error.
    pub fn power(&self, power: u32) -> Option<(f64, f64)> {
        let at = power as usize;
        let scale = self.span_h[1].powi(power.cast_signed());
        let value = self.beta.get(at).filter(|_| power <= self.beside.degree)?;
        let error = self.covariance.get((at, at))?.sqrt();
        Some((value / scale, error / scale))
    }

    /// Slope of the trend (readings per h), and the standard error that it must stand out of: so large that slope over error is the root
    /// of the likelihood ratio against no trend at all, with the noise that is most likely then. A slope may be a slow drift, and the
    /// error by this noise is too small for that: a fit with a straight line has taken that part of the drift away before it looks
    /// for the noise.
    pub fn slope(&self, slow: &Slow) -> Option<(f64, f64)> {
        let (value, error) = self.power(1)?;
        let level = Beside { degree: 0, periods_h: self.beside.periods_h.clone() };
        let ratio = Self::of(slow, &level)?.minus_two_log_of_readings - self.minus_two_log_of_readings;
        Some((value, error.max(value.abs() / ratio.max(LEAST_RATIO).sqrt())))
    }

    /// Every line of the fit.
    fn lines(&self) -> Vec<DailyLine> {
        let first = self.beside.degree as usize + 1;
        let of = |(index, period): (usize, &u32)| {
            let at = first + 2 * index;
            let wave = DVector::from_column_slice(self.beta.get(at..at + 2)?);
            let block = self.covariance.view((at, at), (2, 2)).into_owned();
            let chi_square = linear::chi_square(&wave, &block)?;
            Some(DailyLine { period_h: *period, amplitude: wave.norm(), chi_square })
        };
        self.beside.periods_h.iter().enumerate().filter_map(of).collect()
    }
}
