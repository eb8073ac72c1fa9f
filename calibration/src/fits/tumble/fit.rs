//! From a run to the fits of its accelerometers and gyros, and every reason not to.

pub(super) mod doubts;
pub(super) mod odd;

use isotherm_correction::earth::EARTH_RATE;
use isotherm_protocol::document::Document;

use crate::axes::AXES;
use crate::fits::positions::faults;
use crate::fits::positions::pose::Pose;
use crate::fits::positions::still::{StillLimits, still};
use crate::fits::positions::track::Track;
use crate::numbers::{Size, dot, ends, norm, real, unit};
use crate::report::{counted, short};

use super::accel::{self, AccelFit, SENSORS};
use super::acceleration::{self, AtRest, mean_over};
use super::gyro::{self, GyroFit, Transition};

/// Fewest poses for nine parameters; as many as that leave no residual to judge by.
pub const FEWEST_POSES: usize = 12;
/// Share of the mean square along the direction that the poses show least: below it they lie in one plane.
const THINNEST: f64 = 0.05;
/// Multiples of the still start's variance that are tried as the limit of stillness.
const FACTORS: [f64; 9] = [2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0];
/// Shortest turn that says something of a gyro (rad).
const SHORTEST_TURN_RAD: f64 = 0.1;
/// Angle within which poses are alike (rad): 15°.
const ALIKE_RAD: f64 = core::f64::consts::PI / 12.0;
/// Longest transition (s): beyond it the gyros' drift is what is measured.
const LONGEST_TRANSITION_S: f64 = 60.0;

/// How a tumble log is looked at.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Gravity (m/s²).
    pub gravity: f64,
    /// Latitude of the place, for the Earth's rate (°).
    pub latitude_deg: Option<f64>,
    /// What counts as still; the factor is searched where `search` says so.
    pub limits: StillLimits,
    /// Try several factors and keep the one with the smallest residual.
    pub search: bool,
    /// Time at the beginning that the unit stood still (s).
    pub start_s: f64,
}

/// What was found.
#[derive(Debug, Clone, PartialEq)]
pub struct Tumble {
    /// The poses.
    pub poses: Vec<Pose>,
    /// The factor of stillness that they were found with.
    pub factor: f64,
    /// The accelerometers.
    pub accel: AccelFit,
    /// The gyros, or why not.
    pub gyro: Result<GyroFit, String>,
    /// What each gyro reads at rest; nothing where the gyros were not found.
    pub at_rest: Vec<AtRest>,
    /// |f| − g (m/s²) of each pose, by the fit of all that are not within 15° of it; no number where these have none.
    pub held_out: Vec<f64>,
    /// Largest distance of each gyro's output from that at rest (rad/s of the log).
    pub largest_rate: [f64; 3],
    /// What is to be said.
    pub warnings: Vec<String>,
}

impl Tumble {
    /// Mean temperature of a channel over all poses (°C), or what a document assumes where there is none.
    pub fn deg_c(&self, document: &Document, channel: Option<&String>) -> f64 {
        let of =
            |pose: &Pose| Some((pose.temperature_deg_c.get(channel?)? * pose.duration_s, pose.duration_s));
        let (sum, time) = self.poses.iter().filter_map(of).fold((0.0, 0.0), |(a, b), (x, y)| (a + x, b + y));
        if time > 0.0 { sum / time } else { document.temperature.assumed_deg_c }
    }

    /// Specific force of each pose along the case axes (m/s²).
    pub fn force(&self) -> Vec<[f64; 3]> {
        self.poses.iter().map(|pose| self.accel.force(&pose.outputs)).collect()
    }
}

/// Fits a tumble log.
///
/// # Errors
/// Every reason why it cannot be, with what to do.
pub fn analyse(track: &Track, settings: &Settings) -> Result<Tumble, Vec<String>> {
    faults(track)?;
    let factors = if settings.search { &FACTORS[..] } else { &[settings.limits.factor][..] };
    let mut best: Option<(f64, Vec<Pose>, AccelFit)> = None;
    let mut reasons = Vec::new();
    for factor in factors {
        let limits = StillLimits { factor: *factor, ..settings.limits };
        let poses = Pose::of(track, 0, still(track, &limits, Some(settings.start_s)));
        let fit = || accel::fit(&outputs(&poses), settings.gravity);
        let fitted = found(track, &poses, settings)
            .and_then(|()| fit().map_err(|why| vec![doubts::no_accelerometers(&why)]));
        match fitted {
            Ok(fit) => {
                let rms = Size::of(&fit.residual).rms;
                if best.as_ref().is_none_or(|(_, _, other)| rms < Size::of(&other.residual).rms) {
                    best = Some((*factor, poses, fit));
                }
            }
            Err(why) => reasons = why,
        }
    }
    let Some((factor, poses, accel)) = best else { return Err(reasons) };
    doubts::sound(&poses, &accel)?;
    let force: Vec<[f64; 3]> = poses.iter().map(|pose| accel.force(&pose.outputs)).collect();
    let directions: Vec<[f64; 3]> = force.iter().map(|force| unit(*force)).collect();
    let held_out = held_out(&poses, &directions, accel.gravity);
    let mut warnings = Vec::new();
    let (after, outside) = (Size::of(&accel.residual).rms, Size::of(&held_out).rms);
    if outside > 2.0 * after {
        warnings.push(format!(
            "|f| − g is {} m/s² rms in unseen poses, {} in fitted ones: use more poses",
            short(outside),
            short(after)
        ));
    }
    warnings.extend(doubts::beyond_noise(track, &poses, &accel));
    warnings.extend(doubts::ends_early(track, &poses));
    let rest = [0, 1, 2].map(|gyro| mean_over(&poses, |pose| poses[pose].gyro(gyro)));
    let gyro = gyros(track, &transitions(&poses, &directions, &directions), rest);
    let alike = |a, b| !apart(&directions, a, b);
    let at_rest = |gyro| acceleration::judged(&poses, &force, gyro, settings.latitude_deg, alike);
    let at_rest = gyro.as_ref().map_or_else(|_| Vec::new(), at_rest);
    let stated = at_rest.iter().any(|gyro| gyro.drift.is_ok());
    if stated && settings.latitude_deg.is_none() {
        warnings.push(format!(
            "acceleration-sensitive drift: up to {} (°/h)/g of each gyro's may be the Earth's rate, and is corrected \
             with it: state --latitude",
            short(EARTH_RATE.as_deg_per_h())
        ));
    }
    let largest_rate = [0, 1, 2].map(|gyro| {
        let away = track.gyros.get(gyro).into_iter().flatten().map(|rate| (rate - rest[gyro]).abs());
        away.filter(|away| away.is_finite()).fold(0.0, f64::max)
    });
    Ok(Tumble { poses, factor, accel, gyro, at_rest, held_out, largest_rate, warnings })
}

/// Mean outputs of poses.
fn outputs(poses: &[Pose]) -> Vec<Vec<f64>> {
    poses.iter().map(|pose| pose.outputs.clone()).collect()
}

/// Sensors that cannot be fitted, before anything else.
pub(super) fn faults(track: &Track) -> Result<(), Vec<String>> {
    let mut reasons = Vec::new();
    let kinds = [("accelerometer", &track.outputs), ("gyro", &track.gyros)];
    for (kind, columns) in kinds {
        if columns.len() != SENSORS {
            reasons.push(format!(
                "the unit has {} {kind}s: |f| = g needs three; for more use `isotherm-calibrate positions` on a stand",
                columns.len()
            ));
        }
    }
    reasons.extend(faults::dead(std::slice::from_ref(track)));
    if reasons.is_empty() { Ok(()) } else { Err(reasons) }
}

/// Whether the poses allow a fit.
fn found(track: &Track, poses: &[Pose], settings: &Settings) -> Result<(), Vec<String>> {
    let mut reasons = Vec::new();
    let begins = poses.first().map_or(f64::INFINITY, |pose| pose.span_s[0]);
    let length = poses.first().map_or(0.0, |pose| pose.duration_s);
    let window = settings.limits.window_s;
    if begins > window + settings.limits.settle_s || length < settings.start_s - 2.0 * window {
        let at = if begins.is_finite() {
            format!("the first still interval begins at {begins:.1} s and lasts {length:.1} s")
        } else {
            "no still interval was found at all".to_owned()
        };
        reasons.push(format!(
            "the unit must be still for the first {} s, to measure the noise; {at}: leave it alone before the first \
             turn, or reduce --still-start",
            settings.start_s
        ));
        reasons.extend(track.gaps());
    }
    reasons.extend(faults::clipped(std::slice::from_ref(track), &poses.iter().collect::<Vec<_>>()));
    if poses.len() < FEWEST_POSES {
        reasons.push(format!(
            "{} found, {FEWEST_POSES} are needed and 30 are good: put the unit down in more ways, for {} s each",
            counted(poses.len(), "still pose was", "still poses were"),
            settings.limits.least_s + settings.limits.window_s
        ));
    } else if let Some(words) = flat(poses) {
        reasons.push(words);
    }
    if reasons.is_empty() { Ok(()) } else { Err(reasons) }
}

/// Words where the poses lie in one plane.
///
/// Outputs are brought to the size of one by the largest half range of all axes: an axis that never points up or down has a
/// small one, and must not be blown up to the size of the others.
fn flat(poses: &[Pose]) -> Option<String> {
    let ends = [0, 1, 2].map(|i| ends(poses.iter().map(|pose| pose.output(i))));
    let half = ends.iter().map(|[low, high]| 0.5 * (high - low)).fold(0.0, f64::max);
    let mut scatter = nalgebra::Matrix3::<f64>::zeros();
    for pose in poses {
        let v = nalgebra::Vector3::from_fn(|i, _| (pose.output(i) - 0.5 * (ends[i][0] + ends[i][1])) / half);
        scatter += v * v.transpose();
    }
    let eigen = (scatter / real(poses.len())).symmetric_eigen();
    let (index, least) = eigen.eigenvalues.argmin();
    if least.is_nan() || least >= THINNEST {
        return None;
    }
    let direction = eigen.eigenvectors.column(index);
    let axis = AXES.get(direction.iamax()).copied().unwrap_or_default();
    Some(format!(
        "the poses lie in one plane: along {axis} the specific force is {:.2} g rms, at least {:.2} g is needed; put the unit down \
         with its {axis} axis up, down and slanting",
        least.max(0.0).sqrt(),
        THINNEST.sqrt()
    ))
}

/// |f| − g of every pose by the fit of those that look elsewhere. A unit that is put down by hand is often put down alike: of two
/// poses next to each other the one knows what the other leaves, and a fit that has either says nothing of poses that are new.
fn held_out(poses: &[Pose], directions: &[[f64; 3]], gravity: f64) -> Vec<f64> {
    let all = outputs(poses);
    let one = |index: usize| {
        let others = (0..all.len()).filter(|other| apart(directions, index, *other));
        let others: Vec<Vec<f64>> = others.map(|other| all[other].clone()).collect();
        accel::fit(&others, gravity).map_or(f64::NAN, |fit| norm(fit.force(&all[index])) - gravity)
    };
    (0..all.len()).map(one).collect()
}

/// Whether two poses look at different directions.
fn apart(directions: &[[f64; 3]], a: usize, b: usize) -> bool {
    dot(directions[a], directions[b]) < libm::cos(ALIKE_RAD)
}

/// Fits the gyros to what lies between the poses.
fn gyros(track: &Track, transitions: &[Transition], rest: [f64; 3]) -> Result<GyroFit, String> {
    if track.gyro_counts {
        return Err("the gyro readings are counts: convert them in the mapping".into());
    }
    if transitions.len() < 6 {
        return Err(format!(
            "{} of at least {:.0}° within {LONGEST_TRANSITION_S} s between the poses, six are needed: turn the unit about each of its \
             axes, each time within {LONGEST_TRANSITION_S} s from pose to pose",
            counted(transitions.len(), "turn", "turns"),
            SHORTEST_TURN_RAD.to_degrees()
        ));
    }
    let fit = gyro::fit(track, rest, transitions).map_err(|why| doubts::no_gyros(&why))?;
    match doubts::lost(&fit) {
        Some(words) => Err(words),
        None => Ok(fit),
    }
}

/// Turns between neighbouring poses by the direction of specific force that was found of each, with what `directions` has of them.
pub fn transitions(poses: &[Pose], found: &[[f64; 3]], directions: &[[f64; 3]]) -> Vec<Transition> {
    let between = |index: usize| {
        let [before, after] = [&poses[index], &poses[index + 1]];
        let turned = dot(found[index], found[index + 1]) < libm::cos(SHORTEST_TURN_RAD);
        let length = after.span_s[0] - before.span_s[1];
        (turned && length < LONGEST_TRANSITION_S).then_some(Transition {
            ticks: [before.ticks.end, after.ticks.start],
            directions: [directions[index], directions[index + 1]],
        })
    };
    (0..poses.len().saturating_sub(1)).filter_map(between).collect()
}
