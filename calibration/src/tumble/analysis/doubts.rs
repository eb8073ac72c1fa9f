//! What makes the result of a fit none, or doubtful.

use nalgebra::Matrix3;

use isotherm_correction::orientation::CONDITION_LIMIT;

use crate::means::Size;

/// Largest angle (°, rms) by which fitted gyros may miss the direction of gravity after a turn; half a degree is usual by hand.
const LARGEST_LEFT_DEG: f64 = 3.0;

/// What to look at where the gyros do not follow the turns.
pub(super) const WRONG_GYROS: &str = "look at the unit of measure of the gyros in the mapping (57.3 times too much is °/s read as rad/s), at the order and the signs \
     of the columns, of the accelerometers too, at gyros at their limit in the turns, and at the time stamps";

/// Words where fitted gyros do not follow the turns: `angle` (rad) is left after each.
pub(super) fn lost(angle: &[f64], rows: &[[f64; 3]; 3]) -> Option<String> {
    let left = Size::of(angle).rms.to_degrees();
    if left.is_nan() || left > LARGEST_LEFT_DEG {
        return Some(format!(
            "after a turn they still miss the direction of gravity by {left:.1}° rms, at most {LARGEST_LEFT_DEG}° is a result: \
             {WRONG_GYROS}"
        ));
    }
    let values = Matrix3::from_fn(|i, j| rows[i][j]).singular_values();
    let condition = values.max() / values.min();
    (condition.is_nan() || condition > CONDITION_LIMIT).then(|| {
        format!("their axes are found in one plane, or nearly so (condition number {condition:.0}, at most {CONDITION_LIMIT}): {WRONG_GYROS}")
    })
}
