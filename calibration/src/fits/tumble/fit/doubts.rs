//! What makes the result of a fit none, or doubtful.

use isotherm_correction::orientation::CONDITION_LIMIT;
use nalgebra::{DMatrix, DVector, Matrix3};

use super::{AccelFit, GyroFit};
use crate::axes::AXES;
use crate::fits::positions::pose::{Pose, intensities};
use crate::fits::positions::track::Track;
use crate::fits::tumble::accel::ANGLES;
use crate::fits::tumble::gyro::LARGEST_LEFT_DEG;
use crate::lsq::linear::{self, SINGULAR, Weak};
use crate::lsq::nonlinear::NoSolution;
use crate::numbers::{Size, real};
use crate::report::short;

/// Largest standard error of a scale factor that is still a result (relative).
const LARGEST_SIGMA: f64 = 0.01;
/// Largest standard error of an angle between two accelerometers that is still a result (°).
const LARGEST_ANGLE_SIGMA_DEG: f64 = 0.5;
/// Share of a log at its end that has a pose.
const LAST_SHARE: f64 = 1.0 / 3.0;

/// Times that what is left of |f| − g may be larger than the noise of the means. A unit put down by hand is not quite still, and
/// its accelerometers are not quite straight.
const LARGEST_BEYOND_NOISE: f64 = 20.0;
/// What is little, whatever the noise (a share of g).
const LITTLE: f64 = 5e-4;
/// Share of the variance of what is left that follows the time where something drifts.
const FOLLOWS_TIME: f64 = 0.6;

/// What to look at where the gyros do not follow the turns.
pub(super) const WRONG_GYROS: &str = "check the unit of measure of the gyros in the mapping (57.3 times too much is \
    °/s read as rad/s), the order and the signs of the columns, of the accelerometers too, gyros at their limit in \
    the turns, and the time stamps";

/// A fit of the accelerometers without a solution, in words.
pub(super) fn no_accelerometers(why: &NoSolution) -> String {
    let name = |index: usize| match index / 3 {
        0 => format!("the scale factor of {}", AXES[index]),
        1 => format!("the bias of {}", AXES[index - 3]),
        _ => format!("the angle between {}", ["x and y", "x and z", "y and z"][index - 6]),
    };
    why.words(
        "the poses",
        name,
        "put the unit down in more different ways",
        "no scale factors, biases and angles make |f| = g in all poses: check every column of the mapping, and that \
         the unit of measure is the same throughout. Put the unit on edges and corners too, not only on its faces",
    )
}

/// A fit of the gyros without a solution, in words.
pub(super) fn no_gyros(why: &NoSolution) -> String {
    why.words(
        "the turns",
        |index| format!("gyro {}", AXES[gyro_of(index)]),
        "turn the unit about each of its axes",
        &format!("no scale factors and axes make the gyros follow the turns: {WRONG_GYROS}"),
    )
}

/// The gyro that a parameter is of: three weights, then two angles of each.
fn gyro_of(parameter: usize) -> usize {
    if parameter < 3 { parameter } else { (parameter - 3) / 2 % 3 }
}

/// Whether what was found of the accelerometers is a result.
pub(super) fn sound(poses: &[Pose], fit: &AccelFit) -> Result<(), Vec<String>> {
    let mut reasons = Vec::new();
    for (axis, name) in AXES.iter().enumerate() {
        if !(fit.sigma[axis] <= LARGEST_SIGMA && fit.scale[axis].is_finite()) {
            reasons.push(format!(
                "accelerometer {name}: its scale factor is known only to {:.1} %, at most {} % is accepted: {} poses \
                 do not spread enough, put it down with {name} up and down",
                fit.sigma[axis] * 100.0,
                LARGEST_SIGMA * 100.0,
                poses.len()
            ));
        }
    }
    for (index, [one, other]) in ANGLES.into_iter().enumerate() {
        let sigma = fit.sigma[6 + index].to_degrees();
        if sigma.is_nan() || sigma > LARGEST_ANGLE_SIGMA_DEG {
            reasons.push(format!(
                "the angle between accelerometers {} and {} is known only to {sigma:.1}°, at most \
                 {LARGEST_ANGLE_SIGMA_DEG}° is accepted: {} poses do not determine it; put the unit on edges and \
                 corners too, not only on its faces",
                AXES[one],
                AXES[other],
                poses.len()
            ));
        }
    }
    if flat(&fit.rows) {
        reasons.push(
            "the axes of the accelerometers lie in one plane, or nearly so: does the mapping have a column twice?".to_owned(),
        );
    }
    if reasons.is_empty() { Ok(()) } else { Err(reasons) }
}

/// Words where far more is left of |f| − g than the noise explains.
pub(super) fn beyond_noise(track: &Track, poses: &[Pose], fit: &AccelFit) -> Option<String> {
    let intensity = intensities(std::slice::from_ref(track), poses);
    let gravity = fit.gravity;
    let along = |pose: &Pose| [0, 1, 2].map(|i| (pose.outputs[i] - fit.bias[i]) / (fit.scale[i] * gravity));
    let variance = |pose: &Pose| -> f64 {
        let of = |(i, along): (usize, f64)| (along / fit.scale[i]).powi(2) * intensity[i];
        along(pose).into_iter().enumerate().map(of).sum::<f64>() / pose.duration_s
    };
    let noise = (poses.iter().map(variance).sum::<f64>() / real(poses.len())).sqrt();
    let left = Size::of(&fit.residual).rms;
    if noise.is_nan() || left <= (LARGEST_BEYOND_NOISE * noise).max(LITTLE * gravity) {
        return None;
    }
    let share = follows_time(poses, fit, along);
    let why = if share > FOLLOWS_TIME {
        format!(
            "{:.0} % of its variance follows the time since the log's beginning: zeros or scale factors moved. Let \
             the unit warm up before the still start, keep its temperature, and check for a change of the unit of \
             measure within the log",
            100.0 * share
        )
    } else {
        "was it moved or touched in poses, do scale factors depend on direction, or does the unit of measure change \
         within the log? The table has |f| − g pose by pose"
            .to_owned()
    };
    Some(format!(
        "the fit leaves {} m/s² rms of |f| − g, {} times the noise of the poses ({} m/s²): {why}",
        short(left),
        short(left / noise),
        short(noise)
    ))
}

/// Share of the variance of what is left that zeros and a common scale factor explain that go straight with the time; zero where the
/// poses are too few to tell.
///
/// Beside them stand the directions that the fit itself has taken what it could along: zeros, scale factors, angles.
fn follows_time(poses: &[Pose], fit: &AccelFit, along: impl Fn(&Pose) -> [f64; 3]) -> f64 {
    const OWN: usize = 9;
    const WITH_TIME: usize = 4;
    if poses.len() < 2 * OWN {
        return 0.0;
    }
    let times: Vec<f64> = poses.iter().map(Pose::middle_s).collect();
    let [middle, half] = [Size::of(&times).mean, 0.5 * Size::of(&times).peak_to_peak];
    let row = |pose: usize| -> [f64; OWN + WITH_TIME] {
        let ([x, y, z], time) = (along(&poses[pose]), (times[pose] - middle) / half);
        [x, y, z, x * x, y * y, z * z, x * y, x * z, y * z, x * time, y * time, z * time, time]
    };
    let design = DMatrix::from_fn(poses.len(), OWN + WITH_TIME, |pose, column| row(pose)[column]);
    let left = DVector::from_column_slice(&fit.residual);
    let per_degree = |squares: f64, taken: usize| squares / real(poses.len() - taken);
    linear::solve(&design, &left, Weak::Refuse(SINGULAR)).map_or(0.0, |found| {
        let more = per_degree(found.chi_square(), OWN + WITH_TIME);
        1.0 - more / per_degree(left.norm_squared(), OWN)
    })
}

/// Words where the poses end long before the log does.
pub(super) fn ends_early(track: &Track, poses: &[Pose]) -> Option<String> {
    let length = track.start_s(track.len().checked_sub(1)?);
    let [_, last] = poses.last()?.span_s;
    (last < (1.0 - LAST_SHARE) * length).then(|| {
        format!(
            "no still pose is found after {last:.0} s of {length:.0} s: the rest is left out. Was the unit moved \
             without a rest, or is the noise larger there than in the still start (another unit of measure, a \
             motor, a loose cable)? State a larger --threshold, or cut the log with --duration"
        )
    })
}

/// Words where fitted gyros do not follow the turns.
pub(super) fn lost(fit: &GyroFit) -> Option<String> {
    let left = fit.left_deg();
    if left.is_nan() || left > LARGEST_LEFT_DEG {
        return Some(format!(
            "after a turn they still miss the direction of gravity by {left:.1}° rms, at most {LARGEST_LEFT_DEG}° is \
             accepted: {WRONG_GYROS}"
        ));
    }
    flat(&fit.rows).then(|| format!("their axes lie in one plane, or nearly so: {WRONG_GYROS}"))
}

/// Whether three axes lie so near one plane that no document may state them.
fn flat(rows: &[[f64; 3]; 3]) -> bool {
    let values = Matrix3::from_fn(|i, j| rows[i][j]).singular_values();
    let condition = values.max() / values.min();
    condition.is_nan() || condition > CONDITION_LIMIT
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_not_found_is_said_in_plain_words() {
        let patience = NoSolution::NoMinimum;
        // What no document may state is refused before it is written, without the numbers of a matrix.
        let straight = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let of =
            |rows| GyroFit { weight: [1.0; 3], rest: [0.0; 3], rows, sigma: [0.0; 9], angle: vec![0.01; 8] };
        assert_eq!(lost(&of(straight)), None);
        let told = [
            no_accelerometers(&patience),
            no_gyros(&patience),
            no_gyros(&NoSolution::NotDetermined(8)),
            lost(&of([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.8, 0.6, 1e-5]])).unwrap(),
        ];
        insta::assert_snapshot!(told.join("\n"));
    }
}
