//! First-order Markov drift beside white noise, a trend and daily lines, by restricted maximum likelihood.
//!
//! ```text
//! y(t) = X(t)·β + ε1(t) + white,    ε1 with sigma σ and correlation time τ
//! ```
//!
//! The autocorrelation of a log of a few correlation times, less its mean and trend, falls far too early: mean and trend
//! have been fitted to the drift itself. The restricted likelihood takes account of that. A Kalman filter over the one
//! state makes the rows independent; gaps are only longer steps.

use nalgebra::{DMatrix, DVector, Matrix2};

use super::slow::Slow;

/// Fewest bins.
pub const FEWEST_BINS: usize = 24;
/// Twice the gain in log-likelihood that makes a Markov part observable: 1 % for two parameters.
const LEAST_GAIN: f64 = 9.21;
/// χ² of two degrees of freedom beyond which a daily line is one: 0.1 %.
const LINE_CHI_SQUARE: f64 = 13.8;
/// A line shows from so many periods on.
const PERIODS: f64 = 2.0;
/// Shortest correlation time (h), a reference of a minute: what is faster is noise to the estimator.
const SHORTEST_TIME_H: f64 = 1.0 / 60.0;
/// Step of the numeric second derivatives, in natural logarithms.
const DIFFERENCE: f64 = 0.05;

/// What stands beside the noise.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Beside {
    /// Degree of the trend (0…2).
    pub degree: u32,
    /// Periods of lines (h).
    pub periods_h: Vec<u32>,
}

/// Size of the noise.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Noise {
    /// τ (h).
    pub correlation_time_h: f64,
    /// Variance of the white part of a bin over that of the Markov part.
    pub white_ratio: f64,
    /// Whether there is a Markov part.
    pub markov: bool,
}

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
    /// −2·ln of the restricted likelihood, up to a constant of the columns.
    pub minus_two_log: f64,
    /// Middle and half length of the log (h).
    pub span_h: [f64; 2],
    /// Size of the noise.
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
    #[must_use]
    pub fn stands_out(&self) -> bool {
        self.chi_square > LINE_CHI_SQUARE
    }
}

/// Rows made independent for one size of the noise.
struct Rows {
    values: DVector<f64>,
    columns: DMatrix<f64>,
    log_determinant: f64,
}

/// The solution for one size of the noise, with the Markov part's variance as the unit.
struct Solution {
    beta: DVector<f64>,
    /// (XᵀX)⁻¹ of the independent rows.
    inverse: DMatrix<f64>,
    squares: f64,
    log_determinant: f64,
    degrees: f64,
}

impl Solution {
    /// −2·ln of the restricted likelihood at the best variance.
    fn minus_two_log(&self) -> f64 {
        self.degrees * libm::log(self.squares / self.degrees) + self.log_determinant
    }

    /// The same at a given variance.
    fn at_variance(&self, variance: f64) -> f64 {
        self.degrees * libm::log(variance) + self.squares / variance - self.degrees + self.log_determinant
    }
}

/// Data and columns of a fit.
struct Problem<'a> {
    slow: &'a Slow,
    columns: DMatrix<f64>,
    span_h: [f64; 2],
}

impl<'a> Problem<'a> {
    fn new(slow: &'a Slow, beside: &Beside) -> Self {
        let (first, last) = match (slow.time_h.first(), slow.time_h.last()) {
            (Some(first), Some(last)) => (*first, *last),
            _ => (0.0, 1.0),
        };
        let span_h = [0.5 * (first + last), (0.5 * (last - first)).max(f64::MIN_POSITIVE)];
        let row = |time: f64| {
            let u = (time - span_h[0]) / span_h[1];
            let powers = (0..=beside.degree).map(move |power| u.powi(power.cast_signed()));
            let waves = beside.periods_h.iter().flat_map(move |period| {
                let (sine, cosine) = libm::sincos(std::f64::consts::TAU * time / f64::from(*period));
                [cosine, sine]
            });
            powers.chain(waves).collect::<Vec<f64>>()
        };
        let rows: Vec<Vec<f64>> = slow.time_h.iter().map(|time| row(*time)).collect();
        let width = rows.first().map_or(0, Vec::len);
        let columns = DMatrix::from_fn(rows.len(), width, |r, c| rows[r][c]);
        Self { slow, columns, span_h }
    }

    fn rows(&self, noise: &Noise) -> Rows {
        let (count, width) = self.columns.shape();
        let mut values = DVector::zeros(count);
        let mut columns = DMatrix::zeros(count, width);
        // One filter for all columns: gains do not depend on the readings.
        let mut states = vec![0.0; width + 1];
        let (mut variance, mut log_determinant) = (1.0, 0.0);
        let mut before: Option<f64> = None;
        for (k, (time, mean)) in self.slow.time_h.iter().zip(&self.slow.mean).enumerate() {
            let white = if noise.markov { noise.white_ratio } else { 1.0 };
            if !noise.markov {
                variance = 0.0;
            } else if let Some(before) = before {
                let decay = libm::exp(-(time - before) / noise.correlation_time_h);
                for state in &mut states {
                    *state *= decay;
                }
                variance = decay * decay * variance + (1.0 - decay * decay);
            }
            before = Some(*time);
            let total = variance + white;
            let (gain, root) = (variance / total, total.sqrt());
            for (c, state) in states.iter_mut().enumerate() {
                let reading = if c == width { *mean } else { self.columns[(k, c)] };
                let innovation = reading - *state;
                if c == width {
                    values[k] = innovation / root;
                } else {
                    columns[(k, c)] = innovation / root;
                }
                *state += gain * innovation;
            }
            variance *= white / total;
            log_determinant += libm::log(total);
        }
        Rows { values, columns, log_determinant }
    }

    fn solve(&self, noise: &Noise) -> Option<Solution> {
        let Rows { values, columns, mut log_determinant } = self.rows(noise);
        let (count, width) = columns.shape();
        let qr = columns.clone().qr();
        let inverse_r = qr.r().solve_upper_triangular(&DMatrix::identity(width, width))?;
        let beta = &inverse_r * (qr.q().transpose() * &values);
        let squares = (values - columns * &beta).norm_squared();
        log_determinant += qr.r().diagonal().iter().map(|r| 2.0 * libm::log(r.abs())).sum::<f64>();
        #[expect(clippy::cast_precision_loss, reason = "at most some hundred")]
        let degrees = (count - width) as f64;
        let inverse = &inverse_r * inverse_r.transpose();
        (squares > 0.0 && log_determinant.is_finite()).then_some(Solution {
            beta,
            inverse,
            squares,
            log_determinant,
            degrees,
        })
    }

    fn cost(&self, logarithms: [f64; 2]) -> f64 {
        self.solve(&noise(logarithms)).map_or(f64::INFINITY, |solution| solution.minus_two_log())
    }

    /// The most likely noise, by a grid and then ever smaller steps.
    fn best(&self) -> [f64; 2] {
        let shortest = libm::log(self.slow.width_h.max(SHORTEST_TIME_H));
        let longest = libm::log((60.0 * self.span_h[1]).max(2.0 * SHORTEST_TIME_H));
        let mut best = ([shortest, 0.0], f64::INFINITY);
        for i in 0..20 {
            for j in 0..14 {
                let at = [shortest + (longest - shortest) * f64::from(i) / 19.0, -14.0 + 1.5 * f64::from(j)];
                let cost = self.cost(at);
                if cost < best.1 {
                    best = (at, cost);
                }
            }
        }
        let mut step = [0.5, 1.0];
        while step[0] > 1e-4 {
            let [a, b] = best.0;
            let around = [[a + step[0], b], [a - step[0], b], [a, b + step[1]], [a, b - step[1]]];
            let diagonal = [
                [a + step[0], b + step[1]],
                [a - step[0], b - step[1]],
                [a + step[0], b - step[1]],
                [a - step[0], b + step[1]],
            ];
            let inside =
                |at: &[f64; 2]| (shortest..=longest).contains(&at[0]) && (-18.0..=9.0).contains(&at[1]);
            let tried = around.into_iter().chain(diagonal).filter(inside).map(|at| (at, self.cost(at)));
            match tried.min_by(|a, b| a.1.total_cmp(&b.1)) {
                Some(better) if better.1 < best.1 => best = better,
                _ => step = step.map(|s| 0.5 * s),
            }
        }
        best.0
    }

    /// Sigmas of ln σ and ln τ from the likelihood's curvature; `None` where it has none.
    fn sigmas(&self, noise: &Noise, variance: f64) -> Option<[f64; 2]> {
        let white = noise.white_ratio * variance;
        let tau = noise.correlation_time_h;
        let at = |s: f64, t: f64| {
            let variance = variance * libm::exp(2.0 * s);
            let noise =
                Noise { correlation_time_h: tau * libm::exp(t), white_ratio: white / variance, markov: true };
            self.solve(&noise).map(|solution| solution.at_variance(variance))
        };
        let h = DIFFERENCE;
        let middle = at(0.0, 0.0)?;
        let second = |plus: f64, minus: f64| (plus - 2.0 * middle + minus) / (h * h);
        let ss = second(at(h, 0.0)?, at(-h, 0.0)?);
        let tt = second(at(0.0, h)?, at(0.0, -h)?);
        let mixed = (at(h, h)? - at(h, -h)? - at(-h, h)? + at(-h, -h)?) / (4.0 * h * h);
        let inverse = Matrix2::new(ss, mixed, mixed, tt).try_inverse()?;
        let variances = [2.0 * inverse.m11, 2.0 * inverse.m22];
        variances.iter().all(|v| *v > 0.0 && v.is_finite()).then(|| variances.map(f64::sqrt))
    }
}

fn noise([log_tau, log_ratio]: [f64; 2]) -> Noise {
    Noise { correlation_time_h: libm::exp(log_tau), white_ratio: libm::exp(log_ratio), markov: true }
}

/// Variance of a Markov process of unit variance averaged over a bin of `x` correlation times.
fn share_of_mean(x: f64) -> f64 {
    if x < 1e-3 { 1.0 - x / 3.0 } else { 2.0 * (x + libm::expm1(-x)) / (x * x) }
}

impl Fit {
    /// The most likely noise and what stands beside it; `None` with fewer than [`FEWEST_BINS`] bins.
    #[must_use]
    pub fn of(slow: &Slow, beside: &Beside) -> Option<Self> {
        if slow.mean.len() < FEWEST_BINS {
            return None;
        }
        let problem = Problem::new(slow, beside);
        let white = Noise { correlation_time_h: 0.0, white_ratio: 1.0, markov: false };
        let without = problem.solve(&white)?;
        let found = noise(problem.best());
        let with = problem.solve(&found)?;
        if without.minus_two_log() - with.minus_two_log() > LEAST_GAIN {
            Some(Self::build(&problem, beside, found, &with))
        } else {
            Some(Self::build(&problem, beside, white, &without))
        }
    }

    /// With the noise of another fit.
    #[must_use]
    pub fn with_noise(slow: &Slow, beside: &Beside, noise: Noise) -> Option<Self> {
        let problem = Problem::new(slow, beside);
        let solution = problem.solve(&noise)?;
        Some(Self::build(&problem, beside, noise, &solution))
    }

    /// The same, with the lines of the day that stand out beside the trend, and what is to be said of each:
    /// lines of the hall must not count as the gyro's drift, so σ and τ are those without them.
    #[must_use]
    pub fn with_daily_lines(slow: &Slow, degree: u32) -> Option<(Self, Vec<DailyLine>)> {
        let length_h = slow.length_h();
        let resolved = |period: &u32| {
            f64::from(*period) * PERIODS <= length_h && f64::from(*period) > 4.0 * slow.width_h
        };
        let periods_h: Vec<u32> = [24, 8].into_iter().filter(resolved).collect();
        let all = Self::of(slow, &Beside { degree, periods_h })?;
        let lines = all.lines();
        let stay: Vec<u32> =
            lines.iter().filter(|line| line.stands_out()).map(|line| line.period_h).collect();
        if stay.len() == lines.len() {
            return Some((all, lines));
        }
        Some((Self::of(slow, &Beside { degree, periods_h: stay })?, lines))
    }

    fn build(problem: &Problem<'_>, beside: &Beside, noise: Noise, solution: &Solution) -> Self {
        let variance = solution.squares / solution.degrees;
        let (mut sigma, mut correlation_time_h) = (None, None);
        if noise.markov {
            let tau = noise.correlation_time_h;
            let value = (variance / share_of_mean(problem.slow.width_h / tau)).sqrt();
            let sigmas = problem.sigmas(&noise, variance);
            let around = |value: f64, at: usize| {
                let factor = sigmas.and_then(|sigmas| sigmas.get(at).map(|s| libm::exp(1.96 * s)));
                Estimate { value, interval: factor.map(|factor| [value / factor, value * factor]) }
            };
            (sigma, correlation_time_h) = (Some(around(value, 0)), Some(around(tau, 1)));
        }
        let white = (variance * if noise.markov { noise.white_ratio } else { 1.0 }).sqrt();
        Self {
            beside: beside.clone(),
            sigma,
            correlation_time_h,
            white,
            beta: solution.beta.iter().copied().collect(),
            covariance: &solution.inverse * variance,
            minus_two_log: solution.minus_two_log(),
            span_h: problem.span_h,
            noise,
        }
    }

    /// Trend at a time (h).
    #[must_use]
    pub fn trend_at(&self, time_h: f64) -> f64 {
        let u = (time_h - self.span_h[0]) / self.span_h[1];
        let terms = self.beta.iter().take(self.beside.degree as usize + 1);
        terms.rev().fold(0.0, |sum, beta| sum * u + beta)
    }

    /// Trend and lines at a time (h).
    #[must_use]
    pub fn beside_at(&self, time_h: f64) -> f64 {
        let waves = self.beta.get(self.beside.degree as usize + 1..).unwrap_or(&[]).chunks_exact(2);
        let waves = self.beside.periods_h.iter().zip(waves).map(|(period, wave)| {
            let (sine, cosine) = libm::sincos(std::f64::consts::TAU * time_h / f64::from(*period));
            wave.iter().zip([cosine, sine]).map(|(beta, value)| beta * value).sum::<f64>()
        });
        self.trend_at(time_h) + waves.sum::<f64>()
    }

    /// Coefficient of a power of (t − middle) in readings per hourⁿ, and its standard error.
    #[must_use]
    pub fn power(&self, power: u32) -> Option<(f64, f64)> {
        let at = power as usize;
        let scale = self.span_h[1].powi(power.cast_signed());
        let value = self.beta.get(at).filter(|_| power <= self.beside.degree)?;
        let error = self.covariance.get((at, at))?.sqrt();
        Some((value / scale, error / scale))
    }

    /// Every line of the fit.
    fn lines(&self) -> Vec<DailyLine> {
        let first = self.beside.degree as usize + 1;
        let of = |(index, period): (usize, &u32)| {
            let at = first + 2 * index;
            let wave = self.beta.get(at..at + 2)?;
            let block = self.covariance.view((at, at), (2, 2));
            let inverse =
                Matrix2::new(block[(0, 0)], block[(0, 1)], block[(1, 0)], block[(1, 1)]).try_inverse()?;
            let vector = nalgebra::Vector2::new(wave[0], wave[1]);
            let chi_square = vector.dot(&(inverse * vector));
            Some(DailyLine { period_h: *period, amplitude: vector.norm(), chi_square })
        };
        self.beside.periods_h.iter().enumerate().filter_map(of).collect()
    }
}
