//! Least squares over the steps, one gyro at a time.
//!
//! With the weight and the biases of the document a gyro shows
//!
//! ```text
//! u = h·ω + c·|h·ω|/|h| + b
//! ```
//!
//! h = C·`K_old`/K: its direction is the input axis, its length says the weight; c the asymmetry, b what is left of the bias, of each
//! group of steps for itself: temperature changes it, and the Earth's share along the table where that is not taken off.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ContinuousCDF, Normal, StudentsT};

use crate::finding::Kind;
use crate::lsq::linear::{self, Linear, Weak};
use crate::numbers::{dot, norm, once_each, real};

/// Smallest share of the largest singular value that carries information: steps are hardly exact to more digits.
const SINGULAR: f64 = 1e-7;
/// Standard deviations of its estimate by which χ² may be too large before the stated errors grow.
const ALLOWED: f64 = 3.0;
/// Least variance that a step is taken to leave, over that of its noise.
const LEAST_SPARE: f64 = 1e-3;

/// Size of an asymmetry, in its standard deviations, from which on it is no accident.
const SEEN: f64 = 4.0;

/// One step as a gyro saw it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Point {
    /// True rate of the case relative to the stars (°/h).
    pub rate: [f64; 3],
    /// What the gyro showed (°/h).
    pub shown: f64,
    /// Standard deviation of that (°/h).
    pub sigma: f64,
    /// Number of the group of steps that have one bias.
    pub group: usize,
}

/// What was found of one gyro.
#[derive(Debug, Clone, PartialEq)]
pub struct GyroRates {
    /// `K_old`/K, with the sign of the document's input axis, and its standard error.
    pub gain: [f64; 2],
    /// Input axis in case axes; `None` where the steps do not span space.
    pub axis: Option<[f64; 3]>,
    /// Standard errors of its elements (rad).
    pub axis_sigma: [f64; 3],
    /// Scale factor with positive input less that with negative, in shares of their mean, and its standard error.
    pub asymmetry: Option<[f64; 2]>,
    /// What is left of the bias (°/h), in the mean of the groups of steps, and its standard error.
    pub bias: [f64; 2],
    /// The same by group.
    pub bias_of: BTreeMap<usize, f64>,
    /// Covariance of h (3), c where it was fitted, and b.
    pub covariance: DMatrix<f64>,
    /// What the fit leaves of each step (°/h).
    pub left: Vec<f64>,
    /// χ² per degree of freedom; no number where there is none to spare.
    pub chi_square: f64,
    /// Whether the standard errors were widened to cover what is left.
    pub widened: bool,
    /// Degrees of freedom that they then rest on.
    pub freedom: f64,
}

impl GyroRates {
    /// What is left of the bias in a group of steps, as the gyro shows it (°/h); the mean of all where it has none of that group.
    pub fn shown_bias(&self, group: usize) -> f64 {
        self.bias_of.get(&group).unwrap_or(&self.bias[0]) * self.gain[0].abs()
    }

    /// The asymmetry of the weight that takes that of the scale factor away (ppm), and its standard error, where it is none by accident:
    /// half of it, the other way round (models §2).
    pub fn weight_asymmetry_ppm(&self) -> Option<[f64; 2]> {
        let [value, sigma] = self.asymmetry.filter(|[value, sigma]| self.stands_out(value / sigma, SEEN))?;
        Some([-0.5e6 * value, 0.5e6 * sigma])
    }

    /// Whether a value of so many standard errors is no more of an accident than `seen` of them were, if they were known. Widened ones
    /// are known no better than the few steps about the gyro's own axis tell.
    pub fn stands_out(&self, sigmas: f64, seen: f64) -> bool {
        let accident = Normal::standard().sf(seen);
        let law = StudentsT::new(0.0, 1.0, self.freedom).ok().filter(|_| self.widened);
        law.map_or(sigmas.abs() > seen, |law| law.sf(sigmas.abs()) < accident)
    }
}

/// Fits one gyro; `old` is its input axis in the document.
///
/// # Errors
/// Why it cannot be.
pub fn solve(points: &[Point], old: [f64; 3]) -> Result<GyroRates, Kind> {
    let rank = rank(points);
    if rank == 0 {
        return Err(Kind::NothingTurns);
    }

    let spans = rank == 3;
    // Where the steps do not span space the axis is that of the document, and its length alone is fitted.
    let columns = |point: &Point| {
        if spans { point.rate.to_vec() } else { vec![dot(old, point.rate)] }
    };
    let along = |point: &Point| dot(old, point.rate);
    let most = points.iter().map(|point| along(point).abs()).fold(0.0, f64::max);
    let total = points.iter().map(|point| norm(point.rate)).fold(0.0, f64::max);
    if most < 0.1 * total {
        return Err(Kind::Across);
    }
    let both =
        [1.0, -1.0].into_iter().all(|sign| points.iter().any(|point| sign * along(point) > 0.2 * most));
    let groups = once_each(points.iter().map(|point| point.group));
    let build = |asymmetry: bool, others: &[usize]| {
        let width = columns(&points[0]).len() + 1 + usize::from(asymmetry) + others.len();
        let row = |point: &Point| {
            let mut row = columns(point);
            if asymmetry {
                row.push(along(point).abs());
            }
            // The mean of the groups, and how far the others are from it: the first one makes up for them.
            row.push(1.0);
            let share =
                |group: &usize| f64::from(point.group == *group) - f64::from(point.group == groups[0]);
            row.extend(others.iter().map(share));
            row
        };
        let rows: Vec<Vec<f64>> = points.iter().map(row).collect();
        DMatrix::from_fn(points.len(), width, |i, j| rows[i][j] / points[i].sigma)
    };
    let y = DVector::from_iterator(points.len(), points.iter().map(|point| point.shown / point.sigma));
    let found = |x: DMatrix<f64>| linear::solve(&x, &y, Weak::Refuse(SINGULAR)).ok();
    // Groups of too few steps share one bias.
    let forms = [&groups[1..], &[]].map(|others| [(true, others), (false, others)]);
    let fit = |(asymmetry, others): (bool, &'_ [usize])| {
        let x = Some(build(asymmetry, others)).filter(|x| !asymmetry || (both && x.nrows() > x.ncols()))?;
        Some((asymmetry, others.len(), found(x)?))
    };
    let best = forms.into_iter().flatten().find_map(fit);
    let (asymmetric, others, found) = best.ok_or(Kind::FewSteps { steps: points.len() })?;
    let Linear { coefficients: beta, inverse: mut covariance, residual: left, .. } = found;
    let mut freedom = real(points.len() - beta.len());
    let (chi_square, limit) = if freedom > 0.0 {
        (left.norm_squared() / freedom, 1.0 + ALLOWED * (2.0 / freedom).sqrt())
    } else {
        (f64::NAN, f64::INFINITY)
    };
    let widened = chi_square > limit;
    if widened {
        let along: Vec<f64> = points.iter().map(|point| along(point) / point.sigma).collect();
        (covariance, freedom) = wide_enough(
            &build(asymmetric, &groups[1..=others]),
            covariance,
            &left,
            (&along, chi_square, freedom),
        );
    }
    let last = beta.len() - 1 - others;
    let apart: Vec<f64> = beta.iter().skip(last + 1).copied().collect();
    let first = -apart.iter().sum::<f64>();
    let (gain, gain_sigma, axis, axis_sigma) = if spans {
        let h = [beta[0], beta[1], beta[2]];
        let sign = if dot(h, old) < 0.0 { -1.0 } else { 1.0 };
        let gain = sign * norm(h);
        let axis = h.map(|x| x / gain);
        let of = |direction: [f64; 3]| {
            let d = DVector::from_column_slice(&direction);
            (covariance.view((0, 0), (3, 3)) * &d).dot(&d).max(0.0).sqrt()
        };
        let across = |element: usize| {
            [0, 1, 2].map(|other| if other == element { 1.0 } else { 0.0 } - axis[element] * axis[other])
        };
        (gain, of(axis), Some(axis), [0, 1, 2].map(|element| of(across(element)) / gain.abs()))
    } else {
        (beta[0], covariance[(0, 0)].sqrt(), None, [f64::NAN; 3])
    };
    let place = last - 1;
    let sigma = |index: usize| covariance[(index, index)].sqrt();
    Ok(GyroRates {
        gain: [gain, gain_sigma],
        axis,
        axis_sigma,
        asymmetry: asymmetric.then(|| [2.0 * beta[place] / gain, 2.0 * sigma(place) / gain.abs()]),
        bias: [beta[last] / gain.abs(), sigma(last) / gain.abs()],
        bias_of: groups
            .into_iter()
            .zip(std::iter::once(first).chain(apart))
            .map(|(group, apart)| (group, (beta[last] + apart) / gain.abs()))
            .collect(),
        left: left.iter().zip(points).map(|(left, point)| left * point.sigma / gain.abs()).collect(),
        covariance: covariance.view((0, 0), (last + 1, last + 1)).into_owned(),
        chi_square,
        widened,
        freedom,
    })
}

/// The covariance of a fit that leaves more than noise of its rows, and the degrees of freedom that it rests on.
///
/// All rows are noisier than was thought, or the rates of the table scatter by a share of the rate that the gyro feels (`along`, over the
/// noise), whichever is likelier. Where rates scatter, the steps about the gyro's own axis alone tell of its scale factor, and have nearly
/// all of the scatter.
fn wide_enough(
    x: &DMatrix<f64>,
    inverse: DMatrix<f64>,
    left: &DVector<f64>,
    (along, chi_square, freedom): (&[f64], f64, f64),
) -> (DMatrix<f64>, f64) {
    // What is left of a row's own noise, and of that of the others.
    let leaves = DMatrix::identity(x.nrows(), x.nrows()) - x * &inverse * x.transpose();
    let spare: Vec<f64> = leaves.diagonal().iter().copied().collect();
    let told: Vec<f64> = spare.iter().zip(along).map(|(spare, along)| spare * along * along).collect();
    let by_rate: f64 = told.iter().sum();
    let growth = ((left.norm_squared() - spare.iter().sum::<f64>()) / by_rate).max(0.0);
    let scattered: Vec<f64> = along.iter().map(|along| 1.0 + growth * along * along).collect();
    let unlikely = |variance: &[f64]| -> f64 {
        let of_row = |(row, left): (usize, &f64)| {
            let own = leaves.row(row);
            let explained: f64 =
                own.iter().zip(variance).map(|(share, variance)| share * share * variance).sum();
            let explained = explained.max(LEAST_SPARE);
            libm::log(explained) + left * left / explained
        };
        left.iter().enumerate().map(of_row).sum()
    };
    if unlikely(&scattered) >= unlikely(&vec![chi_square; along.len()]) {
        return (inverse * chi_square, freedom);
    }
    let spread = DMatrix::from_fn(x.nrows(), x.ncols(), |i, j| scattered[i] * x[(i, j)]);
    // As many as equal steps would have: those at small rates tell nothing.
    let equal =
        by_rate * by_rate / told.iter().zip(along).map(|(told, along)| told * along * along).sum::<f64>();
    (&inverse * (x.transpose() * spread) * &inverse, equal)
}

/// Directions that the steps span.
fn rank(points: &[Point]) -> usize {
    let sum = points.iter().fold(nalgebra::Matrix3::zeros(), |sum, point| {
        let rate = nalgebra::Vector3::from(point.rate);
        sum + rate * rate.transpose()
    });
    let values = sum.symmetric_eigenvalues();
    let largest = values.max();
    // Rates of the Earth's size span nothing.
    let least = (1e-4 * largest).max(1e6);
    values.iter().filter(|value| **value > least).count()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::noise;
    use crate::numbers::median;

    #[test]
    fn standard_errors_hold_where_the_tables_rates_scatter() {
        const AXES: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let rates = [10.0, -10.0, 50.0, -50.0, 100.0, -100.0].map(|rate| 3600.0 * rate);
        let mut noise = noise();
        let (mut away, mut seen) = ([Vec::new(), Vec::new()], 0);
        for _ in 0..200 {
            let point = |(axis, rate): ([f64; 3], f64)| {
                let shown = dot([1.0, 1e-3, 0.0], axis) * rate * (1.0 + 500e-6 * noise()) + noise();
                Point { rate: axis.map(|along| along * rate), shown, sigma: 1.0, group: 0 }
            };
            let steps = AXES.into_iter().flat_map(|axis| rates.map(|rate| (axis, rate)));
            let found = solve(&steps.map(point).collect::<Vec<_>>(), AXES[0]).unwrap();
            let ([gain, sigma], [asymmetry, of_asymmetry]) = (found.gain, found.asymmetry.unwrap());
            away[0].push(((gain - norm([1.0, 1e-3, 0.0])) / sigma).abs());
            away[1].push((asymmetry / of_asymmetry).abs());
            seen += usize::from(found.stands_out(asymmetry / of_asymmetry, 4.0));
        }
        // Half of all values lie within 0.67 standard errors, a little more where few steps tell these.
        let middles = away.map(|away| median(&away));
        assert!(middles.iter().all(|middle| (0.5..1.2).contains(middle)) && seen < 4, "{middles:?}, {seen}");
    }
}
