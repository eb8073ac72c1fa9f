//! Linear least squares.

use nalgebra::{DMatrix, DVector};

/// Singular values below this share of the largest one carry no information.
const SMALLEST_SINGULAR: f64 = 1e-10;

/// Coefficients with which the columns add up best to `target`, by singular values.
///
/// Columns are brought to one norm first, so that their units do not matter. `None` where lengths differ or nothing
/// is left to solve.
pub(crate) fn solve(columns: &[Vec<f64>], target: &[f64]) -> Option<Vec<f64>> {
    if columns.is_empty() || columns.iter().any(|column| column.len() != target.len()) {
        return None;
    }
    let norms =
        columns.iter().map(|column| column.iter().map(|x| x * x).sum::<f64>().sqrt().max(f64::MIN_POSITIVE));
    let norms: Vec<f64> = norms.collect();
    let scaled = columns.iter().zip(&norms).flat_map(|(column, norm)| column.iter().map(move |x| x / norm));
    let matrix = DMatrix::from_iterator(target.len(), columns.len(), scaled);
    let svd = matrix.svd(true, true);
    let smallest = SMALLEST_SINGULAR * svd.singular_values.max();
    let solution = svd.solve(&DVector::from_column_slice(target), smallest).ok()?;
    Some(solution.iter().zip(&norms).map(|(coefficient, norm)| coefficient / norm).collect())
}
