//! Which pose is which position of the plan.
//!
//! Directions of gravity alone do not tell: each of the twelve positions has a twin half a turn about the vertical away. The gyros
//! do, from one pose to the next, but for where they begin: all poses of a log half a turn away fit as well. The order nearest to the
//! plan's is taken, and the fit of all logs tells whether it is right. Where the gyros were not turned with the unit (a log of positions
//! without the way between them), the order of the plan does, if no position is missing.

use std::ops::Range;

use nalgebra::{Matrix3, Vector3};

use super::plan::{Attitude, Plan};
use super::pose::Pose;
use super::track::Track;
use crate::axes::several;
use crate::numbers::{ends, once_each, real};
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

/// Plan positions of a run's poses, `None` for one that is no position of the plan.
pub type Labels = Vec<Option<usize>>;

/// What a run's poses are.
#[derive(Debug, Clone, PartialEq)]
pub struct Matched {
    /// Their positions.
    pub labels: Labels,
    /// What else the same poses may be, as far as the run by itself tells.
    pub others: Vec<Labels>,
    /// What is to be said of it.
    pub doubt: Option<String>,
}

/// Finds the plan positions of a run's poses.
///
/// # Errors
/// What is wrong and what to do.
pub fn matched(plan: &Plan, track: &Track, poses: &[Pose]) -> Result<Matched, String> {
    let (directions, one_way) = directions(poses)?;
    let fits = |pose: usize, position: usize| {
        let up = plan.up(position, [0.0; 3]);
        directions[pose].angle(&Vector3::from(up)) < DIRECTION_RAD
    };
    let candidates: Vec<Vec<usize>> = (0..poses.len())
        .map(|pose| (0..plan.positions.len()).filter(|position| fits(pose, *position)).collect())
        .collect();
    if let Some(words) = one_way.filter(|_| candidates.iter().any(Vec::is_empty)) {
        return Err(words);
    }
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
    let turned = if share >= AGREEMENT { followed(plan, &candidates, &ways) } else { Vec::new() };
    let mut all = if candidates.iter().all(|candidates| candidates.len() <= 1) {
        let direct: Labels = candidates.iter().map(|candidates| candidates.first().copied()).collect();
        // Poses that only gravity takes for positions are left out where those of the gyros are all that there are: of twelve, six.
        let different = |labels: &Labels| once_each(labels.iter().flatten()).len();
        let whole = turned.into_iter().filter(|labels| different(labels) == different(&direct));
        let whole: Vec<Labels> = whole.collect();
        if whole.is_empty() { vec![direct] } else { whole }
    } else if share >= AGREEMENT {
        turned
    } else if poses.len().is_multiple_of(count) && in_order() {
        vec![(0..poses.len()).map(|pose| Some(pose % count)).collect()]
    } else {
        return Err(unclear(&format!(
            "they are not the plan's {count} positions in their order, one is missing or repeated{}. Identify the poses \
             with --times, or record the turns too",
            unseen(plan).unwrap_or_default()
        )));
    };
    if all.is_empty() {
        return Err(nothing(plan, poses, &directions));
    }
    let labels = all.remove(0);
    let are_same_poses = |other: &Labels| labels.iter().zip(other).all(|(a, b)| a.is_some() == b.is_some());
    let others = all.into_iter().filter(are_same_poses).collect();
    Ok(Matched { labels, others, doubt })
}

/// What poses are by the gyros, wherever they begin, with the fewest that are no position: those nearest to the plan's order first.
fn followed(plan: &Plan, candidates: &[Vec<usize>], ways: &[Matrix3<f64>]) -> Vec<Labels> {
    let of_pose = |(pose, own): (usize, &Vec<usize>)| own.iter().map(|at| (pose, *at)).collect::<Vec<_>>();
    let anchors = candidates.iter().enumerate().flat_map(of_pose);
    let mut found = once_each(anchors.map(|anchor| follow(plan, candidates, ways, anchor)));
    let missing = |labels: &Labels| labels.iter().filter(|position| position.is_none()).count();
    let fewest = found.iter().map(missing).min();
    found.retain(|labels| Some(missing(labels)) == fewest);
    found.sort_by_key(|labels| detour(labels.iter().flatten().copied()));
    found
}

/// How far positions are apart in the plan from one to the next, together: least in the plan's order, forth or back.
pub fn detour(positions: impl IntoIterator<Item = usize>) -> usize {
    let positions: Vec<usize> = positions.into_iter().collect();
    positions.windows(2).map(|pair| pair[0].abs_diff(pair[1])).sum()
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

/// Follows the gyros from an anchor: a pose, and the position that it is taken for.
fn follow(
    plan: &Plan,
    candidates: &[Vec<usize>],
    ways: &[Matrix3<f64>],
    (start, anchor): (usize, usize),
) -> Labels {
    let mut found = Vec::with_capacity(candidates.len());
    let mut last: Option<usize> = None;
    let mut turned = Matrix3::identity();
    for (pose, candidates) in candidates.iter().enumerate() {
        if let Some(way) = pose.checked_sub(1).and_then(|before| ways.get(before)) {
            turned = way * turned;
        }
        let position = match last {
            None => (pose == start).then_some(anchor),
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
/// and brought to the size of one; then with what is wrong if they are none.
fn directions(poses: &[Pose]) -> Result<(Vec<Vector3<f64>>, Option<String>), String> {
    let known = poses.iter().all(|pose| {
        let size = Vector3::from(pose.force_m_per_s2).norm();
        (9.3..10.3).contains(&size)
    });
    if known {
        return Ok((poses.iter().map(|pose| Vector3::from(pose.force_m_per_s2).normalize()).collect(), None));
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
    let scaled: Vec<Vector3<f64>> = poses.iter().map(scaled).collect();
    // Of one that is shown one way only, level is the other end of what it shows.
    let has_middle = |axis: &usize| scaled.iter().any(|up| up[*axis].abs() < 0.5);
    let one_way: Vec<usize> = (0..3).filter(|axis| !has_middle(axis)).collect();
    let words = (!one_way.is_empty()).then(|| {
        format!(
            "{} {} not shown both up and down, without which a log tells no directions: give a document with nominal scale factors \
             and axes (--calibration), or identify the poses with --times",
            several("accelerometer", &one_way, 3),
            if one_way.len() == 1 { "is" } else { "are" }
        )
    });
    Ok((scaled.into_iter().map(|up| up.normalize()).collect(), words))
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
