//! Nonlinear least squares: the minimum by Levenberg and Marquardt's method (`levenberg-marquardt`, after MINPACK), and
//! the covariance of what was found.
//!
//! Residuals are whitened by whoever makes them, and parameters scaled so that one of them is a large change: derivatives
//! are central differences over a millionth.

use levenberg_marquardt::{LeastSquaresProblem, LevenbergMarquardt, TerminationReason};
use nalgebra::storage::Owned;
use nalgebra::{DMatrix, DVector, Dyn};

use super::linear::{self, Undetermined};

/// Step of the differences.
const STEP: f64 = 1e-6;

/// What was found.
#[derive(Debug, Clone, PartialEq)]
pub struct Solution {
    /// The parameters.
    pub parameters: Vec<f64>,
    /// Their covariance, for residuals of variance one.
    pub covariance: DMatrix<f64>,
    /// Residuals at the minimum.
    pub residuals: Vec<f64>,
    /// Sum of their squares.
    pub chi_square: f64,
    /// Residuals less parameters.
    pub degrees: usize,
}

/// Why there is no solution.
#[derive(Debug, Clone, PartialEq)]
pub enum NoSolution {
    /// The parameter with the largest part in a direction that the residuals do not depend on.
    NotDetermined(usize),
    /// The search ended without a minimum.
    NoMinimum,
}

impl NoSolution {
    /// In plain words: what `of` ("the poses") do not determine by the name of the parameter, and what more is needed; or what to
    /// look at where nothing was found.
    pub fn words(&self, of: &str, name: impl Fn(usize) -> String, more: &str, look: &str) -> String {
        match self {
            Self::NotDetermined(index) => format!("{of} do not determine {}: {more}", name(*index)),
            Self::NoMinimum => look.to_owned(),
        }
    }
}

impl Solution {
    /// Standard error of a parameter.
    pub fn sigma(&self, index: usize) -> f64 {
        self.covariance.get((index, index)).map_or(f64::NAN, |variance| variance.max(0.0).sqrt())
    }
}

/// Minimises the sum of the squares of `residuals` from `start` on.
///
/// # Errors
/// Where the residuals do not determine the parameters, or no minimum was found.
pub fn solve(start: &[f64], residuals: impl Fn(&[f64]) -> Vec<f64>) -> Result<Solution, NoSolution> {
    let problem = Problem { parameters: DVector::from_column_slice(start), residuals };
    let (problem, report) = LevenbergMarquardt::new().with_patience(100).minimize(problem);
    let good = report.termination.was_successful()
        || matches!(report.termination, TerminationReason::NoImprovementPossible(_));
    if good { solution(&problem) } else { Err(NoSolution::NoMinimum) }
}

/// The solution where it is known beforehand: what residuals of variance one will make of its covariance.
///
/// # Errors
/// Where the residuals do not determine the parameters.
pub fn known(parameters: &[f64], residuals: impl Fn(&[f64]) -> Vec<f64>) -> Result<Solution, NoSolution> {
    solution(&Problem { parameters: DVector::from_column_slice(parameters), residuals })
}

fn solution<F: Fn(&[f64]) -> Vec<f64>>(problem: &Problem<F>) -> Result<Solution, NoSolution> {
    let parameters: Vec<f64> = problem.parameters.iter().copied().collect();
    let residuals = (problem.residuals)(&parameters);
    let covariance =
        linear::inverse(&problem.slopes()).map_err(|Undetermined(index)| NoSolution::NotDetermined(index))?;
    let chi_square = residuals.iter().map(|residual| residual * residual).sum();
    let degrees = residuals.len().saturating_sub(parameters.len());
    Ok(Solution { parameters, covariance, residuals, chi_square, degrees })
}

struct Problem<F> {
    parameters: DVector<f64>,
    residuals: F,
}

impl<F: Fn(&[f64]) -> Vec<f64>> Problem<F> {
    /// Derivatives of the residuals, one column per parameter.
    fn slopes(&self) -> DMatrix<f64> {
        let mut at = self.parameters.as_slice().to_vec();
        let mut columns = Vec::with_capacity(at.len());
        for index in 0..at.len() {
            let middle = at[index];
            at[index] = middle + STEP;
            let above = (self.residuals)(&at);
            at[index] = middle - STEP;
            let below = (self.residuals)(&at);
            at[index] = middle;
            let differences = above.iter().zip(&below).map(|(a, b)| (a - b) / (2.0 * STEP));
            columns.push(DVector::from_iterator(above.len(), differences));
        }
        DMatrix::from_columns(&columns)
    }
}

impl<F: Fn(&[f64]) -> Vec<f64>> LeastSquaresProblem<f64, Dyn, Dyn> for Problem<F> {
    type ResidualStorage = Owned<f64, Dyn>;
    type JacobianStorage = Owned<f64, Dyn, Dyn>;
    type ParameterStorage = Owned<f64, Dyn>;

    fn set_params(&mut self, parameters: &DVector<f64>) {
        self.parameters.copy_from(parameters);
    }

    fn params(&self) -> DVector<f64> {
        self.parameters.clone()
    }

    fn residuals(&self) -> Option<DVector<f64>> {
        Some(DVector::from_vec((self.residuals)(self.parameters.as_slice())))
    }

    fn jacobian(&self) -> Option<DMatrix<f64>> {
        Some(self.slopes())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_exponential_is_found_with_the_covariance_of_its_straight_neighbour() {
        let times: Vec<f64> = (0..50).map(|k| 0.1 * f64::from(k)).collect();
        let residuals = |p: &[f64]| {
            times.iter().map(|t| (p[0] * libm::exp(-p[1] * t) - 2.0 * libm::exp(-0.7 * t)) / 0.01).collect()
        };
        let found = solve(&[1.0, 1.0], residuals).unwrap();
        assert!((found.parameters[0] - 2.0).abs() < 1e-9 && (found.parameters[1] - 0.7).abs() < 1e-9);
        // The normal matrix by hand.
        let mut normal = [0.0; 3];
        for t in &times {
            let e = libm::exp(-0.7 * t);
            let (x, y) = (e / 0.01, -2.0 * t * e / 0.01);
            normal = [normal[0] + x * x, normal[1] + x * y, normal[2] + y * y];
        }
        let determinant = normal[0] * normal[2] - normal[1] * normal[1];
        assert!((found.covariance[(0, 0)] / (normal[2] / determinant) - 1.0).abs() < 1e-6);
        assert!((found.covariance[(0, 1)] / (-normal[1] / determinant) - 1.0).abs() < 1e-6);
        assert_eq!(found.degrees, 48);
    }

    #[test]
    fn a_parameter_that_nothing_depends_on_is_named() {
        let lonely = solve(&[0.0, 0.0], |p| vec![p[0] - 1.0, 2.0 * p[0], 0.5 - p[0]]);
        assert_eq!(lonely.unwrap_err(), NoSolution::NotDetermined(1));
        let twins = solve(&[0.0, 0.0], |p| vec![p[0] + p[1] - 1.0, 2.0 * (p[0] + p[1]), 0.5]);
        assert!(matches!(twins.unwrap_err(), NoSolution::NotDetermined(_)));
    }
}
