//! Covariances of what goes out: the noise that a calibration document states, about the case axes.

use isotherm_correction::orientation::{Orientation, OrientationParts, SensorMask};
use isotherm_correction::sigma::Causes;
use isotherm_log::ros2::UNKNOWN;
use isotherm_protocol::document::Document;
use isotherm_protocol::status::DriftStatus;

use crate::mapping::UnitMapping;

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
        let parts = document.to_parts();
        let stated = parts.gyros.iter().map(|gyro| {
            let drift = gyro.drift.as_ref()?;
            let slow = square(drift.initial_sigma_rad_per_s) + square(drift.sigma_rad_per_s);
            Some((square(drift.angle_random_walk_rad_per_sqrt_s), slow))
        });
        let otherwise = mapping.gyro.random_walk().map(|walk| (square(walk), 0.0));
        let gyro: Option<Vec<_>> = stated.map(|stated| stated.or(otherwise)).collect();
        let accel = parts.accel_orientation.zip(mapping.accel.and_then(|accel| accel.random_walk()));
        Self {
            digest,
            gyro: gyro.and_then(|noise| Resolved::new(&parts.gyro_orientation, noise)),
            accel: accel.and_then(|(orientation, walk)| {
                Resolved::new(&orientation, vec![(square(walk), 0.0); orientation.rows.len()])
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

/// Covariance of a mean over a tick from what its batch says of its increments (rad or m/s); `None` where that is unknown.
#[must_use]
pub fn stated(increments: &Causes, duration_s: f64) -> Option<[f64; 9]> {
    let [x, y, z] = increments.variance().map(|variance| variance / (duration_s * duration_s));
    (x + y + z).is_finite().then_some([x, 0.0, 0.0, 0.0, y, 0.0, 0.0, 0.0, z])
}

impl Resolved {
    /// At the axes' reference temperature; `None` where they do not resolve, which no document in force has.
    fn new(orientation: &OrientationParts, noise: Vec<(f64, f64)>) -> Option<Self> {
        let compiled = Orientation::new(orientation).ok()?;
        let inverse = compiled.inverse(f64::NAN, SensorMask::all(compiled.sensors()))?;
        let columns = (0..compiled.sensors()).map(|sensor| inverse.column(sensor)).collect();
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
