//! 000's procedure: the static bias from the plateaus, then the rate's coefficient on the ramps, then the acceleration's.
//!
//! The paper takes one after the other, point by point, and approximates. Here every step is a weighted least-squares fit, and
//! the steps for rate and acceleration are repeated until neither moves, because smoothing makes the two alike.

use super::branches::History;
use super::columns::{Branch, Columns, Effect, Term};
use super::model::Spec;
use super::select::Target;
use crate::lsq::weighted::solve;
use crate::report::counted;

/// Rounds of rate and acceleration.
const ROUNDS: usize = 60;
/// Change of a coefficient, as a share of itself, that counts as none.
const STILL: f64 = 1e-6;

/// The branches that terms of the rate and of the acceleration are told apart by.
const BRANCHES: [Branch; 2] = [Branch::RunUp, Branch::Braking];

/// Coefficients with their standard errors, and why there are none.
pub type Found = Result<Vec<(Term, f64, f64)>, String>;

/// The terms of the rate and of the acceleration of a gyro.
pub fn gyro_terms() -> [Vec<Term>; 2] {
    [
        [0, 1]
            .into_iter()
            .flat_map(|power| BRANCHES.map(|branch| Effect::Rate(branch).power(power)))
            .collect(),
        BRANCHES.map(|branch| Effect::Acceleration(branch).power(0)).to_vec(),
    ]
}

/// Power of the static bias that so many levels of plateaus allow.
pub fn degree(history: &History) -> usize {
    history.levels().saturating_sub(1).min(2)
}

/// Standard errors by which a power of the scale factor error must stand out.
const STANDS_OUT: f64 = 3.0;

/// Finds the coefficients of one sensor: `steps` are the terms of each step after the plateaus.
///
/// # Errors
/// Why the log does not allow it, and what to do.
pub fn find(columns: &Columns<'_>, target: &Target, history: &History, steps: &[Vec<Term>]) -> Found {
    let levels = history.levels();
    if levels < 2 {
        return Err(format!(
            "the log has {} of different temperature, the sequential method needs 2 with a settled output: hold the \
             chamber longer, or use --method joint",
            counted(levels, "plateau", "plateaus")
        ));
    }
    let first = usize::from(!target.level);
    let weights_at = |rest: bool| -> Vec<f64> {
        let weights = target.weights.iter().zip(&history.at_rest);
        weights.map(|(weight, rests)| if *rests == rest { *weight } else { 0.0 }).collect()
    };
    let (resting, moving) = (Target { weights: weights_at(true), ..target.clone() }, weights_at(false));
    // The scale factor goes beside the bias, as far as it stands out.
    let mut scale = target.widest_scale().map(|widest| widest.min(degree(history)));
    let (mut found, rest) = loop {
        let spec = Spec { degree: degree(history), scale, ..Spec::default() };
        let solution = resting.solve(columns, &spec, true).ok_or("too few windows on plateaus")?;
        let found = spec.found(&solution, target.level);
        match (scale, found.last()) {
            (Some(highest), Some((_, value, sigma))) if value.abs() < STANDS_OUT * sigma => {
                scale = highest.checked_sub(1).filter(|lower| *lower >= first);
            }
            _ => break (found, solution.residual),
        }
    };
    let mut parts: Vec<Vec<(Term, f64, f64)>> =
        steps.iter().map(|terms| terms.iter().map(|term| (*term, 0.0, 0.0)).collect()).collect();
    for _ in 0..ROUNDS {
        let mut still = true;
        for step in 0..parts.len() {
            let others =
                parts.iter().enumerate().filter(|(other, _)| *other != step).flat_map(|(_, part)| part);
            let mut left = rest.clone();
            for (term, value, _) in others {
                left.iter_mut().zip(columns.get(*term)).for_each(|(left, column)| *left -= value * column);
            }
            let own: Vec<&[f64]> = parts[step].iter().map(|(term, ..)| columns.get(*term)).collect();
            let solution = solve(&own, &left, &moving, None).ok_or("too few windows on ramps")?;
            for (i, (_, value, sigma)) in parts[step].iter_mut().enumerate() {
                let new = solution.coefficients[i];
                still &= (new - *value).abs() <= STILL * new.abs();
                (*value, *sigma) = (new, solution.sigmas[i]);
            }
        }
        if still {
            break;
        }
    }
    found.extend(parts.into_iter().flatten());
    Ok(found)
}

/// What a found model leaves (weighted root mean square), each run's own mean taken off where the level is not known.
pub fn left(columns: &Columns<'_>, target: &Target, found: &[(Term, f64, f64)]) -> f64 {
    let mut residual = target.values.clone();
    for (term, value, _) in found {
        let column = target.column(columns, *term);
        residual.iter_mut().zip(column.iter()).for_each(|(left, column)| *left -= value * column);
    }
    let runs = target.run.last().map_or(0, |last| last + 1);
    let (mut square, mut weight) = (0.0, 0.0);
    for run in 0..runs {
        let rows =
            || (0..residual.len()).filter(move |&row| target.run[row] == run && target.weights[row] > 0.0);
        let good = || rows().filter(|&row| residual[row].is_finite());
        let all: f64 = good().map(|row| target.weights[row]).sum();
        let mean = if target.level || all <= 0.0 {
            0.0
        } else {
            good().map(|row| target.weights[row] * residual[row]).sum::<f64>() / all
        };
        square += good()
            .map(|row| target.weights[row] * (residual[row] - mean) * (residual[row] - mean))
            .sum::<f64>();
        weight += all;
    }
    if weight > 0.0 { (square / weight).sqrt() } else { f64::NAN }
}
