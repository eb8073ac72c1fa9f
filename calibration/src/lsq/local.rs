//! A parabola over a stretch, the middle of which counts most [Savitzky and Golay 1964; Cleveland 1979].
//!
//! It is fitted thousands of times to a few dozen points about each of them: three normal equations, in a time that is centred and of
//! the size of one, are exact enough and hundreds of times faster than the general way.

use nalgebra::{Matrix3, Vector3};

/// Coefficients of 1, t and t² about the middle, and the standard deviation of the first over that of a point; `None` where the points do
/// not determine them. Points are pairs of a time since the middle and a value; those at the half width and beyond count for nothing.
pub fn parabola(points: impl Iterator<Item = [f64; 2]>, half_width: f64) -> Option<([f64; 3], f64)> {
    let (mut normal, mut right, mut squares) = (Matrix3::zeros(), Vector3::zeros(), Matrix3::zeros());
    let mut count = 0;
    for [time, value] in points {
        let u = time / half_width;
        let cube = (1.0 - u.abs() * u * u).max(0.0);
        let weight = cube * cube * cube;
        let powers = Vector3::new(1.0, u, u * u);
        normal += weight * powers * powers.transpose();
        squares += weight * weight * powers * powers.transpose();
        right += weight * value * powers;
        count += u8::from(weight > 0.0 && count < 3);
    }
    // Rounding alone may leave an inverse.
    if count < 3 {
        return None;
    }
    let inverse = normal.try_inverse()?;
    let found = inverse * right;
    let share = (inverse * squares * inverse)[(0, 0)].max(0.0).sqrt();
    let coefficients = [found[0], found[1] / half_width, found[2] / (half_width * half_width)];
    coefficients.iter().all(|c| c.is_finite()).then_some((coefficients, share))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_parabola_is_found_and_noise_shrinks_as_stated() {
        let points = |value: fn(f64) -> f64| (-50..=50).map(move |k| [f64::from(k), value(f64::from(k))]);
        let (found, share) = parabola(points(|t| 3.0 - 0.2 * t + 0.01 * t * t), 40.0).unwrap();
        for (found, true_value) in found.into_iter().zip([3.0, -0.2, 0.01]) {
            assert!((found - true_value).abs() < 1e-12);
        }
        // Each point's part in the middle's value, one by one.
        let part = |k: i32| {
            let one = (-50..=50).map(|j| [f64::from(j), f64::from(u8::from(j == k))]);
            parabola(one, 40.0).unwrap().0[0]
        };
        let square: f64 = (-39..40).map(|k| part(k) * part(k)).sum();
        assert!((share - square.sqrt()).abs() < 1e-12);
        assert_eq!(parabola(points(|t| t).take(2), 60.0), None);
    }
}
