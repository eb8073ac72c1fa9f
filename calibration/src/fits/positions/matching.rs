//! Which pose is which position of the plan.
//!
//! Directions of gravity alone do not tell: each of the twelve positions has a twin half a turn about the vertical away. The gyros
//! do, from one pose to the next. Where they were not turned with the unit (a log of positions without the way between them), the
//! order of the plan does, if no position is missing.

use std::ops::Range;

use nalgebra::{Matrix3, Vector3};

use super::plan::{Attitude, Plan};
use super::pose::Pose;
use super::track::Track;
use crate::numbers::{ends, real};
use crate::report::{counted, fixed};
use crate::runs::swapped::{AS_LOGGED, ORDERS, moved};

/// Largest angle between the direction found and that of the plan (rad): 20°.
const DIRECTION_RAD: f64 = 0.35;
/// Largest angle between the rotation that the gyros saw and that of the plan (rad): 30°.
const ROTATION_RAD: f64 = 0.52;
/// Share of the ways between poses on which the gyros must agree with the accelerometers.
const AGREEMENT: f64 = 0.8;
/// Fewest ways that tell an order of columns from chance.
const TELLING_WAYS: usize = 3;

/// Plan positions of a run's poses, `None` for one that is no position of the plan, and what is to be said of it.
pub type Matched = (Vec<Option<usize>>, Option<String>);

/// Finds the plan positions of a run's poses.
///
/// # Errors
/// What is wrong and what to do.
pub fn matched(plan: &Plan, track: &Track, poses: &[Pose]) -> Result<Matched, String> {
    let directions = directions(poses)?;
    let fits = |pose: usize, position: usize| {
        let up = plan.up(position, [0.0; 3]);
        directions[pose].angle(&Vector3::from(up)) < DIRECTION_RAD
    };
    let candidates: Vec<Vec<usize>> = (0..poses.len())
        .map(|pose| (0..plan.positions.len()).filter(|position| fits(pose, *position)).collect())
        .collect();
    let ways = ways(track, poses, AS_LOGGED);
    let share = agreement(&ways, &directions, AS_LOGGED);
    let swapped = if share < AGREEMENT { swapped(track, poses, (&ways, &directions)) } else { None };
    let unclear = |hint: &str| {
        let agree = if ways.is_empty() {
            "the log has no turns".to_owned()
        } else {
            format!(
                "gyros and accelerometers agree on {:.0} % of the turns between the poses, at least {:.0} % is needed",
                share * 100.0,
                AGREEMENT * 100.0
            )
        };
        format!("{}; {agree}: {hint}", nothing(plan, poses, &directions))
    };
    let doubt = swapped.transpose().map_err(|hint| unclear(&hint))?;
    let doubt = doubt
        .map(|hint| format!("gyros and accelerometers do not agree on the turns between the poses: {hint}"));
    let count = plan.positions.len();
    let in_order = || (0..poses.len()).all(|pose| fits(pose, pose % count));
    let positions = if candidates.iter().all(|candidates| candidates.len() <= 1) {
        candidates.iter().map(|candidates| candidates.first().copied()).collect()
    } else if share >= AGREEMENT {
        let starts = candidates.iter().position(|candidates| !candidates.is_empty());
        let anchors = starts.map(|start| candidates[start].clone()).unwrap_or_default();
        let followed = anchors.into_iter().map(|anchor| follow(plan, &candidates, &ways, anchor));
        let missing = |found: &Vec<Option<usize>>| found.iter().filter(|position| position.is_none()).count();
        // The first of equals: the plan's order.
        followed.min_by_key(missing).ok_or_else(|| nothing(plan, poses, &directions))?
    } else if poses.len().is_multiple_of(count) && in_order() {
        (0..poses.len()).map(|pose| Some(pose % count)).collect()
    } else {
        return Err(unclear(&format!(
            "they are not the plan's {count} positions in their order, one is missing or repeated{}. Identify the poses \
             with --times, or record the turns too",
            unseen(plan).unwrap_or_default()
        )));
    };
    Ok((positions, doubt))
}

/// An order of columns with which both agree on the turns, in words: of the gyros, or, as an error, of the accelerometers.
fn swapped(
    track: &Track,
    poses: &[Pose],
    (as_logged, directions): (&[Matrix3<f64>], &[Vector3<f64>]),
) -> Option<Result<String, String>> {
    if as_logged.len() < TELLING_WAYS {
        return None;
    }
    let hint = |kind: &str, order| {
        let axes = moved(order);
        format!("with {kind} {axes} swapped they would agree; check the columns in the mapping")
    };
    ORDERS.into_iter().find_map(|order| {
        if agreement(as_logged, directions, order) >= AGREEMENT {
            return Some(Err(hint("accelerometers", order)));
        }
        let reordered = ways(track, poses, order);
        (agreement(&reordered, directions, AS_LOGGED) >= AGREEMENT).then(|| Ok(hint("gyros", order)))
    })
}

/// Share of the ways on which gyros and accelerometers agree, with the accelerometers in another order.
fn agreement(ways: &[Matrix3<f64>], directions: &[Vector3<f64>], order: [usize; 3]) -> f64 {
    let up = |direction: &Vector3<f64>| Vector3::from_fn(|axis, _| direction[order[axis]]);
    let agree = ways
        .iter()
        .zip(directions.windows(2))
        .filter(|(way, pair)| (**way * up(&pair[0])).angle(&up(&pair[1])) < DIRECTION_RAD);
    real(agree.count()) / real(ways.len().max(1))
}

/// Words where a plan's neighbours differ by a turn about the vertical, which no accelerometer feels: without the turns in the log
/// one is taken for the other, or both for one pose.
fn unseen(plan: &Plan) -> Option<String> {
    let up = |position: usize| Vector3::from(plan.up(position, [0.0; 3]));
    let pair =
        (1..plan.positions.len()).find(|position| up(*position).angle(&up(position - 1)) < DIRECTION_RAD)?;
    Some(format!(
        " (from {:?} to {:?} the unit turns about the vertical only, which accelerometers do not sense: without \
         turns only a complete set in the plan's order and in one log is recognised, others need --times)",
        plan.positions[pair - 1].name,
        plan.positions[pair].name
    ))
}

/// The poses in words.
fn nothing(plan: &Plan, poses: &[Pose], directions: &[Vector3<f64>]) -> String {
    let words = poses.iter().zip(directions).map(|(pose, up)| {
        let [x, y, z] = [up.x, up.y, up.z].map(|c| fixed(c, 2));
        format!("{:.0}–{:.0} s up ({x}, {y}, {z})", pose.span_s[0], pose.span_s[1])
    });
    let words: Vec<String> = words.collect();
    format!(
        "{} ({}) for a plan of {}",
        counted(poses.len(), "still pose", "still poses"),
        words.join("; "),
        plan.positions.len()
    )
}

/// Follows the gyros from an anchor.
fn follow(
    plan: &Plan,
    candidates: &[Vec<usize>],
    ways: &[Matrix3<f64>],
    anchor: usize,
) -> Vec<Option<usize>> {
    let mut found = Vec::with_capacity(candidates.len());
    let mut last: Option<usize> = None;
    let mut turned = Matrix3::identity();
    for (pose, candidates) in candidates.iter().enumerate() {
        if let Some(way) = pose.checked_sub(1).and_then(|before| ways.get(before)) {
            turned = way * turned;
        }
        let position = match last {
            None => candidates.contains(&anchor).then_some(anchor),
            Some(from) => {
                let away = |position: &usize| {
                    let planned = case_of(plan, *position) * case_of(plan, from).transpose();
                    angle(&(turned * planned.transpose()))
                };
                let near = candidates.iter().copied().min_by(|a, b| away(a).total_cmp(&away(b)));
                near.filter(|position| away(position) < ROTATION_RAD)
            }
        };
        if position.is_some() {
            last = position;
            turned = Matrix3::identity();
        }
        found.push(position);
    }
    found
}

/// Angle of a rotation (rad).
fn angle(rotation: &Matrix3<f64>) -> f64 {
    libm::acos((0.5 * (rotation.trace() - 1.0)).clamp(-1.0, 1.0))
}

/// Directions of "up" in case axes: of the specific force where the document at hand knows it, else of outputs that are centred
/// and brought to the size of one.
fn directions(poses: &[Pose]) -> Result<Vec<Vector3<f64>>, String> {
    let known = poses.iter().all(|pose| {
        let size = Vector3::from(pose.force_m_per_s2).norm();
        (9.3..10.3).contains(&size)
    });
    if known {
        return Ok(poses.iter().map(|pose| Vector3::from(pose.force_m_per_s2).normalize()).collect());
    }
    if poses.iter().any(|pose| pose.outputs.len() != 3) {
        return Err(
            "the document's accelerometers do not give 1 g, and with more than three of them directions cannot be \
             guessed: give a document with nominal scale factors and axes (--calibration)"
                .to_owned(),
        );
    }
    let ends = [0, 1, 2].map(|i| ends(poses.iter().map(|pose| pose.output(i))));
    let scaled = |pose: &Pose| {
        Vector3::from_fn(|i, _| {
            let [low, high] = ends[i];
            (pose.outputs[i] - 0.5 * (low + high)) / (0.5 * (high - low))
        })
    };
    Ok(poses.iter().map(|pose| scaled(pose).normalize()).collect())
}

/// Rotations of the case from each pose to the next, with the gyros in another order: each takes a fixed vector's components before to
/// those after.
fn ways(track: &Track, poses: &[Pose], order: [usize; 3]) -> Vec<Matrix3<f64>> {
    let columns = order.map(|axis| &track.rate_deg_per_s[axis]);
    let way = |pair: &[Pose]| {
        let [before, after] = [&pair[0].ticks, &pair[1].ticks];
        let at_rest = |column: &[f64], pose: &Range<usize>| {
            let ticks = &column[pose.clone()];
            ticks.iter().sum::<f64>() / real(ticks.len().max(1))
        };
        let rest = columns.map(|column| 0.5 * (at_rest(column, before) + at_rest(column, after)));
        let turn = |turned: Matrix3<f64>, tick: usize| {
            let rate = Vector3::from_fn(|axis, _| (columns[axis][tick] - rest[axis]).to_radians());
            let is_known = rate.iter().all(|rate| rate.is_finite());
            if is_known { seen(rate * track.duration_s[tick]) * turned } else { turned }
        };
        (before.end..after.start).fold(Matrix3::identity(), turn)
    };
    poses.windows(2).map(way).collect()
}

/// How a fixed vector's components change while the case turns by a rotation vector.
pub(crate) fn seen(turn: Vector3<f64>) -> Matrix3<f64> {
    let size = turn.norm();
    if size == 0.0 {
        return Matrix3::identity();
    }
    let (sin, cos) = libm::sincos(size);
    let axis = turn / size;
    Matrix3::identity() * cos - axis.cross_matrix() * sin + axis * axis.transpose() * (1.0 - cos)
}

/// Stand to case in a position: columns are the stand's base axes in case axes. Without a stand, none.
fn case_of(plan: &Plan, position: usize) -> Matrix3<f64> {
    let Attitude::Stand([first, second]) = plan.positions[position].attitude else {
        return Matrix3::identity();
    };
    let mounting = Matrix3::from_fn(|row, column| plan.mounting[column][row]);
    let turn = |axis: usize, angle: f64| {
        let mut turn = Vector3::zeros();
        turn[axis] = angle;
        seen(turn)
    };
    mounting * turn(1, first) * turn(0, second)
}
