//! What a calibration states of its sensors' errors.

use alloc::vec::Vec;

use arrayvec::ArrayVec;
use nalgebra::Matrix4;
use serde::{Deserialize, Serialize};

use crate::calibration::{Calibration, CalibrationParts};

/// Most coefficients of a bias that have a standard error.
pub const MAX_BIAS_TERMS: usize = 4;

/// Standard errors of one sensor; `None`: not stated, hence unknown.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct SigmaParts {
    /// N: white noise (rad/√s or (m/s)/√s, ≥ 0).
    pub random_walk: Option<f64>,
    /// Q: standard deviation of the reading's integral by its quantisation (rad or m/s, ≥ 0). Counts have it of themselves: a
    /// count/√12.
    pub quantisation: Option<f64>,
    /// B: bias instability (rad/s or m/s², ≥ 0); 0 where there is none to speak of.
    pub instability: f64,
    /// K: rate random walk since turn-on (rad/s/√s or m/s²/√s, ≥ 0); likewise.
    pub rate_random_walk: f64,
    /// Bias over temperature.
    pub bias: Option<BiasSigma>,
    /// Scale factor (relative, ≥ 0).
    pub scale: Option<f64>,
    /// Direction of the input axis, per transverse axis (rad, ≥ 0).
    pub misalignment: Option<f64>,
    /// Bias per °C beyond the fitted range (rad/s or m/s², ≥ 0).
    pub clamping_per_deg_c: Option<f64>,
}

/// Standard error of a bias over temperature: that of `Σ c_j·(T − T_ref)^j`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct BiasSigma {
    /// `T_ref` (°C).
    pub reference_deg_c: f64,
    /// σ of c₀, c₁, … (rad/s or m/s², per °Cʲ).
    pub sigma: ArrayVec<f64, MAX_BIAS_TERMS>,
    /// Their correlations, row by row; none: independent.
    pub correlation: ArrayVec<[f64; MAX_BIAS_TERMS], MAX_BIAS_TERMS>,
}

impl BiasSigma {
    /// Variance of the bias at a temperature (°C).
    #[must_use]
    pub fn variance(&self, temperature_deg_c: f64) -> f64 {
        let away = temperature_deg_c - self.reference_deg_c;
        let mut power = 1.0;
        let mut shares = ArrayVec::<f64, MAX_BIAS_TERMS>::new();
        for sigma in &self.sigma {
            shares.push(sigma * power);
            power *= away;
        }
        let correlation = |i: usize, j: usize| {
            let stated = self.correlation.get(i).and_then(|row| row.get(j)).copied();
            stated.unwrap_or(if i == j { 1.0 } else { 0.0 })
        };
        let rows = shares.iter().enumerate();
        let products = rows.flat_map(|(i, a)| {
            let correlation = &correlation;
            shares.iter().enumerate().map(move |(j, b)| correlation(i, j) * a * b)
        });
        products.sum::<f64>().max(0.0)
    }

    /// Whether the correlations are those of a covariance: one in the diagonal, symmetric, and no combination of coefficients with a
    /// variance below zero.
    #[must_use]
    pub fn is_covariance(&self) -> bool {
        let (terms, rows) = (self.sigma.len(), &self.correlation);
        if rows.is_empty() {
            return true;
        }
        if rows.len() != terms {
            return false;
        }
        let symmetric = (0..terms).all(|i| (0..terms).all(|j| rows[i][j].to_bits() == rows[j][i].to_bits()));
        let unit = (0..terms).all(|i| (rows[i][i] - 1.0).abs() <= f64::EPSILON);
        if !symmetric || !unit {
            return false;
        }
        // With room for correlations of one.
        let matrix = Matrix4::from_fn(|i, j| rows.get(i).filter(|_| j < terms).map_or(0.0, |row| row[j]));
        matrix.iter().all(|share| share.abs() < 2.0) && matrix.symmetric_eigenvalues().min() >= -4e-9
    }
}

/// Standard errors of all sensors of a unit, which asks for σ of its outputs; a lane without them states nothing.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SigmaModel {
    pub(crate) gyros: Vec<SigmaParts>,
    pub(crate) accels: Vec<SigmaParts>,
}

impl SigmaModel {
    /// Those of the parts that a calibration was made from; `None` where no sensor states any, and none is asked for. A quantisation
    /// that is not stated is that of counts; without counts it is 0.
    pub(crate) fn of(parts: &CalibrationParts, calibration: &Calibration) -> Option<Self> {
        let (gyros, accels) =
            (parts.gyros.iter().map(|gyro| &gyro.sigma), parts.accels.iter().map(|accel| &accel.sigma));
        let filled = |(stated, count): (&Option<SigmaParts>, f64)| {
            let mut parts = stated.clone().unwrap_or_default();
            parts.quantisation.get_or_insert(count / libm::sqrt(12.0));
            parts
        };
        gyros.clone().chain(accels.clone()).any(Option::is_some).then(|| Self {
            gyros: gyros.zip(calibration.count_rad()).map(filled).collect(),
            accels: accels.zip(calibration.count_m_per_s()).map(filled).collect(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bias(sigma: &[f64], correlation: &[[f64; 4]]) -> BiasSigma {
        BiasSigma {
            reference_deg_c: 20.0,
            sigma: sigma.iter().copied().collect(),
            correlation: correlation.iter().copied().collect(),
        }
    }

    #[test]
    fn a_variance_follows_temperature_and_correlations() {
        let independent = bias(&[3.0, 0.5], &[]);
        assert!((independent.variance(28.0) - 25.0).abs() < 1e-12);
        let correlated = bias(&[3.0, 0.5], &[[1.0, -0.75, 0.0, 0.0], [-0.75, 1.0, 0.0, 0.0]]);
        assert!((correlated.variance(28.0) - 7.0).abs() < 1e-12 && correlated.is_covariance());
    }

    #[test]
    fn what_is_no_covariance_is_found() {
        let rows = |a: f64, b: f64, c: f64| {
            bias(&[1.0; 3], &[[1.0, a, b, 0.0], [a, 1.0, c, 0.0], [b, c, 1.0, 0.0]]).is_covariance()
        };
        assert!(rows(0.9, 0.8, 0.9) && rows(1.0, 1.0, 1.0));
        assert!(!rows(0.9, -0.9, 0.9) && !rows(1.1, 0.0, 0.0) && !rows(f64::NAN, 0.0, 0.0));
        assert!(!bias(&[1.0; 2], &[[1.0, 0.1, 0.0, 0.0], [0.2, 1.0, 0.0, 0.0]]).is_covariance());
        assert!(!bias(&[1.0; 2], &[[2.0, 0.1, 0.0, 0.0], [0.1, 1.0, 0.0, 0.0]]).is_covariance());
    }
}
