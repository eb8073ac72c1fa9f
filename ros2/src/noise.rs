//! Covariances of what goes out: the noise that a calibration document states, about the case axes.

use isotherm_log::ros2::UNKNOWN;
use isotherm_protocol::document::{Document, Orientation};
use isotherm_protocol::status::DriftStatus;
use nalgebra::{DMatrix, Matrix3, MatrixXx3};

use crate::mapping::UnitMapping;

/// °/h in rad/s.
const DEG_PER_H: f64 = std::f64::consts::PI / 180.0 / 3600.0;
/// °/√h in rad/√s.
const DEG_PER_SQRT_H: f64 = std::f64::consts::PI / 180.0 / 60.0;

/// Noise of a unit's corrected output under one calibration.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Noise {
    /// First bytes of the document's digest.
    pub digest: [u8; 8],
    gyro: Option<Resolved>,
    accel: Option<Resolved>,
}

/// Noise of all sensors of a kind, and where each goes.
#[derive(Debug, Clone, PartialEq)]
struct Resolved {
    /// Input axes → case axes: a column for each sensor.
    columns: Vec<[f64; 3]>,
    /// N² of each sensor.
    white: Vec<f64>,
    /// Variance of what changes slowly.
    slow: Vec<f64>,
}

impl Noise {
    /// As a document states it; where it does not, as the mapping does.
    #[must_use]
    pub fn of(document: &Document, digest: [u8; 8], mapping: &UnitMapping) -> Self {
        let square = |value: f64| value * value;
        let stated = document.gyro.sensor.iter().map(|gyro| {
            let drift = gyro.drift.as_ref()?;
            let slow = square(drift.initial_sigma_deg_per_h) + square(drift.sigma_deg_per_h);
            Some((square(drift.angle_random_walk_deg_per_sqrt_h * DEG_PER_SQRT_H), slow * square(DEG_PER_H)))
        });
        let otherwise = mapping.gyro.random_walk.map(|walk| (square(walk), 0.0));
        let gyro: Option<Vec<_>> = stated.map(|stated| stated.or(otherwise)).collect();
        let accel = document.accel.as_ref().zip(mapping.accel.and_then(|accel| accel.random_walk));
        Self {
            digest,
            gyro: gyro.and_then(|noise| Resolved::new(&document.gyro.orientation, noise)),
            accel: accel.and_then(|(accel, walk)| {
                Resolved::new(&accel.orientation, vec![(square(walk), 0.0); accel.sensor.len()])
            }),
        }
    }

    /// Takes over what the drift estimator knows: its σ, and the drift itself where the output still has it.
    pub fn update(&mut self, drift: &[DriftStatus]) {
        let Some(gyro) = self.gyro.as_mut().filter(|gyro| gyro.slow.len() == drift.len()) else { return };
        for (slow, drift) in gyro.slow.iter_mut().zip(drift) {
            let left = if drift.subtracted { 0.0 } else { drift.rate_rad_per_s };
            *slow = drift.sigma_rad_per_s * drift.sigma_rad_per_s + left * left;
        }
    }

    /// Covariance of the mean rate over a tick ((rad/s)²), row by row; zeros where it is unknown.
    #[must_use]
    pub fn rate(&self, duration_s: f64) -> [f64; 9] {
        self.gyro.as_ref().map_or(UNKNOWN, |gyro| gyro.covariance(duration_s))
    }

    /// Covariance of the mean specific force over a tick ((m/s²)²), likewise.
    #[must_use]
    pub fn force(&self, duration_s: f64) -> [f64; 9] {
        self.accel.as_ref().map_or(UNKNOWN, |accel| accel.covariance(duration_s))
    }
}

impl Resolved {
    /// `None` where the axes do not resolve, which no document in force has.
    fn new<P>(orientation: &Orientation<P>, noise: Vec<(f64, f64)>) -> Option<Self> {
        let rows = &orientation.rows;
        let axes = MatrixXx3::from_fn(rows.len(), |row, column| {
            rows.get(row).and_then(|axis| axis.get(column)).copied().unwrap_or_default()
        });
        let weights = DMatrix::from_fn(rows.len(), rows.len(), |row, column| {
            let weight = orientation.weights.as_ref().and_then(|weights| weights.get(row)).copied();
            if row == column { weight.unwrap_or(1.0) } else { 0.0 }
        });
        let normal: Matrix3<f64> = axes.transpose() * &weights * &axes;
        let inverse = normal.try_inverse()? * axes.transpose() * weights;
        let columns = inverse.column_iter().map(|column| [column.x, column.y, column.z]).collect();
        let (white, slow) = noise.into_iter().unzip();
        Some(Self { columns, white, slow })
    }

    fn covariance(&self, duration_s: f64) -> [f64; 9] {
        let mut sum = [0.0; 9];
        for ((column, white), slow) in self.columns.iter().zip(&self.white).zip(&self.slow) {
            let variance = white / duration_s + slow;
            let products = column.iter().flat_map(|row| column.iter().map(move |other| row * other));
            sum.iter_mut().zip(products).for_each(|(sum, product)| *sum += variance * product);
        }
        sum
    }
}

#[cfg(test)]
mod tests;
