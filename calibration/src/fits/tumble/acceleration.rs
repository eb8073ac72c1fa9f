//! Drift of the gyros with acceleration, from poses: what a gyro reads at rest is a bias and a linear function of the specific force
//! [IEEE 528].

use nalgebra::{DMatrix, DVector};

use crate::fits::positions::pose::Pose;
use crate::lsq::linear::{SINGULAR, Weak, solve};
use crate::numbers::{Size, real};
use crate::report::short;

/// Most that may be left of a gyro's scatter over the poses, in poses that the fit has not seen, by what there was.
const LARGEST_SHARE: f64 = 0.8;
/// Bias and three coefficients.
const COEFFICIENTS: usize = 4;

/// What a gyro reads at rest, as a linear function of the specific force.
#[derive(Debug, Clone, PartialEq)]
pub struct Response {
    /// Reading without specific force (rad/s of the log).
    pub bias: f64,
    /// Reading by specific force along the case axes (rad/s of the log per m/s²).
    pub by_force: [f64; 3],
    /// Standard errors of the four.
    pub sigma: [f64; COEFFICIENTS],
}

/// What was found of one gyro.
#[derive(Debug, Clone, PartialEq)]
pub struct GyroDrift {
    /// Its response.
    pub response: Response,
    /// Readings about their mean, and what is left of them in poses that the fit has not seen (rad/s of the log).
    pub sizes: [Size; 2],
}

impl Response {
    /// What the gyro reads at a specific force (m/s², in case axes).
    pub fn reading(&self, force: [f64; 3]) -> f64 {
        self.by_force.iter().zip(force).fold(self.bias, |sum, (coefficient, force)| sum + coefficient * force)
    }
}

/// Fits one gyro over the poses of `among`; `force` has the specific force of each pose. `None` where the poses do not tell.
pub fn fit(poses: &[Pose], force: &[[f64; 3]], gyro: usize, among: &[usize]) -> Option<Response> {
    // A mean over twice the time has half the variance.
    let weight = |pose: usize| poses[pose].duration_s.sqrt();
    let row = |row: usize, column: usize| match column {
        0 => weight(among[row]),
        axis => weight(among[row]) * force[among[row]][axis - 1],
    };
    let design = DMatrix::from_fn(among.len(), COEFFICIENTS, row);
    let reading = |pose: &usize| poses[*pose].gyro(gyro) * weight(*pose);
    let readings = DVector::from_iterator(among.len(), among.iter().map(reading));
    let found = solve(&design, &readings, Weak::Refuse(SINGULAR)).ok()?;
    let c = &found.coefficients;
    let degrees = real(among.len().checked_sub(COEFFICIENTS).filter(|degrees| *degrees > 0)?);
    let deviation = (found.chi_square() / degrees).sqrt();
    let sigma = std::array::from_fn(|index| found.sigma(index) * deviation);
    Some(Response { bias: c[0], by_force: [c[1], c[2], c[3]], sigma })
}

/// Fits every gyro, and judges each by poses that its fit has not seen: those of `alike` are left out together with a pose.
///
/// By gyro: what was found, or why nothing is stated of it.
pub fn judged(
    poses: &[Pose],
    force: &[[f64; 3]],
    alike: impl Fn(usize, usize) -> bool,
) -> [Result<GyroDrift, String>; 3] {
    let all: Vec<usize> = (0..poses.len()).collect();
    [0, 1, 2].map(|gyro| {
        let reading = |pose: usize| poses[pose].gyro(gyro);
        let response =
            fit(poses, force, gyro, &all).ok_or("the poses do not span the directions of gravity")?;
        let mean = Size::of(&all.iter().map(|pose| reading(*pose)).collect::<Vec<_>>()).mean;
        let about_mean: Vec<f64> = all.iter().map(|pose| reading(*pose) - mean).collect();
        let left = all.iter().filter_map(|pose| {
            let others: Vec<usize> = all.iter().copied().filter(|other| !alike(*pose, *other)).collect();
            let fit = fit(poses, force, gyro, &others)?;
            Some(reading(*pose) - fit.reading(force[*pose]))
        });
        let sizes = [Size::of(&about_mean), Size::of(&left.collect::<Vec<_>>())];
        let share = sizes[1].rms / sizes[0].rms;
        // Also where it is no number.
        if share.is_nan() || share > LARGEST_SHARE {
            return Err(format!(
                "in unseen poses {} % of the readings' scatter remain, at most {} % is accepted",
                short(100.0 * share),
                100.0 * LARGEST_SHARE
            ));
        }
        Ok(GyroDrift { response, sizes })
    })
}
