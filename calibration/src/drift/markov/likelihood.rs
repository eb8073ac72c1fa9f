//! The restricted likelihood of a drift's noise: readings and columns made independent by a Kalman filter, and the noise that is most
//! likely.

use nalgebra::{DMatrix, DVector, Matrix2};

use super::{Beside, Noise};
use crate::drift::slow::Slow;

/// Step of the numeric second derivatives, in natural logarithms.
const DIFFERENCE: f64 = 0.05;
/// Shortest correlation time (h), a reference of a minute: what is faster is noise to the estimator.
const SHORTEST_TIME_H: f64 = 1.0 / 60.0;
/// Rows made independent for one size of the noise.
struct Rows {
    values: DVector<f64>,
    columns: DMatrix<f64>,
    log_determinant: f64,
}

/// The solution for one size of the noise, with the Markov part's variance as the unit.
pub(super) struct Solution {
    pub(super) beta: DVector<f64>,
    /// (XᵀX)⁻¹ of the independent rows.
    pub(super) inverse: DMatrix<f64>,
    pub(super) squares: f64,
    log_determinant: f64,
    /// That of the readings' covariance alone.
    own_determinant: f64,
    pub(super) degrees: f64,
}

impl Solution {
    /// −2·ln of the restricted likelihood at the best variance.
    pub(super) fn minus_two_log(&self) -> f64 {
        self.degrees * libm::log(self.squares / self.degrees) + self.log_determinant
    }

    /// −2·ln of the plain likelihood at its best variance, which fits with other columns can be compared by.
    pub(super) fn minus_two_log_of_readings(&self) -> f64 {
        let count = self.degrees + self.count_of_columns();
        count * libm::log(self.squares / count) + self.own_determinant
    }

    #[expect(clippy::cast_precision_loss, reason = "at most seven")]
    fn count_of_columns(&self) -> f64 {
        self.beta.len() as f64
    }

    /// The same at a given variance.
    fn at_variance(&self, variance: f64) -> f64 {
        self.degrees * libm::log(variance) + self.squares / variance - self.degrees + self.log_determinant
    }
}

/// Data and columns of a fit.
pub(super) struct Problem<'a> {
    pub(super) slow: &'a Slow,
    columns: DMatrix<f64>,
    pub(super) span_h: [f64; 2],
}

impl<'a> Problem<'a> {
    pub(super) fn new(slow: &'a Slow, beside: &Beside) -> Self {
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

    pub(super) fn solve(&self, noise: &Noise) -> Option<Solution> {
        let Rows { values, columns, mut log_determinant } = self.rows(noise);
        let own_determinant = log_determinant;
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
            own_determinant,
            degrees,
        })
    }

    fn cost(&self, logarithms: [f64; 2]) -> f64 {
        self.solve(&noise(logarithms)).map_or(f64::INFINITY, |solution| solution.minus_two_log())
    }

    /// The most likely noise, by a grid and then ever smaller steps.
    pub(super) fn best(&self) -> [f64; 2] {
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
    pub(super) fn sigmas(&self, noise: &Noise, variance: f64) -> Option<[f64; 2]> {
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

pub(super) fn noise([log_tau, log_ratio]: [f64; 2]) -> Noise {
    Noise { correlation_time_h: libm::exp(log_tau), white_ratio: libm::exp(log_ratio), markov: true }
}
