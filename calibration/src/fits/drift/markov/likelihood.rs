//! The restricted likelihood of a drift's noise, and the noise that is most likely.

use nalgebra::Matrix2;

use super::Beside;
use crate::fits::drift::slow::Slow;
use crate::lsq::correlated::{self, Data, Noise};
use crate::lsq::search::compass;
use crate::numbers::real;

/// Step of the numeric second derivatives, in natural logarithms.
const DIFFERENCE: f64 = 0.05;
/// Shortest correlation time (h), a reference of a minute: what is faster is noise to the estimator.
const SHORTEST_TIME_H: f64 = 1.0 / 60.0;

/// The solution for one size of the noise, with the Markov part's variance as the unit.
pub(super) struct Solution {
    pub(super) of: correlated::Solution,
    /// Rows less columns.
    pub(super) degrees: f64,
}

impl Solution {
    /// −2·ln of the restricted likelihood at the best variance.
    pub(super) fn minus_two_log(&self) -> f64 {
        self.degrees * libm::log(self.of.chi_square / self.degrees) + self.log_determinant()
    }

    /// −2·ln of the plain likelihood at its best variance, which fits with other columns can be compared by.
    pub(super) fn minus_two_log_of_readings(&self) -> f64 {
        let count = self.degrees + real(self.of.coefficients.len());
        count * libm::log(self.of.chi_square / count) + self.of.log_variance
    }

    /// −2·ln of the restricted likelihood at a given variance.
    fn at_variance(&self, variance: f64) -> f64 {
        let squares = self.of.chi_square / variance;
        self.degrees * libm::log(variance) + squares - self.degrees + self.log_determinant()
    }

    fn log_determinant(&self) -> f64 {
        self.of.log_variance + self.of.log_determinant
    }
}

/// Data and columns of a fit.
pub(super) struct Problem<'a> {
    pub(super) slow: &'a Slow,
    data: Data,
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
        let data = Data {
            value: slow.mean.clone(),
            columns: (0..width).map(|column| rows.iter().map(|row| row[column]).collect()).collect(),
            time_s: slow.time_h.clone(),
            length_s: vec![1.0; rows.len()],
            joined: vec![false; rows.len()],
            quantum: 0.0,
        };
        Self { slow, data, span_h }
    }

    pub(super) fn solve(&self, noise: Noise) -> Option<Solution> {
        let of = self.data.solve(noise)?;
        let solution = Solution { degrees: real(self.data.len() - of.coefficients.len()), of };
        (solution.of.chi_square > 0.0 && solution.log_determinant().is_finite()).then_some(solution)
    }

    fn cost(&self, logarithms: [f64; 2]) -> f64 {
        self.solve(noise(logarithms)).map_or(f64::INFINITY, |solution| solution.minus_two_log())
    }

    /// The most likely noise, by a grid and then ever smaller steps.
    pub(super) fn best(&self) -> [f64; 2] {
        let shortest = libm::log(self.slow.width_h.max(SHORTEST_TIME_H));
        let longest = libm::log((60.0 * self.span_h[1]).max(2.0 * SHORTEST_TIME_H));
        let place = |i: i32, j: i32| {
            [shortest + (longest - shortest) * f64::from(i) / 19.0, -14.0 + 1.5 * f64::from(j)]
        };
        let starts = (0..20).flat_map(|i| (0..14).map(move |j| place(i, j)));
        compass(starts, [0.5, 1.0], 1e-4, [[shortest, longest], [-18.0, 9.0]], |at| self.cost(at))
    }

    /// Sigmas of ln σ and ln τ from the likelihood's curvature; `None` where it has none.
    pub(super) fn sigmas(&self, noise: Noise, variance: f64) -> Option<[f64; 2]> {
        let white = noise.white * variance;
        let [_, tau] = noise.markov?;
        let at = |s: f64, t: f64| {
            let variance = variance * libm::exp(2.0 * s);
            let noise = Noise { white: white / variance, markov: Some([1.0, tau * libm::exp(t)]) };
            self.solve(noise).map(|solution| solution.at_variance(variance))
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

/// Noise by the logarithms of its correlation time (h) and of the white part's share.
pub(super) fn noise([log_tau, log_ratio]: [f64; 2]) -> Noise {
    Noise { white: libm::exp(log_ratio), markov: Some([1.0, libm::exp(log_tau)]) }
}
