//! Gyros against accelerometers: between two poses the rotated direction of gravity must be the one that the accelerometers
//! find there (Tedaldi, Pretto and Menegatti 2014).

use nalgebra::{Matrix3, Vector3};

use crate::positions::solve::{NoSolution, solve};
use crate::positions::track::Track;

use super::accel::norm;

/// What was found of the gyros.
#[derive(Debug, Clone, PartialEq)]
pub struct GyroFit {
    /// K: true rate per stated rate.
    pub weight: [f64; 3],
    /// Mean output at rest (rad/s of the log), which is taken off before the weight.
    pub rest: [f64; 3],
    /// Input axes, unit vectors in case axes.
    pub rows: [[f64; 3]; 3],
    /// Standard errors of the weights (relative) and of the two angles of each axis (rad).
    pub sigma: [f64; 9],
    /// Angle between the direction that the gyros predict and the one that the accelerometers find, by transition (rad).
    pub angle: Vec<f64>,
}

/// A transition: ticks between two poses, and the directions of specific force before and after.
#[derive(Debug, Clone, PartialEq)]
pub struct Transition {
    /// First tick and tick behind the last.
    pub ticks: [usize; 2],
    /// Unit vectors along the specific force, in case axes.
    pub directions: [[f64; 3]; 2],
}

/// Fits scale factors and axes of three gyros to transitions.
///
/// # Errors
/// Where the transitions do not determine them.
pub fn fit(track: &Track, rest: [f64; 3], transitions: &[Transition]) -> Result<GyroFit, NoSolution> {
    let residuals = |p: &[f64]| -> Vec<f64> {
        let inverse = inverse_of(p);
        let of = |transition: &Transition| {
            let found = turned(track, rest, &inverse, transition);
            let [_, wanted] = transition.directions;
            [0, 1, 2].map(|axis| found[axis] - wanted[axis])
        };
        transitions.iter().flat_map(of).collect()
    };
    let found = solve(&[0.0; 9], residuals)?;
    // Two of the three components of a unit vector are free.
    #[expect(clippy::cast_precision_loss, reason = "transitions")]
    let degrees = (2 * transitions.len()).saturating_sub(9).max(1) as f64;
    let size = (found.chi_square / degrees).sqrt();
    let p = &found.parameters;
    // Residuals are differences of unit vectors: chords.
    let angle =
        found.residuals.chunks_exact(3).map(|r| 2.0 * libm::asin((0.5 * norm([r[0], r[1], r[2]])).min(1.0)));
    let angle = angle.collect();
    let mut sigma = [0.0; 9];
    sigma.iter_mut().enumerate().for_each(|(index, sigma)| *sigma = found.sigma(index) * size);
    Ok(GyroFit { weight: weights(p), rest, rows: rows(p), sigma, angle })
}

/// K of each gyro.
fn weights(p: &[f64]) -> [f64; 3] {
    [0, 1, 2].map(|i| 1.0 + p.get(i).copied().unwrap_or(0.0))
}

/// Input axes: each turned by two small angles from its case axis.
fn rows(p: &[f64]) -> [[f64; 3]; 3] {
    let angle = |i: usize| p.get(3 + i).copied().unwrap_or(0.0);
    let raw = [[1.0, angle(0), angle(1)], [angle(2), 1.0, angle(3)], [angle(4), angle(5), 1.0]];
    raw.map(|row| row.map(|c| c / norm(row)))
}

/// Rate about the case axes per output of each gyro.
fn inverse_of(p: &[f64]) -> Matrix3<f64> {
    let axes = Matrix3::from_fn(|i, j| rows(p)[i][j]);
    let scale = Matrix3::from_diagonal(&weights(p).into());
    axes.try_inverse().unwrap_or_else(Matrix3::identity) * scale
}

/// The direction before the transition, as the case sees it after the gyros' rotation.
fn turned(track: &Track, rest: [f64; 3], inverse: &Matrix3<f64>, transition: &Transition) -> [f64; 3] {
    let mut seen = Vector3::from(transition.directions[0]);
    for tick in transition.ticks[0]..transition.ticks[1] {
        let output = |gyro: usize| {
            let column = track.gyros.get(gyro).and_then(|column| column.get(tick));
            column.copied().unwrap_or(f64::NAN) - rest[gyro]
        };
        let duration = track.duration_s.get(tick).copied().unwrap_or(0.0);
        seen = crate::positions::matching::seen(
            inverse * Vector3::new(output(0), output(1), output(2)) * duration,
        ) * seen;
    }
    seen.into()
}

/// Angle (rad) between the direction that corrected rates predict after a transition and the one that corrected accelerometers
/// find there.
#[must_use]
pub fn angle_of(track: &Track, transition: &Transition) -> f64 {
    let mut seen = Vector3::from(transition.directions[0]);
    for tick in transition.ticks[0]..transition.ticks[1] {
        let rate = Vector3::from_fn(|axis, _| track.rate_deg_per_s[axis][tick].to_radians());
        seen = crate::positions::matching::seen(rate * track.duration_s[tick]) * seen;
    }
    seen.angle(&Vector3::from(transition.directions[1]))
}
