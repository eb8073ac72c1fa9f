//! How many readings on either side of a switch the two-sided fit takes, where noise and motion decide.
//!
//! Few readings follow the motion and add up noise: those of two on either side with the weights −1, 2.5, 2.5, −1. Many
//! average the noise and cut off the motion. The window with the least expected square of the restored angle's error is taken,
//! both parts of which the readings themselves tell (the focused information criterion [Claeskens and Hjort 2003]):
//!
//! ```text
//! E_m = σ²·‖w_m‖² + max(0, (I_m − I_ref)² − σ²·‖w_m − w_ref‖²)
//! ```
//!
//! `I_m = w_m·y` is the angle over the lost ticks by the fit of m readings on either side, `I_ref` that by a polynomial of
//! degree 4 over all readings, and σ² what a polynomial of degree 7 leaves of them. Where a degree of 6 says that 4 is too
//! little, the motion is too fast for the whole window, and the shortest one is taken.

use arrayvec::ArrayVec;

use super::fit::MAX_POINTS;

/// Fewest readings on a side of the fit.
const SHORTEST: usize = 2;
/// Degree of the reference, of what checks it, and of what tells the noise.
const REFERENCE_DEGREE: usize = 4;
const CHECK_DEGREE: usize = 6;
const NOISE_DEGREE: usize = 7;
/// Fewest readings, so that four degrees of freedom are left to tell the noise.
pub const MIN_ADAPTIVE_READINGS: u8 = 12;
/// Standard errors by which the check may differ from the reference.
const CHECK_SIGMAS: f64 = 3.0;

/// A linear function of the readings.
type Weights = ArrayVec<f64, MAX_POINTS>;

/// One polynomial of an orthonormal set over the readings' abscissas, and the angle that it stands for over the lost ticks.
struct Column {
    values: Weights,
    angle: f64,
}

/// Readings to take on either side of the switch, of one sensor.
///
/// `before` and `after` are its readings [abscissa (s), rate (rad/s)] from the switch outwards, `lost` the abscissas and
/// durations of the ticks to be bridged (s), `degree` that of the fit.
pub(super) fn choose(before: &[[f64; 2]], after: &[[f64; 2]], lost: &[[f64; 2]], degree: usize) -> usize {
    let shortest = SHORTEST.max(degree / 2 + 1);
    let all: ArrayVec<[f64; 2], MAX_POINTS> = before.iter().chain(after).copied().take(MAX_POINTS).collect();
    if all.len() < MIN_ADAPTIVE_READINGS.into() || all.len() < before.len() + after.len() {
        return shortest;
    }
    let columns = columns(&all, lost, NOISE_DEGREE);
    if columns.len() <= NOISE_DEGREE {
        return shortest;
    }
    let rates: Weights = all.iter().map(|[_, rate]| *rate).collect();
    let freedom = all.iter().skip(columns.len()).fold(0.0, |count, _| count + 1.0);
    let noise = residual(&rates, &columns) / freedom;
    let reference = weights(&columns, REFERENCE_DEGREE);
    let doubt = difference(&weights(&columns, CHECK_DEGREE), &reference);
    let off = dot(&doubt, &rates);
    if off * off > CHECK_SIGMAS * CHECK_SIGMAS * noise * dot(&doubt, &doubt) {
        return shortest;
    }

    let widest = before.len().max(after.len());
    let mut best = (f64::INFINITY, shortest);
    for readings in (shortest..=widest).rev() {
        let (old, new) = (readings.min(before.len()), readings.min(after.len()));
        let taken = |index: usize| index < old || (before.len()..before.len() + new).contains(&index);
        let points = all.iter().enumerate().filter(|(index, _)| taken(*index)).map(|(_, point)| *point);
        let points: ArrayVec<[f64; 2], MAX_POINTS> = points.collect();
        let mut short = weights(&self::columns(&points, lost, degree), degree).into_iter();
        // Readings outside the window have no weight.
        let of_all: Weights = (0..all.len())
            .map(|index| if taken(index) { short.next().unwrap_or(0.0) } else { 0.0 })
            .collect();
        let apart = difference(&of_all, &reference);
        let bias = dot(&apart, &rates);
        let bias_square = (bias * bias - noise * dot(&apart, &apart)).max(0.0);
        let error = noise * dot(&of_all, &of_all) + bias_square;
        if error < best.0 {
            best = (error, readings);
        }
    }
    best.1
}

/// Orthonormal polynomials up to a degree over the points, and their angles over the lost ticks; fewer where the points cannot
/// carry that degree.
fn columns(points: &[[f64; 2]], lost: &[[f64; 2]], degree: usize) -> ArrayVec<Column, { NOISE_DEGREE + 1 }> {
    let mut columns = ArrayVec::new();
    let from = points.iter().map(|[x, _]| *x).fold(f64::INFINITY, f64::min);
    let to = points.iter().map(|[x, _]| *x).fold(f64::NEG_INFINITY, f64::max);
    let half = (to - from) / 2.0;
    if half.is_nan() || half <= 0.0 {
        return columns;
    }
    let scaled = |x: f64| (x - from - half) / half;
    // Three-term recurrence [Forsythe 1957]: per point, and per lost tick, p_{k−1} and p_k.
    let mut work: ArrayVec<[f64; 3], MAX_POINTS> =
        points.iter().map(|[x, _]| [scaled(*x), 0.0, 1.0]).collect();
    let mut bridge: ArrayVec<[f64; 4], { super::MAX_LOST_TICKS }> = lost
        .iter()
        .take(super::MAX_LOST_TICKS)
        .map(|[x, duration]| [scaled(*x), *duration, 0.0, 1.0])
        .collect();
    let mut last_square = f64::INFINITY;
    for _ in 0..=degree.min(NOISE_DEGREE) {
        let square: f64 = work.iter().map(|[_, _, p]| p * p).sum();
        if square.is_nan() || square <= 1e-12 {
            break;
        }
        let a = work.iter().map(|[u, _, p]| u * p * p).sum::<f64>() / square;
        let b = square / last_square;
        let norm = libm::sqrt(square);
        columns.push(Column {
            values: work.iter().map(|[_, _, p]| p / norm).collect(),
            angle: bridge.iter().map(|[_, duration, _, p]| p * duration).sum::<f64>() / norm,
        });
        last_square = square;
        for [u, older, p] in &mut work {
            (*older, *p) = (*p, (*u - a) * *p - b * *older);
        }
        for [u, _, older, p] in &mut bridge {
            (*older, *p) = (*p, (*u - a) * *p - b * *older);
        }
    }
    columns
}

/// What the readings weigh in the angle over the lost ticks, by a fit of a degree.
fn weights(columns: &[Column], degree: usize) -> Weights {
    let count = columns.first().map_or(0, |column| column.values.len());
    let mut weights: Weights = core::iter::repeat_n(0.0, count).collect();
    for Column { values, angle } in columns.iter().take(degree + 1) {
        weights.iter_mut().zip(values).for_each(|(weight, value)| *weight += value * angle);
    }
    weights
}

/// Sum of the squares that the polynomials leave of the readings.
fn residual(rates: &[f64], columns: &[Column]) -> f64 {
    let mut left: Weights = rates.iter().copied().collect();
    for Column { values, .. } in columns {
        let share = dot(values, &left);
        left.iter_mut().zip(values).for_each(|(left, value)| *left -= share * value);
    }
    dot(&left, &left)
}

fn difference(a: &[f64], b: &[f64]) -> Weights {
    a.iter().zip(b).map(|(a, b)| a - b).collect()
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
