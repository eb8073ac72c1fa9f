//! What accelerometers put out on a stand, as a function of what is to be found.
//!
//! ```text
//! U_i = K_i(T_i)·(C_i(T)·u)·g/r + S_i(T_i),     C_i(T) = n_i + a_i(T)·t_i + b_i(T)·w_i
//! ```
//!
//! n is a sensor's first guess, t and w are at right angles to it. K, S, a and b are polynomials of temperature. This is the form
//! that the service evaluates (`Guess::found` only moves the length of C's row into K), so that nothing is lost between the
//! fit and the document.

use crate::lsq::linear::{self, SINGULAR, Weak};
use crate::numbers::norm;

/// Least spread of the directions that a first guess is made of: smallest over largest singular value.
const LEAST_SPREAD: f64 = 0.05;

/// A position as it was taken.
#[derive(Debug, Clone, PartialEq)]
pub struct Taken {
    /// Position of the plan.
    pub position: usize,
    /// Mean output of each accelerometer.
    pub outputs: Vec<f64>,
    /// Ratio r of the board for each accelerometer.
    pub ratio: Vec<f64>,
    /// Time of the means (s).
    pub duration_s: f64,
    /// Temperature of each accelerometer less the reference, over half the range.
    pub sensor_t: Vec<f64>,
    /// Temperature that the orientation follows, likewise.
    pub axes_t: f64,
    /// Which of the temperatures it was taken at.
    pub level: usize,
}

/// Degrees of the polynomials over temperature.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Degrees {
    /// Of K and S.
    pub sensor: usize,
    /// Of C.
    pub axes: usize,
}

impl Degrees {
    /// Of what was taken at one temperature.
    pub const NONE: Self = Self { sensor: 0, axes: 0 };

    /// Parameters of one accelerometer: K, S, and two angles of its axis.
    pub fn of_sensor(self) -> usize {
        2 * (self.sensor + 1) + 2 * (self.axes + 1)
    }

    /// Place of a parameter of an accelerometer's axis: `which` of the two directions, power.
    pub fn axis_index(self, sensor: usize, which: usize, power: usize) -> usize {
        sensor * self.of_sensor() + 2 * (self.sensor + 1) + which * (self.axes + 1) + power
    }

    /// The places of both directions of every accelerometer's axis.
    pub fn axes_indices(self, sensors: usize, power: usize) -> Vec<usize> {
        let both = |sensor| [0, 1].map(|which| self.axis_index(sensor, which, power));
        (0..sensors).flat_map(both).collect()
    }
}

/// First guess of one accelerometer.
#[derive(Debug, Clone, PartialEq)]
pub struct Guess {
    /// K·g (output units).
    pub scale: f64,
    /// S (output units).
    pub bias: f64,
    /// Axis, unit vector.
    pub axis: [f64; 3],
    /// Two unit vectors at right angles to it and to each other.
    pub across: [[f64; 3]; 2],
}

/// One accelerometer as it was found, by powers of the scaled temperature.
#[derive(Debug, Clone, PartialEq)]
pub struct Sensor {
    /// K·g.
    pub scale: Vec<f64>,
    /// S.
    pub bias: Vec<f64>,
    /// C, row by power.
    pub axis: Vec<[f64; 3]>,
}

impl Guess {
    /// From the outputs by linear least squares: U = M·u + S, K·g the length of M.
    pub fn of(ups: &[[f64; 3]], outputs: &[f64]) -> Option<Self> {
        let entry = |row: usize, column: usize| ups[row].get(column).copied().unwrap_or(1.0);
        let design = nalgebra::DMatrix::from_fn(ups.len(), 4, entry);
        let spread = linear::spread(&design);
        if ups.len() < 4 || spread.is_nan() || spread < LEAST_SPREAD {
            return None;
        }
        let outputs = nalgebra::DVector::from_column_slice(outputs);
        let found = linear::solve(&design, &outputs, Weak::Refuse(SINGULAR)).ok()?.coefficients;
        let scale = found.fixed_rows::<3>(0).norm();
        if !(scale.is_finite() && scale > 0.0) {
            return None;
        }
        let axis = [0, 1, 2].map(|i| found[i] / scale);
        Some(Self { scale, bias: found[3], axis, across: across(axis) })
    }

    /// Output under a direction of "up", at the scaled temperatures of the accelerometer and of its axis, with the ratio of its board.
    pub(super) fn output(
        &self,
        (degrees, p): (Degrees, &[f64]),
        [own_t, axes_t]: [f64; 2],
        ratio: f64,
        up: [f64; 3],
    ) -> f64 {
        let (own, axes) = (degrees.sensor + 1, degrees.axes + 1);
        let at = |from: usize, count: usize, x: f64| {
            p[from..from + count].iter().rev().fold(0.0, |sum, coefficient| sum * x + coefficient)
        };
        let scale = self.scale * (1.0 + at(0, own, own_t) * SMALL);
        let bias = self.bias + self.scale * at(own, own, own_t) * SMALL;
        let (a, b) = (at(2 * own, axes, axes_t) * SMALL, at(2 * own + axes, axes, axes_t) * SMALL);
        let [first, second] = self.across;
        let along: f64 = (0..3).map(|i| (self.axis[i] + a * first[i] + b * second[i]) * up[i]).sum();
        scale * along / ratio + bias
    }

    /// What the parameters say of the accelerometer, its row of C at the reference of length one.
    pub(super) fn found(&self, (degrees, p): (Degrees, &[f64])) -> Sensor {
        let (own, axes) = (degrees.sensor + 1, degrees.axes + 1);
        let one = |power: usize| if power == 0 { 1.0 } else { 0.0 };
        let [first, second] = self.across;
        let row = |power: usize| {
            let (a, b) = (p[2 * own + power] * SMALL, p[2 * own + axes + power] * SMALL);
            [0, 1, 2].map(|i| one(power) * self.axis[i] + a * first[i] + b * second[i])
        };
        let rows: Vec<[f64; 3]> = (0..axes).map(row).collect();
        let length = norm(rows[0]);
        Sensor {
            scale: (0..own).map(|j| self.scale * (one(j) + p[j] * SMALL) * length).collect(),
            bias: (0..own).map(|j| one(j) * self.bias + self.scale * p[own + j] * SMALL).collect(),
            axis: rows.iter().map(|row| row.map(|x| x / length)).collect(),
        }
    }
}

/// Two unit vectors at right angles to a unit vector, the first near the case axis that is farthest from it.
pub fn across(n: [f64; 3]) -> [[f64; 3]; 2] {
    let n = nalgebra::Vector3::from(n);
    let mut unit = nalgebra::Vector3::zeros();
    unit[n.iamin()] = 1.0;
    let first = (unit - n * n.dot(&unit)).normalize();
    [first.into(), n.cross(&first).into()]
}

/// Unit of the parameters: a thousandth of K, of K·g, of a radian.
pub const SMALL: f64 = 1e-3;
