//! What makes the result of a fit none, or doubtful.

use isotherm_correction::orientation::CONDITION_LIMIT;
use isotherm_protocol::document::Document;
use nalgebra::{Matrix3, Vector3};

use super::{AXES, AccelFit, Tumble};
use crate::means::Size;
use crate::positions::doubts::LARGEST_TURN_DEG;
use crate::positions::faults;
use crate::positions::pose::Pose;
use crate::positions::solve::NoSolution;
use crate::positions::track::Track;

/// Largest standard error of a scale factor that is still a result (relative).
const LARGEST_SIGMA: f64 = 0.01;
/// Largest standard error of an angle between two accelerometers that is still a result (°).
const LARGEST_ANGLE_SIGMA_DEG: f64 = 0.5;
/// Share of a log at its end that has a pose.
const LAST_SHARE: f64 = 1.0 / 3.0;
/// Largest angle (°, rms) by which fitted gyros may miss the direction of gravity after a turn; half a degree is usual by hand.
const LARGEST_LEFT_DEG: f64 = 3.0;
/// An angle (°) to the stated axis that is a sign, and no other axis.
const OTHER_SIGN_DEG: f64 = 150.0;
/// Times that one sensor's K may have changed more than another's; a unit of measure is more.
const LARGEST_RATIO: f64 = 3.0;

/// What to look at where the gyros do not follow the turns.
pub(super) const WRONG_GYROS: &str = "look at the unit of measure of the gyros in the mapping (57.3 times too much is °/s read as rad/s), at the order and the signs \
     of the columns, of the accelerometers too, at gyros at their limit in the turns, and at the time stamps";

/// A fit of the accelerometers without a solution, in words.
pub(super) fn no_accelerometers(why: &NoSolution) -> String {
    const NAMES: [&str; 9] = [
        "scale factor of x",
        "scale factor of y",
        "scale factor of z",
        "bias of x",
        "bias of y",
        "bias of z",
        "angle between x and y",
        "angle between x and z",
        "angle between y and z",
    ];
    match why {
        NoSolution::NotDetermined(index) => format!(
            "the poses do not determine the {}: put the unit down in more different ways",
            NAMES.get(*index).copied().unwrap_or("parameters")
        ),
        // The library's words are about its search.
        NoSolution::NoMinimum(_) => {
            "no scale factors, biases and angles were found with which |f| is g in all poses: is every column of the mapping the right \
             one, in one unit of measure throughout? A unit that was put on its faces only needs edges and corners too"
                .to_owned()
        }
    }
}

/// A fit of the gyros without a solution, in words.
pub(super) fn no_gyros(why: &NoSolution) -> String {
    match why {
        NoSolution::NotDetermined(index) => {
            format!(
                "the turns do not determine gyro {}: turn the unit about each of its axes",
                AXES[gyro_of(*index)]
            )
        }
        NoSolution::NoMinimum(_) => {
            format!(
                "no scale factors and axes were found with which the gyros follow the turns: {WRONG_GYROS}"
            )
        }
    }
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
                "accelerometer {name}: its scale factor is known to {:.1} % only, at most {} % is a result: {} poses do not spread \
                 enough, put it down with {name} up and down",
                fit.sigma[axis] * 100.0,
                LARGEST_SIGMA * 100.0,
                poses.len()
            ));
        }
    }
    for (index, (one, other)) in [(0, 1), (0, 2), (1, 2)].into_iter().enumerate() {
        let sigma = fit.sigma[6 + index].to_degrees();
        if sigma.is_nan() || sigma > LARGEST_ANGLE_SIGMA_DEG {
            reasons.push(format!(
                "the angle between accelerometers {} and {} is known to {sigma:.1}° only, at most {LARGEST_ANGLE_SIGMA_DEG}° is a \
                 result: {} poses do not tell it; put the unit on edges and corners too, not on its faces only",
                AXES[one],
                AXES[other],
                poses.len()
            ));
        }
    }
    if flat(&fit.rows) {
        reasons.push(
            "the axes of the accelerometers are found in one plane, or nearly so: does the mapping have a column twice?".to_owned(),
        );
    }
    if reasons.is_empty() { Ok(()) } else { Err(reasons) }
}

/// Words where the poses end long before the log does.
pub(super) fn ends_early(track: &Track, poses: &[Pose]) -> Option<String> {
    let length = track.start_s(track.len().checked_sub(1)?);
    let [_, last] = poses.last()?.span_s;
    (last < (1.0 - LAST_SHARE) * length).then(|| {
        format!(
            "no still pose is found after {last:.0} s of {length:.0} s: all that follows is left out. Was the unit moved without a rest, \
             or is the noise larger there than in the still start (another unit of measure from some row on, a motor, a loose cable)? \
             State a larger --threshold, or cut the log with --duration"
        )
    })
}

/// Words where fitted gyros do not follow the turns: `angle` (rad) is left after each.
pub(super) fn lost(angle: &[f64], rows: &[[f64; 3]; 3]) -> Option<String> {
    let left = Size::of(angle).rms.to_degrees();
    if left.is_nan() || left > LARGEST_LEFT_DEG {
        return Some(format!(
            "after a turn they still miss the direction of gravity by {left:.1}° rms, at most {LARGEST_LEFT_DEG}° is a result: \
             {WRONG_GYROS}"
        ));
    }
    flat(rows).then(|| format!("their axes are found in one plane, or nearly so: {WRONG_GYROS}"))
}

/// Whether three axes lie so near one plane that no document may state them.
fn flat(rows: &[[f64; 3]; 3]) -> bool {
    let values = Matrix3::from_fn(|i, j| rows[i][j]).singular_values();
    let condition = values.max() / values.min();
    condition.is_nan() || condition > CONDITION_LIMIT
}

/// One sensor beside what the document at hand states of it.
struct Beside {
    name: String,
    /// K, and K relative to the stated one.
    scale: [f64; 2],
    /// Where a positive output points, found and stated: a negative K along one axis is a positive one along its opposite.
    senses: [Vector3<f64>; 2],
}

impl Beside {
    fn new(kind: &str, index: usize, [found, stated]: [f64; 2], rows: [[f64; 3]; 2]) -> Self {
        let [row, stated_row] = rows.map(Vector3::from);
        Self {
            name: format!("{kind} {}", faults::name(index)),
            scale: [found, found / stated],
            senses: [row * found.signum(), stated_row * stated.signum()],
        }
    }

    /// Words where it points elsewhere.
    fn turned(&self) -> Option<String> {
        let [found, stated] = self.senses;
        let angle = found.angle(&stated).to_degrees();
        let Self { name, scale: [scale, _], .. } = self;
        if angle > OTHER_SIGN_DEG {
            return Some(format!(
                "{name}: it is found with the other sign than the document at hand, or else its column, says (K = {scale:.4}): is a \
                 sign missing in the mapping, of this column or of an accelerometer's?"
            ));
        }
        (angle > LARGEST_TURN_DEG).then(|| {
            format!(
                "{name}: a positive output is found along ({:.2}, {:.2}, {:.2}), {angle:.0}° from where the document at hand, or else \
                 its column, has it (K = {scale:.4}): are columns of the mapping swapped, of the accelerometers too, or is a sign the \
                 other one?",
                found.x, found.y, found.z
            )
        })
    }
}

/// Sensors of one kind that have changed far more than the others of theirs.
fn apart(sensors: &[Beside]) -> Option<String> {
    let size = |sensor: &&Beside| sensor.scale[1].abs();
    let most = sensors.iter().max_by(|a, b| size(a).total_cmp(&size(b)))?;
    let least = sensors.iter().min_by(|a, b| size(a).total_cmp(&size(b)))?;
    let ratio = size(&most) / size(&least);
    (ratio > LARGEST_RATIO).then(|| {
        format!(
            "{} and {}: their K are {:.4} and {:.4} times what the document at hand, or else the log, states, {ratio:.1} times \
             apart: is the unit of measure of each column in the mapping the right one?",
            most.name, least.name, most.scale[1], least.scale[1]
        )
    })
}

/// What is physically odd about fits that are good: axes and scale factors far from what the document at hand states.
pub(in crate::tumble) fn odd(
    base: &Document,
    tumble: &Tumble,
    temperature: &dyn Fn(Option<&String>) -> f64,
) -> Vec<String> {
    let mut kinds: Vec<Vec<Beside>> = Vec::new();
    if let Some(accel) = &base.accel {
        let found = tumble.accel.scale.iter().zip(&tumble.accel.rows);
        let stated = accel.sensor.iter().zip(&accel.orientation.rows);
        let beside = found.zip(stated).enumerate().map(|(index, ((scale, row), (sensor, stated)))| {
            let old = sensor.scale_factor.shape().at(temperature(sensor.channel.as_ref())).unwrap_or(1.0);
            Beside::new("accelerometer", index, [*scale, old], [*row, *stated])
        });
        kinds.push(beside.collect());
    }
    if let Ok(gyro) = &tumble.gyro {
        let found = gyro.weight.iter().zip(&gyro.rows);
        let stated = base.gyro.sensor.iter().zip(&base.gyro.orientation.rows);
        let beside = found.zip(stated).enumerate().map(|(index, ((weight, row), (sensor, stated)))| {
            let old = sensor.increment_weight_rad_per_rad.unwrap_or(1.0);
            Beside::new("gyro", index, [*weight, old], [*row, *stated])
        });
        kinds.push(beside.collect());
    }
    let of = |sensors: &Vec<Beside>| -> Vec<String> {
        sensors.iter().filter_map(Beside::turned).chain(apart(sensors)).collect()
    };
    kinds.iter().flat_map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_not_found_is_said_in_plain_words() {
        let patience = NoSolution::NoMinimum("LostPatience".to_owned());
        let words = no_accelerometers(&patience);
        assert!(!words.contains("Lost") && words.contains("edges and corners"), "{words}");
        let words = no_gyros(&patience);
        assert!(
            !words.contains("Lost") && words.contains("the order and the signs of the columns"),
            "{words}"
        );
        assert!(no_gyros(&NoSolution::NotDetermined(8)).contains("gyro z"));
        // What no document may state is refused before it is written, without the numbers of a matrix.
        let straight = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        assert_eq!(lost(&[0.01; 8], &straight), None);
        let words = lost(&[0.01; 8], &[[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.8, 0.6, 1e-5]]).unwrap();
        assert!(words.contains("in one plane") && !words.contains("condition number"), "{words}");
    }
}
