//! Linear algebra on at most eight rows of three, without allocation.

use arrayvec::ArrayVec;
use nalgebra::{Matrix3, SMatrix};

use crate::sample::{MAX_PARITY, MAX_SENSORS};

/// N rows of three, the unused ones zero.
pub(crate) type Rows = [[f64; 3]; MAX_SENSORS];
/// Upper triangle of a 3×3 matrix, by rows.
pub(super) type Triangle = [[f64; 3]; 3];

/// A unit vector whose part outside the span found so far is shorter than this adds no parity row.
///
/// The vectors that are passed over hold at most N·10⁻¹² of the squared length that is still to be found, so
/// a later one always brings the missing row.
const SHORTEST_PARITY: f64 = 1e-6;

/// Whether the condition number is at most `limit`.
pub(super) fn is_conditioned(rows: &Rows, limit: f64) -> bool {
    // Where the columns are near to orthogonal Gershgorin's circles tell it without eigenvalues; well within, so that rounding
    // does not decide.
    let gram = gram(rows);
    let radius = |i: usize| (0..3).filter(|j| *j != i).map(|j| gram[(i, j)].abs()).sum::<f64>();
    let smallest = (0..3).map(|i| gram[(i, i)] - radius(i)).fold(f64::INFINITY, f64::min);
    let largest = (0..3).map(|i| gram[(i, i)] + radius(i)).fold(0.0, f64::max);
    let near = smallest > 0.0 && largest <= 0.5 * limit * limit * smallest;
    near && gram.iter().all(|value| value.is_finite()) || condition_number(rows) <= limit
}

/// Ratio of the largest to the smallest singular value; infinite or NaN for a singular or broken matrix.
pub(super) fn condition_number(rows: &Rows) -> f64 {
    let [smallest, largest] = squares(rows);
    if smallest <= 0.0 { f64::INFINITY } else { libm::sqrt(largest / smallest) }
}

/// Smallest and largest singular value; zero for the smallest of a singular matrix, NaN for those of a broken one.
pub(super) fn singular_values(rows: &Rows) -> [f64; 2] {
    squares(rows).map(libm::sqrt)
}

/// Squares of the smallest and the largest singular value, not below zero; NaN for those of a broken matrix.
fn squares(rows: &Rows) -> [f64; 2] {
    let gram = gram(rows);
    if gram.iter().any(|value| !value.is_finite()) {
        return [f64::NAN; 2];
    }
    let eigenvalues = gram.symmetric_eigenvalues();
    [eigenvalues.min().max(0.0), eigenvalues.max()]
}

/// Q with orthonormal columns and upper triangular R, A = Q·R; `None` where A has no full rank.
pub(super) fn orthonormal_columns(a: &Rows) -> Option<(Rows, Triangle)> {
    let qr = matrix(a).qr();
    let (q, r) = (qr.q(), qr.r());
    let sound = (0..3).all(|i| r[(i, i)] != 0.0) && r.iter().all(|value| value.is_finite());
    sound.then(|| {
        let mut columns = Rows::default();
        for ((row, from), stated) in columns.iter_mut().zip(q.row_iter()).zip(a) {
            // A sensor that takes no part has no part at all, not one within rounding.
            if stated.iter().any(|c| *c != 0.0) {
                *row = from.transpose().into();
            }
        }
        (columns, r.transpose().into())
    })
}

/// Scalar products of the columns.
fn gram(rows: &Rows) -> Matrix3<f64> {
    let matrix = matrix(rows);
    matrix.tr_mul(&matrix)
}

/// The rows as a matrix.
fn matrix(rows: &Rows) -> SMatrix<f64, MAX_SENSORS, 3> {
    SMatrix::from_fn(|i, j| rows[i][j])
}

/// Orthonormal rows that complete the columns of Q to the space of the sensors for which `used` holds: the
/// null space of Qᵀ.
///
/// The unit vectors are taken in the sensors' order, so that the result is the same on every machine and, as
/// in Potter and Suman's construction (1977), each row starts with a positive element.
pub(super) fn parity_rows(
    q: &Rows,
    used: impl Fn(usize) -> bool,
) -> ArrayVec<[f64; MAX_SENSORS], MAX_PARITY> {
    let wanted = (0..MAX_SENSORS).filter(|i| used(*i)).count().saturating_sub(3);
    let mut parity: ArrayVec<[f64; MAX_SENSORS], MAX_PARITY> = ArrayVec::new();
    for i in (0..MAX_SENSORS).filter(|i| used(*i)) {
        if parity.len() >= wanted {
            break;
        }
        let mut row = [0.0; MAX_SENSORS];
        row[i] = 1.0;
        // A short remainder has lost digits: it is orthogonalised again at its own scale.
        let mut fits = true;
        for _ in 0..2 {
            for column in 0..3 {
                let projection: f64 = row.iter().zip(q).map(|(x, q)| x * q[column]).sum();
                for (x, q) in row.iter_mut().zip(q) {
                    *x -= projection * q[column];
                }
            }
            for found in &parity {
                let projection: f64 = row.iter().zip(found).map(|(x, f)| x * f).sum();
                for (x, f) in row.iter_mut().zip(found) {
                    *x -= projection * f;
                }
            }
            let norm = libm::sqrt(row.iter().map(|x| x * x).sum());
            if norm.is_nan() || norm <= SHORTEST_PARITY {
                fits = false;
                break;
            }
            for x in &mut row {
                *x /= norm;
            }
        }
        if fits && parity.try_push(row).is_err() {
            break;
        }
    }
    parity
}
