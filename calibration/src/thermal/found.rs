//! What came of one sensor: its terms, or why it has none.

use super::columns::Term;
use super::compare::Rivals;
use super::model::Spec;
use super::select::{Choice, WORTH_IT};
use crate::lsq::weighted::Solution;

/// What came of one sensor.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Found {
    /// Coefficients and their standard errors.
    pub(super) terms: Vec<(Term, f64, f64)>,
    /// The model in words.
    pub(super) words: String,
    /// Cross-validation, where it was asked.
    pub(super) choice: Option<Choice>,
    /// Why there are no terms.
    pub(super) refused: Option<String>,
    /// What is to be known.
    pub(super) remarks: Vec<String>,
    /// What they are compared with.
    pub(super) rivals: Option<Rivals>,
    /// Root mean square of the thermometer's noise that they pass on.
    pub(super) passed_on: Option<f64>,
    /// Whether the sensor does not work at all.
    pub(super) dead: bool,
    /// Whether temperature does nothing to it.
    pub(super) flat: bool,
}

impl Found {
    pub(super) fn refused(why: &str) -> Self {
        Self { refused: Some(why.to_owned()), ..Self::default() }
    }

    pub(super) fn dead(why: &str) -> Self {
        Self { dead: true, ..Self::refused(why) }
    }

    /// Coefficients of a solution with their standard errors.
    pub(super) fn terms_of(spec: &Spec, solution: &Solution, level: bool) -> Vec<(Term, f64, f64)> {
        let terms = spec.terms(level).into_iter().zip(solution.coefficients.iter().zip(&solution.sigmas));
        terms.map(|(term, (value, sigma))| (term, *value, *sigma)).collect()
    }

    /// A sensor that temperature does nothing to; where its level is known, that is its bias.
    pub(super) fn flat(level: &Solution, known: bool) -> Self {
        let constant = level.coefficients.first().zip(level.sigmas.first()).filter(|_| known);
        Self {
            terms: constant.map(|(value, sigma)| (Term::Static(0), *value, *sigma)).into_iter().collect(),
            words: "constant".to_owned(),
            flat: true,
            ..Self::default()
        }
    }

    pub(super) fn sequential(terms: Vec<(Term, f64, f64)>, left: f64, mean: f64) -> Self {
        if left <= WORTH_IT * mean {
            let mut words = "plateaus".to_owned();
            let has = |is: fn(Term) -> bool| terms.iter().any(|(term, ..)| is(*term));
            let steps = [
                (", then Ṫ±", has(|term| matches!(term, Term::Rate(..)))),
                (", then T̈±", has(|term| matches!(term, Term::Acceleration(..)))),
                (", then a lag", has(|term| matches!(term, Term::Lag(..)))),
            ];
            steps.iter().filter(|(_, has)| *has).for_each(|(step, _)| words.push_str(step));
            return Self { terms, words, ..Self::default() };
        }
        Self::refused(&format!(
            "no model beats its mean: the terms leave {left:.3e}, the mean {mean:.3e}, in sample"
        ))
    }

    pub(super) fn chosen(choice: Choice, spec: &Spec, solution: &Solution, level: bool) -> Self {
        let mut remarks = Vec::new();
        // A few are the fit's own business; more are somebody's.
        if 10 * solution.outliers > solution.residual.len() {
            remarks.push(format!(
                "{} of {} windows were left out as spikes: something disturbs the sensor, check the log",
                solution.outliers,
                solution.residual.len()
            ));
        }
        Self {
            terms: Self::terms_of(spec, solution, level),
            words: spec.words(),
            choice: Some(choice),
            remarks,
            ..Self::default()
        }
    }
}
