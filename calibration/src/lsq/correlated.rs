//! Rows whose noise is correlated, and what it leaves of columns and readings when it is made white.
//!
//! A mean over the length L is
//!
//! ```text
//! y = x·β + m + v/L + q·(e_end − e_begin)/L
//! ```
//!
//! v white (variance N²·L), e the fraction of a count that the counter holds back at an end (variance 1/12, one and the same
//! for two cells that touch), m a first-order Markov drift. A Kalman filter over (m, e) turns all of that into independent
//! innovations; what it does to y it does to every column of x. The parameters are the most likely ones beside β
//! (restricted maximum likelihood), so that fitting β does not make the noise look small. Times may be in any unit; lengths, times and
//! the quantum are in the same.

use nalgebra::{DMatrix, DVector};

use super::linear::{self, Linear, SINGULAR, Weak};
use super::search::{golden, simplex};
use crate::numbers::real;

/// Variance of the fraction of a count.
const FRACTION_VARIANCE: f64 = 1.0 / 12.0;
/// Twice the gain of log-likelihood that a Markov drift must bring with its two parameters (χ², two degrees, 5 %).
const MARKOV_GAIN: f64 = 6.0;
/// Fall of the log-likelihood at two standard deviations of a parameter.
const TWO_SIGMAS: f64 = 2.0;
/// Steps of halving the way to a limit.
const STEPS: usize = 12;
/// Range of N² about its first guess, in powers of e.
const WHITE_RANGE: [f64; 2] = [-14.0, 3.0];

/// Means of one gyro and the columns that are fitted to them.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Data {
    /// Means.
    pub value: Vec<f64>,
    /// Columns, each as long.
    pub columns: Vec<Vec<f64>>,
    /// Middles of the cells (s).
    pub time_s: Vec<f64>,
    /// Lengths of the cells (s).
    pub length_s: Vec<f64>,
    /// Whether a cell touches the one before it.
    pub joined: Vec<bool>,
    /// One count, in units of the values times s; 0 for readings without steps.
    pub quantum: f64,
}

/// Parameters of the noise.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Noise {
    /// N²: variance of the white part over a second.
    pub white: f64,
    /// Markov drift: variance, and correlation time (s).
    pub markov: Option<[f64; 2]>,
}

/// Values and columns as independent numbers of variance one.
#[derive(Debug, Clone, PartialEq)]
pub struct White {
    /// Values.
    pub value: DVector<f64>,
    /// Columns.
    pub columns: DMatrix<f64>,
    /// Σ ln of the innovations' variances.
    pub log_variance: f64,
}

/// Coefficients with their covariance.
#[derive(Debug, Clone, PartialEq)]
pub struct Solution {
    /// Coefficients by column.
    pub coefficients: DVector<f64>,
    /// Their covariance.
    pub covariance: DMatrix<f64>,
    /// Sum of the squared innovations that are left.
    pub chi_square: f64,
    /// Logarithm of the determinant of the readings' covariance.
    pub log_variance: f64,
    /// Logarithm of the determinant of the inverse of the coefficients' covariance.
    pub log_determinant: f64,
    /// Logarithm of the restricted likelihood, up to a constant.
    pub likelihood: f64,
}

impl Data {
    /// How many means.
    pub fn len(&self) -> usize {
        self.value.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.value.is_empty()
    }

    /// Makes the noise white.
    pub fn whitened(&self, noise: Noise) -> White {
        let (count, width) = (self.len(), self.columns.len());
        let mut columns = DMatrix::zeros(count, width);
        let mut value = DVector::zeros(count);
        let mut log_variance = 0.0;
        let [markov, correlation_s] = noise.markov.unwrap_or([0.0, 1.0]);
        let fraction = FRACTION_VARIANCE * self.quantum * self.quantum;
        // State (m, e·q at the end of the last cell) of the values and of every column, and its common covariance.
        let mut states = vec![[0.0_f64; 2]; width + 1];
        let mut p = [[markov, 0.0], [0.0, fraction]];
        let mut last_s: Option<f64> = None;
        for row in 0..count {
            let (time_s, length_s) = (self.time_s[row], self.length_s[row]);
            if let Some(last_s) = last_s {
                let decay = libm::exp(-(time_s - last_s) / correlation_s);
                p[0][0] = decay * decay * p[0][0] + markov * (1.0 - decay * decay);
                p[0][1] *= decay;
                for state in &mut states {
                    state[0] *= decay;
                }
            }
            if !self.joined[row] {
                p[1][1] = fraction;
                p[0][1] = 0.0;
                for state in &mut states {
                    state[1] = 0.0;
                }
            }
            last_s = Some(time_s);
            // y = m + (e_new − e_old)·q/L + v/L
            let per_s = 1.0 / length_s;
            let h = [1.0, -per_s];
            let ph = [p[0][0] * h[0] + p[0][1] * h[1], p[0][1] * h[0] + p[1][1] * h[1]];
            let own = fraction * per_s * per_s + noise.white * per_s;
            let variance = h[0] * ph[0] + h[1] * ph[1] + own;
            let sigma = variance.sqrt();
            log_variance += libm::log(variance);
            let gain = [ph[0] / variance, fraction * per_s / variance];
            for (column, state) in states.iter_mut().enumerate() {
                let got = if column == width { self.value[row] } else { self.columns[column][row] };
                let innovation = got - (h[0] * state[0] + h[1] * state[1]);
                *state = [state[0] + gain[0] * innovation, gain[1] * innovation];
                if column == width {
                    value[row] = innovation / sigma;
                } else {
                    columns[(row, column)] = innovation / sigma;
                }
            }
            p = [[p[0][0] - gain[0] * ph[0], -gain[1] * ph[0]], [0.0, fraction - gain[1] * fraction * per_s]];
            p[1][0] = p[0][1];
        }
        White { value, columns, log_variance }
    }

    /// Coefficients under a noise; `None` where the columns do not tell each other apart.
    pub fn solve(&self, noise: Noise) -> Option<Solution> {
        let White { value, columns, log_variance } = self.whitened(noise);
        let linear = linear::solve(&columns, &value, Weak::Refuse(SINGULAR)).ok()?;
        let chi_square = linear.chi_square();
        let likelihood = -0.5 * (log_variance + linear.log_determinant + chi_square);
        let Linear { coefficients, inverse: covariance, log_determinant, .. } = linear;
        Some(Solution { coefficients, covariance, chi_square, log_variance, log_determinant, likelihood })
    }

    fn likelihood(&self, noise: Noise) -> f64 {
        self.solve(noise).map_or(f64::NEG_INFINITY, |solution| solution.likelihood)
    }

    /// The most likely noise. A Markov drift is taken where the means show one.
    pub fn noise(&self) -> Noise {
        let guess = self.plain_variance().max(f64::MIN_POSITIVE);
        let white = |log: f64| Noise { white: guess * libm::exp(log), markov: None };
        let (log, least) = golden(WHITE_RANGE, |log| -self.likelihood(white(log)));
        let plain = white(log);
        // Runs are far apart: what counts is the time that was measured.
        let span_s: f64 = self.length_s.iter().sum();
        let typical_s = span_s / real(self.len().max(1));
        let shortest = libm::log(2.0 * typical_s);
        let longest = libm::log(span_s.max(4.0 * typical_s));
        let full = |x: [f64; 3]| Noise {
            white: guess * libm::exp(x[0].clamp(WHITE_RANGE[0], WHITE_RANGE[1])),
            markov: Some([
                guess / typical_s * libm::exp(x[1].clamp(-16.0, 6.0)),
                libm::exp(x[2].clamp(shortest, longest)),
            ]),
        };
        let mut best = (least - 0.5 * MARKOV_GAIN, plain);
        for share in [0.25, 0.6] {
            let start = [log, -2.0, shortest + share * (longest - shortest)];
            let (x, value) = simplex(start, [0.5, 1.5, 0.7], |x| -self.likelihood(full(x)));
            if value < best.0 {
                best = (value, full(x));
            }
        }
        best.1
    }

    /// The noise with its parameters at their limits, two standard deviations of their estimates: all variances larger, and
    /// for a Markov drift, in its place, that drift larger, slower, or faster.
    pub fn limits(&self, noise: Noise) -> Vec<Noise> {
        let mut limits = vec![self.limit(noise, |factor| Noise {
            white: noise.white * factor,
            markov: noise.markov.map(|[variance, time_s]| [variance * factor, time_s]),
        })];
        if let Some([variance, time_s]) = noise.markov {
            let with = |variance: f64, time_s: f64| Noise { markov: Some([variance, time_s]), ..noise };
            limits.push(self.limit(noise, |factor| with(variance * factor, time_s)));
            limits.push(self.limit(noise, |factor| with(variance, time_s * factor)));
            limits.push(self.limit(noise, |factor| with(variance, time_s / factor)));
        }
        limits
    }

    /// How far one direction of the parameters goes before the log-likelihood has fallen by two standard deviations' worth.
    fn limit(&self, noise: Noise, with: impl Fn(f64) -> Noise) -> Noise {
        const LARGEST: f64 = 1e4;
        let limit = self.likelihood(noise) - TWO_SIGMAS;
        let (mut low, mut high) = (1.0, 2.0);
        while high < LARGEST && self.likelihood(with(high)) > limit {
            (low, high) = (high, 2.0 * high);
        }
        for _ in 0..STEPS {
            let middle = 0.5 * (low + high);
            *if self.likelihood(with(middle)) > limit { &mut low } else { &mut high } = middle;
        }
        with(low)
    }

    /// Covariance of the coefficients, each as uncertain as the limits of the noise leave it.
    pub fn covariance(&self, noise: Noise) -> Option<DMatrix<f64>> {
        let own = self.solve(noise)?.covariance;
        let mut wider = own.diagonal();
        for limit in self.limits(noise) {
            wider = wider.sup(&self.solve(limit)?.covariance.diagonal());
        }
        let factor = wider.component_div(&own.diagonal()).map(f64::sqrt);
        Some(DMatrix::from_fn(own.nrows(), own.ncols(), |i, j| own[(i, j)] * factor[i] * factor[j]))
    }

    /// Variance over a second by ordinary least squares.
    fn plain_variance(&self) -> f64 {
        let plain = Self { quantum: 0.0, ..self.clone() };
        let freedom = self.len().saturating_sub(self.columns.len()).max(1);
        plain
            .solve(Noise { white: 1.0, markov: None })
            .map_or(1.0, |solution| solution.chi_square / real(freedom))
    }

    /// The same without some of the columns.
    pub fn with_columns(&self, wanted: &[usize]) -> Self {
        let columns = wanted.iter().filter_map(|&index| self.columns.get(index).cloned()).collect();
        Self { columns, ..self.clone() }
    }
}
