//! Drift of the gyros with acceleration, from poses: what a gyro reads at rest is a bias, a linear function of the specific force
//! [IEEE 528] and the Earth's rate.
//!
//! The vertical part of the Earth's rate lies along the specific force, and looks like a drift with acceleration that is the same along
//! every axis: Ω·sin φ per g. It is taken off where the latitude is known. The horizontal part depends on headings that nobody knows.

use isotherm_correction::earth::EARTH_RATE;
use isotherm_correction::units::{AngularRate, STANDARD_GRAVITY_M_PER_S2};
use nalgebra::{DMatrix, DVector};

use super::gyro::GyroFit;
use crate::fits::positions::pose::Pose;
use crate::lsq::linear::{SINGULAR, Weak, solve};
use crate::numbers::{Size, about_mean, dot, norm, real, unit};
use crate::report::short;

/// Most that may be left of a gyro's scatter over the poses, in poses that the fit has not seen, by what there was.
const LARGEST_SHARE: f64 = 0.8;
/// Least drift by what of the Earth's rate is not known, which may pass for up to 1.2 times as much drift.
const BEYOND_EARTH: f64 = 2.0;
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

/// What one gyro reads at rest.
#[derive(Debug, Clone, PartialEq)]
pub struct AtRest {
    /// Readings by pose, without the vertical part of the Earth's rate where the latitude is known (rad/s of the log).
    pub readings: Vec<f64>,
    /// What of them follows acceleration, or why nothing is stated of it.
    pub drift: Result<GyroDrift, String>,
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

/// Up and unknown part of the Earth's rate (rad/s) at a latitude, or anywhere.
fn earth(latitude_deg: Option<f64>) -> [f64; 2] {
    let rate = EARTH_RATE.as_rad_per_s();
    latitude_deg.map_or([0.0, rate], |latitude| {
        let (sine, cosine) = libm::sincos(latitude.to_radians());
        [rate * sine, rate * cosine]
    })
}

/// Mean of something over poses, each as long as it lasted.
pub fn mean_over(poses: &[Pose], of: impl Fn(usize) -> f64) -> f64 {
    let weighted = poses.iter().enumerate().map(|(index, pose)| of(index) * pose.duration_s);
    weighted.sum::<f64>() / poses.iter().map(|pose| pose.duration_s).sum::<f64>()
}

/// Fits the readings of one gyro over the poses of `among`; `force` has the specific force of each pose. `None` where the poses do not tell.
pub fn fit(poses: &[Pose], force: &[[f64; 3]], readings: &[f64], among: &[usize]) -> Option<Response> {
    // A mean over twice the time has half the variance.
    let weight = |pose: usize| poses[pose].duration_s.sqrt();
    let row = |row: usize, column: usize| match column {
        0 => weight(among[row]),
        axis => weight(among[row]) * force[among[row]][axis - 1],
    };
    let design = DMatrix::from_fn(among.len(), COEFFICIENTS, row);
    let reading = |pose: &usize| readings[*pose] * weight(*pose);
    let readings = DVector::from_iterator(among.len(), among.iter().map(reading));
    let found = solve(&design, &readings, Weak::Refuse(SINGULAR)).ok()?;
    let c = &found.coefficients;
    let degrees = real(among.len().checked_sub(COEFFICIENTS).filter(|degrees| *degrees > 0)?);
    let deviation = (found.chi_square() / degrees).sqrt();
    let sigma = std::array::from_fn(|index| found.sigma(index) * deviation);
    Some(Response { bias: c[0], by_force: [c[1], c[2], c[3]], sigma })
}

/// Fits what is left of every gyro's readings without the Earth's rate, and judges each by poses that its fit has not seen: those of
/// `alike` are left out together with a pose.
pub fn judged(
    poses: &[Pose],
    force: &[[f64; 3]],
    gyros: &GyroFit,
    latitude_deg: Option<f64>,
    alike: impl Fn(usize, usize) -> bool,
) -> Vec<AtRest> {
    let [up, unknown] = earth(latitude_deg);
    let at_rest = |(gyro, (weight, row)): (usize, (&f64, &[f64; 3]))| {
        let of_earth = |force: &[f64; 3]| up * dot(*row, unit(*force)) / weight;
        let readings: Vec<f64> =
            poses.iter().zip(force).map(|(pose, force)| pose.gyro(gyro) - of_earth(force)).collect();
        let drift = beyond_scatter(poses, force, &readings, &alike).and_then(|drift| {
            let [size, least] = [
                weight.abs() * norm(drift.response.by_force) * STANDARD_GRAVITY_M_PER_S2,
                BEYOND_EARTH * unknown,
            ]
            .map(|rate| AngularRate::from_rad_per_s(rate).as_deg_per_h());
            if size >= least {
                return Ok(drift);
            }
            Err(format!(
                "{} (°/h)/g may be the Earth's rate, where {} unknown: at least {} are accepted{}",
                short(size),
                if latitude_deg.is_some() { "headings are" } else { "latitude and headings are" },
                short(least),
                if latitude_deg.is_some() { "" } else { "; state --latitude" },
            ))
        });
        AtRest { readings, drift }
    };
    gyros.weight.iter().zip(&gyros.rows).enumerate().map(at_rest).collect()
}

/// The drift of one gyro, where it explains readings that its fit has not seen.
fn beyond_scatter(
    poses: &[Pose],
    force: &[[f64; 3]],
    readings: &[f64],
    alike: impl Fn(usize, usize) -> bool,
) -> Result<GyroDrift, String> {
    let all: Vec<usize> = (0..poses.len()).collect();
    let response =
        fit(poses, force, readings, &all).ok_or("the poses do not span the directions of gravity")?;
    let left = all.iter().filter_map(|pose| {
        let others: Vec<usize> = all.iter().copied().filter(|other| !alike(*pose, *other)).collect();
        let fit = fit(poses, force, readings, &others)?;
        Some(readings[*pose] - fit.reading(force[*pose]))
    });
    let sizes = [Size::of(&about_mean(readings)), Size::of(&left.collect::<Vec<_>>())];
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
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;

    /// What is stated of gyro y of a unit with so much drift ((°/h)/g) along its own axis, put down with x to the north as far as it
    /// can be, in what direction ever.
    fn of(drift: f64, latitude_deg: Option<f64>) -> Result<f64, String> {
        const ROWS: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 0.8, 0.6], [0.0, 0.0, 1.0]];
        const WEIGHT: f64 = -1.3;
        let per_h = |rate: f64| AngularRate::from_deg_per_h(rate).as_rad_per_s();
        let [up, north] = earth(Some(55.75));
        let one = |k: u32| {
            let z = 1.0 - (2.0 * f64::from(k) + 1.0) / 40.0;
            let (sine, cosine) = libm::sincos(2.4 * f64::from(k));
            let u = [(1.0 - z * z).sqrt() * cosine, (1.0 - z * z).sqrt() * sine, z];
            let to_north = unit([1.0 - u[0] * u[0], -u[0] * u[1], -u[0] * u[2]]);
            let rate = up * dot(ROWS[1], u) + north * dot(ROWS[1], to_north);
            let reading = (rate + per_h(30.0) + per_h(drift) * dot(ROWS[1], u)) / WEIGHT;
            let pose = Pose {
                run: 0,
                ticks: 0..1,
                span_s: [0.0, 3.0],
                duration_s: 3.0,
                outputs: Vec::new(),
                gyros: vec![0.0, reading, 0.0],
                force_m_per_s2: [0.0; 3],
                temperature_deg_c: BTreeMap::new(),
            };
            (pose, u.map(|part| part * STANDARD_GRAVITY_M_PER_S2))
        };
        let (poses, force): (Vec<Pose>, Vec<[f64; 3]>) = (0..40).map(one).unzip();
        let gyros =
            GyroFit { weight: [WEIGHT; 3], rest: [0.0; 3], rows: ROWS, sigma: [0.0; 9], angle: Vec::new() };
        let [_, y, _] = judged(&poses, &force, &gyros, latitude_deg, |a, b| a == b).try_into().unwrap();
        let along =
            |drift: GyroDrift| WEIGHT * dot(ROWS[1], drift.response.by_force) * STANDARD_GRAVITY_M_PER_S2;
        y.drift.map(|drift| AngularRate::from_rad_per_s(along(drift)).as_deg_per_h())
    }

    #[test]
    fn the_earths_rate_is_no_drift_with_acceleration() {
        let known = [of(50.0, Some(55.75)), of(-200.0, Some(55.75))].map(Result::unwrap);
        assert!((known[0] - 50.0).abs() < 0.5 && (known[1] + 200.0).abs() < 0.5, "{known:?}");
        // Without the latitude what is vertical cannot be told from it.
        let with_earth = of(50.0, None).unwrap();
        assert!((with_earth - 50.0 - 15.04 * libm::sin(55.75_f64.to_radians())).abs() < 0.5, "{with_earth}");
        insta::assert_snapshot!(
            [of(0.0, Some(55.75)), of(14.0, Some(55.75)), of(0.0, None)].map(Result::unwrap_err).join("\n")
        );
    }
}
