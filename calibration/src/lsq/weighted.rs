//! Rows with weights, and outliers that lose theirs. Columns may have gaps; a ridge holds what the rows leave open.

use nalgebra::{DMatrix, DVector};

use super::linear::{self, Weak};
use crate::numbers::{median_if_any, real};

/// Share of a column's own weight that the ridge adds: it only holds what the data leave open.
const RIDGE: f64 = 1e-9;
/// Root mean square of a column that is nothing but rounding: T̈ of a perfect ramp.
const NOTHING: f64 = 1e-11;
/// Passes of the reweighting.
const PASSES: usize = 4;
/// Distance from the residual's neighbours at which a window counts for nothing (robust standard deviations).
const BISQUARE: f64 = 7.0;
/// One window of so many is a spike at most, and a spike stands out of what the model leaves over elsewhere: its standard deviation is
/// taken to be at least this share of that. Where there is next to no noise, the ends of the ramps would count as spikes otherwise.
const MOST_SPIKES: usize = 50;
const BESIDE_THE_REST: f64 = 0.25;
/// Neighbours on either side that a window is compared with.
const NEIGHBOURS: usize = 3;

/// What came of a fit.
#[derive(Debug, Clone, PartialEq)]
pub struct Solution {
    /// Coefficients in the order of the columns.
    pub coefficients: Vec<f64>,
    /// Their standard errors, with the correlation of the residual in time taken into account.
    pub sigmas: Vec<f64>,
    /// Residual in every row; not a number where the target is none.
    pub residual: Vec<f64>,
    /// Weighted root mean square of the residual.
    pub rms: f64,
    /// Rows that were given less than half of their weight as outliers.
    pub outliers: usize,
}

/// Coefficients with which the columns add up best to the target, each row with its weight; rows whose target or
/// column is no number, or whose weight is zero, take no part. Spikes lose their weight. Rows of `holding`, for weights with the sum
/// of one, hold coefficients to zero. `None` without enough rows.
pub fn solve(
    columns: &[&[f64]],
    target: &[f64],
    weights: &[f64],
    holding: Option<&DMatrix<f64>>,
) -> Option<Solution> {
    let mut robust = vec![1.0; target.len()];
    let mut last = None;
    for _ in 0..PASSES {
        let rows: Vec<f64> = weights.iter().zip(&robust).map(|(w, r)| w * r).collect();
        let solution = once(columns, target, &rows, holding)?;
        let next = spikes(&solution.residual, weights);
        let still = robust.iter().zip(&next).all(|(a, b)| (a - b).abs() < 1e-3);
        robust = next;
        last = Some(solution);
        if still {
            break;
        }
    }
    let mut solution = last?;
    solution.outliers = robust.iter().zip(weights).filter(|(r, w)| **r < 0.5 && **w > 0.0).count();
    Some(solution)
}

/// One weighted solution: rows that take part are multiplied with the root of their weight.
pub fn once(
    columns: &[&[f64]],
    target: &[f64],
    weights: &[f64],
    holding: Option<&DMatrix<f64>>,
) -> Option<Solution> {
    let count = columns.len();
    let is_good = |&row: &usize| {
        let finite = target[row].is_finite() && columns.iter().all(|column| column[row].is_finite());
        finite && weights[row] > 0.0
    };
    let good: Vec<usize> = (0..target.len()).filter(is_good).collect();
    if count == 0 || good.len() < 2 * count + 3 {
        return None;
    }
    let root = |row: usize| weights[row].sqrt();
    let weight: f64 = good.iter().map(|&row| weights[row]).sum();
    let entry = |i: usize, j: usize| match (good.get(i), holding) {
        (Some(row), _) => root(*row) * columns[j][*row],
        // Further columns are free.
        (None, Some(holding)) if j < holding.ncols() => weight.sqrt() * holding[(i - good.len(), j)],
        (None, _) => 0.0,
    };
    let rows = good.len() + holding.map_or(0, DMatrix::nrows);
    let design = DMatrix::from_fn(rows, count, entry);
    let values = DVector::from_fn(rows, |i, _| good.get(i).map_or(0.0, |row| root(*row) * target[*row]));
    let ridge = Weak::Ridge { share: RIDGE, nothing: NOTHING * weight.sqrt() };
    let found = linear::solve(&design, &values, ridge).ok()?;
    let residual: Vec<f64> = (0..target.len())
        .map(|row| {
            let columns = columns.iter().zip(&found.coefficients);
            columns.fold(target[row], |rest, (column, c)| rest - c * column[row])
        })
        .collect();
    let free = real(good.len() - count);
    let square = found.residual.rows(0, good.len()).norm_squared();
    let variance = square / free * inflation(&residual, &good);
    let sigmas = (0..count).map(|index| variance.sqrt() * found.sigma(index)).collect();
    let finite = found.coefficients.iter().all(|c| c.is_finite());
    finite.then(|| Solution {
        coefficients: found.coefficients.iter().copied().collect(),
        sigmas,
        residual,
        rms: (square / weight).sqrt(),
        outliers: 0,
    })
}

/// What a cubic over a range leaves of values at places in it, each with its weight.
pub fn beside_cubic(
    places: &[f64],
    [low, high]: [f64; 2],
    values: &[f64],
    weights: &[f64],
) -> Option<Vec<f64>> {
    let (middle, half) = (0.5 * (low + high), (0.5 * (high - low)).max(1e-9));
    let power = |power| places.iter().map(|place| ((place - middle) / half).powi(power)).collect();
    let powers: [Vec<f64>; 4] = [0, 1, 2, 3].map(power);
    Some(once(&powers.each_ref().map(Vec::as_slice), values, weights, None)?.residual)
}

/// By how much the variance of a coefficient grows because neighbouring residuals resemble each other.
fn inflation(residual: &[f64], good: &[usize]) -> f64 {
    let pairs = good.iter().zip(good.iter().skip(1)).filter(|(a, b)| **b == **a + 1);
    let (mut cross, mut square) = (0.0, 0.0);
    for (a, b) in pairs {
        cross += residual[*a] * residual[*b];
        square += 0.5 * (residual[*a] * residual[*a] + residual[*b] * residual[*b]);
    }
    let rho = if square > 0.0 { (cross / square).clamp(0.0, 0.98) } else { 0.0 };
    (1.0 + rho) / (1.0 - rho)
}

/// Sizes of what is a number and has a weight.
fn sizes(values: &[f64], weights: &[f64]) -> Vec<f64> {
    let known = values.iter().zip(weights).filter(|(value, weight)| value.is_finite() && **weight > 0.0);
    known.map(|(value, _)| value.abs()).collect()
}

/// The residual that all but a few windows stay below.
fn largest(residual: &[f64], weights: &[f64]) -> f64 {
    let mut sizes = sizes(residual, weights);
    if sizes.is_empty() {
        return 0.0;
    }
    let place = sizes.len() - 1 - sizes.len() / MOST_SPIKES;
    *sizes.select_nth_unstable_by(place, f64::total_cmp).1
}

/// Weights that take spikes out: a residual is held against the median of its neighbours, so that what a model leaves over
/// minutes keeps its weight, however large it is.
fn spikes(residual: &[f64], weights: &[f64]) -> Vec<f64> {
    let near = |row: usize| {
        let from = row.saturating_sub(NEIGHBOURS);
        let to = (row + NEIGHBOURS + 1).min(residual.len());
        let others = (from..to).filter(|&other| other != row && residual[other].is_finite());
        let others: Vec<f64> = others.map(|other| residual[other]).collect();
        median_if_any(&others)
    };
    let away: Vec<f64> =
        (0..residual.len()).map(|row| near(row).map_or(f64::NAN, |near| residual[row] - near)).collect();
    let sigma = median_if_any(&sizes(&away, weights))
        .map_or(0.0, |middle| 1.4826 * middle)
        .max(BESIDE_THE_REST * largest(residual, weights));
    let weight = |away: &f64| {
        if !away.is_finite() || sigma <= 0.0 {
            return 1.0;
        }
        let share = away / (BISQUARE * sigma);
        if share.abs() >= 1.0 { 0.0 } else { (1.0 - share * share) * (1.0 - share * share) }
    };
    // Within four deviations nothing is a spike, and noise keeps its full weight.
    away.iter().map(|away| if away.abs() <= 4.0 * sigma { 1.0 } else { weight(away) }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::noise;

    #[test]
    fn spikes_cost_nothing_and_the_sigmas_are_honest() {
        let rows = 400;
        let x: Vec<f64> = (0..rows).map(|i| f64::from(i) / 400.0).collect();
        let ones = vec![1.0; 400];
        let mut noise = noise();
        let mut target: Vec<f64> = x.iter().map(|x| 3.0 - 2.0 * x + 0.1 * noise()).collect();
        for spike in [7, 100, 101, 320] {
            target[spike] += 50.0;
        }
        target[50] = f64::NAN;
        let solution = solve(&[&ones, &x], &target, &ones, None).unwrap();
        assert!((solution.coefficients[0] - 3.0).abs() < 4.0 * solution.sigmas[0], "{solution:?}");
        assert!((solution.coefficients[1] + 2.0).abs() < 4.0 * solution.sigmas[1]);
        assert!(solution.sigmas[1] < 0.05 && solution.sigmas[1] > 0.01, "{:?}", solution.sigmas);
        assert_eq!(solution.outliers, 4);
    }

    #[test]
    fn what_cannot_be_told_apart_stays_finite_and_too_few_rows_are_refused() {
        let ones = vec![1.0; 20];
        let target = vec![2.0; 20];
        let solution = solve(&[&ones, &ones], &target, &ones, None).unwrap();
        assert!((solution.coefficients.iter().sum::<f64>() - 2.0).abs() < 1e-6);
        assert!(solve(&[&ones[..4], &ones[..4]], &target[..4], &ones[..4], None).is_none());
    }
}
