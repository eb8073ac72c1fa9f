//! The condition of C(T) over a whole range of temperature.
//!
//! C(T) is a straight line, and a singular value of a sum differs from that of its first part by at most the second part's norm
//! [Weyl]. So from the singular values at a middle temperature, and `‖C_1‖` times half the width, follows a bound over all of an
//! interval. Where it is not tight enough the interval is halved: nothing between two looks is left to chance.

use arrayvec::ArrayVec;

use super::linear::{Rows, singular_values};

/// Share by which a condition number between two temperatures may exceed the limit that every one looked at keeps.
const SLACK: f64 = 0.01;
/// Halvings after which an interval counts as one temperature.
const DEEPEST: u8 = 60;

/// A temperature (°C) in the range at which the condition number exceeds `limit`, and the number there, NaN where there is none;
/// `None` where it stays within 1.01 times the limit everywhere, and within the limit wherever it was looked at.
///
/// `rows_at` gives C(T), `slopes` is `C_1` of the same rows (1/°C).
pub(super) fn ill_conditioned(
    range_deg_c: [f64; 2],
    rows_at: impl Fn(f64) -> Rows,
    slopes: &Rows,
    limit: f64,
) -> Option<(f64, f64)> {
    let steepest = libm::sqrt(slopes.iter().flatten().map(|slope| slope * slope).sum());
    // One interval is looked at, and of each of its ancestors the other half waits.
    let mut waiting: ArrayVec<([f64; 2], u8), { DEEPEST as usize + 2 }> = ArrayVec::new();
    waiting.push((range_deg_c, 0));
    while let Some(([from, to], depth)) = waiting.pop() {
        let middle = from + (to - from) / 2.0;
        let [smallest, largest] = singular_values(&rows_at(middle));
        let condition = largest / smallest;
        if condition.is_nan() || condition > limit {
            return Some((middle, condition));
        }
        let change = steepest * (to - middle).max(middle - from);
        if largest + change <= (1.0 + SLACK) * limit * (smallest - change) {
            continue;
        }
        if depth >= DEEPEST || middle <= from || middle >= to {
            return Some((middle, f64::INFINITY));
        }
        waiting.push(([middle, to], depth + 1));
        waiting.push(([from, middle], depth + 1));
    }
    None
}
