//! Accelerometers from |f| = g: scale factors, biases and the angles between the axes from poses whose attitude nobody knows
//! (Tedaldi, Pretto and Menegatti 2014).
//!
//! ```text
//! f = C⁻¹·((U − S)/K),    |f| = g
//! ```
//!
//! A rotation of all axes together changes no |f|: the case axes are *defined* by the sensors. z is the input axis of the third
//! accelerometer, y lies in the plane of the second and third.

use nalgebra::{DMatrix, DVector};

use crate::lsq::linear::{self, SINGULAR, Weak};
use crate::lsq::nonlinear::{NoSolution, Solution, solve};
use crate::numbers::{ends, norm, real, unit};

/// Accelerometers of a unit without a stand.
pub const SENSORS: usize = 3;
/// Sensor and case axis of each angle between input axes; the others are zero by definition.
pub const ANGLES: [[usize; 2]; 3] = [[0, 1], [0, 2], [1, 2]];

/// What was found of the accelerometers.
#[derive(Debug, Clone, PartialEq)]
pub struct AccelFit {
    /// Gravity that it is relative to (m/s²).
    pub gravity: f64,
    /// K: output per specific force (output units per m/s²).
    pub scale: [f64; 3],
    /// S: output at no specific force (output units).
    pub bias: [f64; 3],
    /// C: input axes, unit vectors in case axes.
    pub rows: [[f64; 3]; 3],
    /// Standard errors of scale (relative), bias (output units) and the three angles (rad), from the scatter of |f| − g.
    pub sigma: [f64; 9],
    /// |f| − g by pose (m/s²).
    pub residual: Vec<f64>,
    /// Covariance of the nine parameters: K relative, S/(K·g), angles (rad).
    pub covariance: DMatrix<f64>,
}

impl AccelFit {
    /// Specific force along the case axes (m/s²) that three outputs stand for.
    pub fn force(&self, outputs: &[f64]) -> [f64; 3] {
        let output = |index: usize| outputs.get(index).copied().unwrap_or(f64::NAN);
        let along = [0, 1, 2].map(|index| (output(index) - self.bias[index]) / self.scale[index]);
        resolve(&self.rows, along)
    }
}

/// v of `rows`·v = s where the rows are those that [`rows_of`] makes: upper triangular.
fn resolve(rows: &[[f64; 3]; 3], s: [f64; 3]) -> [f64; 3] {
    let z = s[2] / rows[2][2];
    let y = (s[1] - rows[1][2] * z) / rows[1][1];
    let x = (s[0] - rows[0][1] * y - rows[0][2] * z) / rows[0][0];
    [x, y, z]
}

/// Input axes from the three angles.
fn rows_of(angles: [f64; 3]) -> [[f64; 3]; 3] {
    [unit([1.0, angles[0], angles[1]]), unit([0.0, 1.0, angles[2]]), [0.0, 0.0, 1.0]]
}

/// Fits mean outputs of poses, three numbers each.
///
/// # Errors
/// Where the poses do not determine the nine parameters.
pub fn fit(poses: &[Vec<f64>], gravity: f64) -> Result<AccelFit, NoSolution> {
    let start = ellipsoid(poses, gravity)?;
    let of = |p: &[f64]| AccelFit {
        gravity,
        scale: [0, 1, 2].map(|i| start.0[i] * (1.0 + p[i])),
        bias: [0, 1, 2].map(|i| start.1[i] + p[3 + i] * start.0[i] * gravity),
        rows: rows_of([p[6], p[7], p[8]]),
        sigma: [0.0; 9],
        residual: Vec::new(),
        covariance: DMatrix::zeros(0, 0),
    };
    let residuals = |p: &[f64]| -> Vec<f64> {
        let fit = of(p);
        poses.iter().map(|outputs| norm(fit.force(outputs)) / gravity - 1.0).collect()
    };
    let Solution { parameters, covariance, residuals, chi_square, degrees } = solve(&[0.0; 9], residuals)?;
    let variance = chi_square / real(degrees.max(1));
    let covariance = covariance * variance;
    let mut fit = of(&parameters);
    for (index, sigma) in fit.sigma.iter_mut().enumerate() {
        let factor = if (3..6).contains(&index) { fit.scale[index - 3] * gravity } else { 1.0 };
        *sigma = covariance[(index, index)].max(0.0).sqrt() * factor;
    }
    fit.residual = residuals.iter().map(|residual| residual * gravity).collect();
    fit.covariance = covariance;
    Ok(fit)
}

/// Scale factors and biases of axes at right angles: Σ aᵢ·Uᵢ² + bᵢ·Uᵢ = 1 by linear least squares, on outputs that are centred
/// and brought to the size of one.
fn ellipsoid(poses: &[Vec<f64>], gravity: f64) -> Result<([f64; 3], [f64; 3]), NoSolution> {
    let column = |i: usize| poses.iter().map(move |pose| pose.get(i).copied().unwrap_or(f64::NAN));
    let ends = [0, 1, 2].map(|i| ends(column(i)));
    let centre = ends.map(|[low, high]| 0.5 * (low + high));
    let half = ends.map(|[low, high]| 0.5 * (high - low));
    if let Some(index) = half.iter().position(|half| half.is_nan() || *half <= 0.0) {
        return Err(NoSolution::NotDetermined(index));
    }
    let design = DMatrix::from_fn(poses.len(), 6, |pose, term| {
        let i = term % 3;
        let value = (poses[pose].get(i).copied().unwrap_or(f64::NAN) - centre[i]) / half[i];
        if term < 3 { value * value } else { value }
    });
    let found = linear::solve(&design, &DVector::repeat(poses.len(), 1.0), Weak::Refuse(SINGULAR));
    // Without terms the search starts from the range, as below.
    let terms = found.map_or_else(|_| DVector::repeat(6, f64::NAN), |found| found.coefficients);
    let middle = [0, 1, 2].map(|i| -0.5 * terms[3 + i] / terms[i]);
    let level = 1.0 + (0..3).map(|i| terms[i] * middle[i] * middle[i]).sum::<f64>();
    let scale = [0, 1, 2].map(|i| libm::sqrt(level / terms[i]) * half[i] / gravity);
    // Poses on one side of a sphere may give another shape; the search then starts from the range.
    let usable = (0..3).all(|i| scale[i].is_finite() && middle[i].abs() < 3.0);
    Ok(if usable {
        (scale, [0, 1, 2].map(|i| centre[i] + middle[i] * half[i]))
    } else {
        (half.map(|half| half / gravity), centre)
    })
}
