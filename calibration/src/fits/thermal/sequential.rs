//! 000's procedure: the static bias from the plateaus, then the coefficients of rate and acceleration on the ramps.
//!
//! The paper takes one after the other, point by point, and approximates the points by straight lines, a parabola or splines. Here a
//! step is a weighted least-squares fit, rate and acceleration are one, because smoothing makes the two alike, and cross-validation
//! says whether they are curves over the derivatives, as in the paper, or polynomials in temperature.

use super::branches::History;
use super::columns::{Branch, Columns, Effect, Form, Term};
use super::joint::CUBIC;
use super::known::Known;
use super::ladder::lags;
use super::model::{Dynamics, Spec};
use super::noise::Noise;
use super::select::{Choice, Target, Trials, smallest};
use super::settings::Method;
use crate::error::Error;
use crate::lsq::weighted::solve;
use crate::report::counted;

/// The branches that terms of the rate and of the acceleration are told apart by.
const BRANCHES: [Branch; 2] = [Branch::RunUp, Branch::Braking];

/// Coefficients with their standard errors, and why there are none.
pub type Found = Result<Vec<(Term, f64, f64)>, String>;

/// What may follow the plateaus, the plainest first: Ṫ and T̈ of a gyro, a lag of an accelerometer.
fn offers(gyro: bool, method: Method, grid_step_s: f64) -> Vec<Dynamics> {
    if !gyro {
        return vec![lags(&[(3.0 * grid_step_s).max(10.0)], 0)];
    }
    let rate = |form| follows("Ṫ", Effect::Rate, 1, form);
    if method == Method::Rate {
        return vec![rate(Form::OverTemperature)];
    }
    let both = |(on_rate, on_acceleration)| {
        let (rate, acceleration) = (rate(on_rate), follows("T̈", Effect::Acceleration, 0, on_acceleration));
        Dynamics {
            name: format!("{}, {}", rate.name, acceleration.name),
            terms: [rate.terms, acceleration.terms].concat(),
        }
    };
    Form::ALL
        .into_iter()
        .flat_map(|rate| Form::ALL.map(|acceleration| (rate, acceleration)))
        .map(both)
        .collect()
}

/// A derivative by branches, its coefficient a curve of a form, or a polynomial of some degree in temperature.
fn follows(derivative: &str, effect: fn(Branch) -> Effect, degree: usize, form: Form) -> Dynamics {
    let over = ["", " by a parabola over it", " by lines over it", " by a spline over it"][form as usize];
    let of_branch = |branch| match form {
        Form::OverTemperature => effect(branch).powers(0..=degree).collect(),
        _ => effect(branch).knots(form).collect::<Vec<_>>(),
    };
    Dynamics {
        name: format!("{derivative}±{over}"),
        terms: BRANCHES.into_iter().flat_map(of_branch).collect(),
    }
}

/// What follows the plateaus of one sensor: the smallest of what may that leaves hardly more than the best on parts that it did not see.
/// Makes the columns of all, and of a cubic.
///
/// # Errors
/// As [`Columns::make`].
pub(super) fn choose(
    columns: &mut Columns<'_>,
    (gyro, target): (bool, &Target),
    known: &Known,
    method: Method,
) -> Result<Choice, Error> {
    let offers = offers(gyro, method, columns.basis().filter.grid_step_s);
    let (degree, history) = (degree(&known.history), &known.history);
    let mut terms: Vec<Term> = offers.iter().flat_map(|dynamics| dynamics.terms.clone()).collect();
    terms.extend(Effect::Static.powers(0..=CUBIC));
    columns.make(&terms)?;
    let trials = Trials::of(target, columns, &terms, &Noise::default(), (&history.piece, &known.temperature));
    let spec = |dynamics| Spec { degree, dynamics, scale: target.widest_scale(), shrink: 0.0 };
    let tried: Vec<_> = offers.into_iter().filter_map(|dynamics| trials.tried(spec(dynamics))).collect();
    let chosen = smallest(&tried).and_then(|best| tried.iter().position(|other| other == best));
    Ok(Choice { mean: trials.score(&Spec::default()).unwrap_or(f64::NAN), tried, chosen })
}

/// Power of the static bias that so many levels of plateaus allow.
pub fn degree(history: &History) -> usize {
    history.levels().saturating_sub(1).min(2)
}

/// Standard errors by which a power of the scale factor error must stand out.
const STANDS_OUT: f64 = 3.0;

/// Finds the coefficients of one sensor, with `terms` after the plateaus.
///
/// # Errors
/// Why the log does not allow it, and what to do.
pub fn find(columns: &Columns<'_>, target: &Target, history: &History, terms: &[Term]) -> Found {
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
    let own: Vec<&[f64]> = terms.iter().map(|term| columns.get(*term)).collect();
    let solution = solve(&own, &rest, &moving, None).ok_or("too few windows on ramps")?;
    let values = solution.coefficients.iter().zip(&solution.sigmas);
    found.extend(terms.iter().zip(values).map(|(term, (value, sigma))| (*term, *value, *sigma)));
    Ok(found)
}
