//! Gyros against accelerometers: between two poses the rotated direction of gravity must be the one that the accelerometers
//! find there (Tedaldi, Pretto and Menegatti 2014).

mod search;

use nalgebra::{Matrix3, Vector3};

use crate::axes::{across, others};
use crate::fits::positions::matching::seen;
use crate::fits::positions::track::Track;
use crate::lsq::nonlinear::{NoSolution, solve};
use crate::numbers::{Size, norm, real};

use search::Start;

/// Largest angle (°, rms) by which fitted gyros may miss the direction of gravity after a turn; half a degree is usual by hand.
pub const LARGEST_LEFT_DEG: f64 = 3.0;

/// What was found of the gyros.
#[derive(Debug, Clone, PartialEq)]
pub struct GyroFit {
    /// K: true rate per stated rate.
    pub weight: [f64; 3],
    /// Mean output at rest (rad/s of the log), which is taken off before the weight.
    pub rest: [f64; 3],
    /// Input axes, unit vectors in case axes.
    pub rows: [[f64; 3]; 3],
    /// Standard errors of the weights (as they are) and of the two angles of each axis (rad), along the case axes of
    /// [`GyroFit::across`].
    pub sigma: [f64; 9],
    /// Angle between the direction that the gyros predict and the one that the accelerometers find, by transition (rad).
    pub angle: Vec<f64>,
}

impl GyroFit {
    /// The two case axes that a gyro's input axis lies across, whichever way round it is: those that its angles are along.
    pub fn across(&self, gyro: usize) -> [usize; 2] {
        across(&self.rows[gyro])
    }

    /// Angle that is left after a turn (°, rms).
    pub fn left_deg(&self) -> f64 {
        Size::of(&self.angle).rms.to_degrees()
    }

    /// Whether the gyros follow the turns, and each lies along the case axis that its angles were counted from.
    fn follows(&self, start: &Start) -> bool {
        let placed = (0..3).all(|gyro| self.across(gyro) == others(start.along[gyro]));
        placed && self.left_deg() <= LARGEST_LEFT_DEG
    }
}

/// A transition: ticks between two poses, and the directions of specific force before and after.
#[derive(Debug, Clone, PartialEq)]
pub struct Transition {
    /// First tick and tick behind the last.
    pub ticks: [usize; 2],
    /// Unit vectors along the specific force, in case axes.
    pub directions: [[f64; 3]; 2],
}

/// Fits scale factors and axes of three gyros to transitions: first as if each lay along its own case axis and the log's unit of
/// measure were the right one. Where that does not follow the turns, other orders, signs and units of measure are tried.
///
/// # Errors
/// Where the transitions do not determine them.
pub fn fit(track: &Track, rest: [f64; 3], transitions: &[Transition]) -> Result<GyroFit, NoSolution> {
    let own = Start::default();
    let plain = from(track, rest, transitions, &own);
    if plain.as_ref().is_ok_and(|fit| fit.follows(&own)) {
        return plain;
    }
    let other = search::likely(track, rest, transitions).into_iter().find_map(|start| {
        let found = from(track, rest, transitions, &start).ok()?;
        found.follows(&start).then_some(found)
    });
    other.map_or(plain, Ok)
}

/// The fit from one start.
fn from(
    track: &Track,
    rest: [f64; 3],
    transitions: &[Transition],
    start: &Start,
) -> Result<GyroFit, NoSolution> {
    let residuals = |p: &[f64]| -> Vec<f64> {
        let inverse = start.inverse_of(p);
        let of = |transition: &Transition| {
            let found = turned(track, rest, &inverse, transition);
            let [_, wanted] = transition.directions;
            [0, 1, 2].map(|axis| found[axis] - wanted[axis])
        };
        transitions.iter().flat_map(of).collect()
    };
    let found = solve(&[0.0; 9], residuals)?;
    // Two of the three components of a unit vector are free.
    let degrees = real((2 * transitions.len()).saturating_sub(9).max(1));
    let size = (found.chi_square / degrees).sqrt();
    let p = &found.parameters;
    // Residuals are differences of unit vectors: chords.
    let angle =
        found.residuals.chunks_exact(3).map(|r| 2.0 * libm::asin((0.5 * norm([r[0], r[1], r[2]])).min(1.0)));
    let angle = angle.collect();
    let mut sigma = [0.0; 9];
    for (index, sigma) in sigma.iter_mut().enumerate() {
        let of_one = start.weight.get(index).map_or(1.0, |weight| weight.abs());
        *sigma = found.sigma(index) * size * of_one;
    }
    Ok(GyroFit { weight: start.weights(p), rest, rows: start.rows(p), sigma, angle })
}

/// The direction before a transition, as the case sees it after the gyros' rotation.
fn turned(track: &Track, rest: [f64; 3], inverse: &Matrix3<f64>, transition: &Transition) -> [f64; 3] {
    let output = |gyro: usize, tick: usize| {
        let column = track.gyros.get(gyro).and_then(|column| column.get(tick));
        column.copied().unwrap_or(f64::NAN) - rest[gyro]
    };
    let rate = |tick| inverse * Vector3::from_fn(|gyro, _| output(gyro, tick));
    seen_after(track, transition, rate).into()
}

/// Angle (rad) between the direction that corrected rates predict after a transition and the one that corrected accelerometers
/// find there.
pub fn angle_of(track: &Track, transition: &Transition) -> f64 {
    let rate = |tick: usize| Vector3::from_fn(|axis, _| track.rate_deg_per_s[axis][tick].to_radians());
    seen_after(track, transition, rate).angle(&Vector3::from(transition.directions[1]))
}

/// The direction before a transition in a case that turns with a rate (rad/s) by tick.
fn seen_after(track: &Track, transition: &Transition, rate: impl Fn(usize) -> Vector3<f64>) -> Vector3<f64> {
    let [first, end] = transition.ticks;
    let before = Vector3::from(transition.directions[0]);
    (first..end).fold(before, |before, tick| {
        let duration = track.duration_s.get(tick).copied().unwrap_or(0.0);
        seen(rate(tick) * duration) * before
    })
}
