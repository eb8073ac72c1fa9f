//! Earth rate in a case that turns: carried from bin to bin by what the gyros themselves say of the turning.
//!
//! In the case the Earth's vector turns backwards, dE/dt = −ω × E with ω relative to the Earth. Over a bin ω is taken as
//! constant, and both the turn and the mean of E over it are closed formulas.

use nalgebra::Vector3;

use super::bins::Bin;
use crate::numbers::{dot, norm};

/// Angle below which a turn is none (rad).
const NONE_RAD: f64 = 1e-12;

/// Mean in case axes over each bin of any vector that is fixed to the Earth, in its own unit of measure, from that at the beginning of
/// the run. `turning` gives a bin's rate in case axes (°/h), relative to the Earth, from the vector at its beginning.
pub fn carried(bins: &[Bin], start: [f64; 3], turning: impl Fn(&Bin, [f64; 3]) -> [f64; 3]) -> Vec<[f64; 3]> {
    let mut fixed = start;
    let mut now_s = bins.first().map_or(0.0, |bin| bin.begin_s);
    let mut last = [0.0; 3];
    let mut means = Vec::with_capacity(bins.len());
    for bin in bins {
        // Over a gap the table is taken to go on as it did.
        let gap_s = bin.begin_s - now_s;
        if gap_s > 1e-6 {
            fixed = turned(fixed, last, gap_s).0;
        }
        let rate = turning(bin, fixed);
        if rate.iter().all(|x| x.is_finite()) {
            last = rate;
        }
        let (behind, mean) = turned(fixed, last, bin.length_s);
        means.push(mean);
        fixed = behind;
        now_s = bin.begin_s + bin.length_s;
    }
    means
}

/// A vector that is fixed to the Earth, in a case that turns for some seconds: at their end, and its mean over them.
fn turned(vector: [f64; 3], rate_deg_per_h: [f64; 3], seconds: f64) -> ([f64; 3], [f64; 3]) {
    let size = norm(rate_deg_per_h);
    let angle = (size / 3600.0).to_radians() * seconds;
    if angle < NONE_RAD {
        return (vector, vector);
    }
    let axis = rate_deg_per_h.map(|x| x / size);
    let along = dot(axis, vector);
    let across = Vector3::from(axis).cross(&Vector3::from(vector));
    let [sin, cos] = [libm::sin(angle), libm::cos(angle)];
    let half = libm::sin(0.5 * angle);
    let made =
        |of: f64, by: f64| [0, 1, 2].map(|i| axis[i] * along * (1.0 - of) + vector[i] * of - across[i] * by);
    (made(cos, sin), made(sin / angle, 2.0 * half * half / angle))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_mean_of_a_turning_vector_is_that_of_many_small_turns() {
        let (start, rate) = ([3.0, -1.0, 12.0], [1.0e5, -3.0e5, 2.0e5]);
        let (end, mean) = turned(start, rate, 4.0);
        let (mut now, mut sum) = (start, [0.0; 3]);
        for _ in 0..40_000 {
            let (next, part) = turned(now, rate, 1e-4);
            sum.iter_mut().zip(part).for_each(|(sum, part)| *sum += part / 40_000.0);
            now = next;
        }
        for axis in 0..3 {
            assert!((now[axis] - end[axis]).abs() < 1e-8 && (sum[axis] - mean[axis]).abs() < 1e-8);
        }
        // A quarter turn about z takes a vector along x backwards, to −y.
        let (end, _) = turned([1.0, 0.0, 0.0], [0.0, 0.0, 90.0 * 3600.0], 1.0);
        assert!(end[0].abs() < 1e-12 && (end[1] + 1.0).abs() < 1e-12);
    }
}
