//! Linear algebra on at most eight rows of three, without allocation.

use arrayvec::ArrayVec;

use crate::sample::{MAX_PARITY, MAX_SENSORS};

/// N rows of three, the unused ones zero.
pub(super) type Rows = [[f64; 3]; MAX_SENSORS];
/// Upper triangle of a 3×3 matrix.
pub(super) type Triangle = [[f64; 3]; 3];

/// Sweeps of the Jacobi iteration: convergence is quadratic, three by three needs four or five.
const JACOBI_SWEEPS: usize = 12;
/// A unit vector whose part outside the span found so far is shorter than this adds no parity row.
///
/// The vectors that are passed over hold at most N·10⁻¹² of the squared length that is still to be found, so
/// a later one always brings the missing row.
const SHORTEST_PARITY: f64 = 1e-6;

/// Ratio of the largest to the smallest singular value; infinite or NaN for a singular or broken matrix.
pub(super) fn condition_number(rows: &Rows) -> f64 {
    let mut gram = [[0.0; 3]; 3];
    for row in rows {
        for (sums, a) in gram.iter_mut().zip(row) {
            for (sum, b) in sums.iter_mut().zip(row) {
                *sum += a * b;
            }
        }
    }
    let eigenvalues = symmetric_eigenvalues(gram);
    if eigenvalues.iter().any(|value| !value.is_finite()) {
        return f64::NAN;
    }
    let largest = eigenvalues.iter().copied().fold(0.0, f64::max);
    let smallest = eigenvalues.iter().copied().fold(f64::INFINITY, f64::min);
    if smallest <= 0.0 { f64::INFINITY } else { libm::sqrt(largest / smallest) }
}

/// Eigenvalues of a symmetric 3×3 matrix by cyclic Jacobi rotations.
fn symmetric_eigenvalues(mut a: [[f64; 3]; 3]) -> [f64; 3] {
    for _ in 0..JACOBI_SWEEPS {
        // p, q: the element that is made zero; r: the remaining axis.
        for (p, q, r) in [(0, 1, 2), (0, 2, 1), (1, 2, 0)] {
            if a[p][q] == 0.0 {
                continue;
            }
            let theta = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
            let sign = if theta < 0.0 { -1.0 } else { 1.0 };
            let t = sign / (theta.abs() + libm::sqrt(theta * theta + 1.0));
            let c = 1.0 / libm::sqrt(t * t + 1.0);
            let s = t * c;
            let shift = t * a[p][q];
            a[p][p] -= shift;
            a[q][q] += shift;
            a[p][q] = 0.0;
            a[q][p] = 0.0;
            let (rp, rq) = (a[r][p], a[r][q]);
            a[r][p] = c * rp - s * rq;
            a[r][q] = s * rp + c * rq;
            a[p][r] = a[r][p];
            a[q][r] = a[r][q];
        }
    }
    [a[0][0], a[1][1], a[2][2]]
}

/// Q with orthonormal columns and upper triangular R, A = Q·R; `None` where A has no full rank.
///
/// Gram–Schmidt with every column orthogonalised twice, which is as good as Householder ("twice is enough",
/// Giraud, Langou and Rozložník 2005) and keeps a zero row exactly zero and the identity exactly itself.
pub(super) fn orthonormal_columns(a: &Rows) -> Option<(Rows, Triangle)> {
    let mut q = *a;
    let mut r = Triangle::default();
    for k in 0..3 {
        for _ in 0..2 {
            for j in 0..k {
                let projection: f64 = q.iter().map(|row| row[j] * row[k]).sum();
                r[j][k] += projection;
                for row in &mut q {
                    row[k] -= projection * row[j];
                }
            }
        }
        let norm = libm::sqrt(q.iter().map(|row| row[k] * row[k]).sum());
        if norm <= 0.0 || !norm.is_finite() {
            return None;
        }
        r[k][k] = norm;
        for row in &mut q {
            row[k] /= norm;
        }
    }
    Some((q, r))
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
