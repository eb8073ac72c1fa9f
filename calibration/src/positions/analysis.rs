//! From the runs of a unit to what its accelerometers are.

use isotherm_protocol::document::{Document, Shape};
use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::faults;
use super::fit::{Fit, Weights, fit, guesses};
use super::matching::matched;
use super::model::{Degrees, Guess, Taken};
use super::plan::Plan;
use super::pose::{Pose, intensities};
use super::solve::NoSolution;
use super::still::{StillLimits, still};
use super::times::Times;
use super::track::Track;

/// Distance of temperatures that are two (°C).
pub const LEVEL_GAP_DEG_C: f64 = 5.0;
/// Fewest positions that tell the stand's errors from the axes.
pub const GOOD_POSITIONS: usize = 9;
/// Probability below which something is no accident.
const ACCIDENT: f64 = 1e-3;
/// Largest standard error of a scale factor that is still a result (relative).
const LARGEST_SIGMA: f64 = 1e-2;

/// How the positions are looked at.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// The plan.
    pub plan: Plan,
    /// Gravity (m/s²).
    pub gravity: f64,
    /// What counts as still.
    pub limits: StillLimits,
    /// Which pose is which, where somebody says so.
    pub times: Option<Times>,
    /// Standard deviation of the case's direction in a position (rad).
    pub positioning_rad: f64,
    /// Standard deviation of the stand's level beforehand (rad).
    pub levelling_rad: f64,
    /// Channels that the orientation follows; those of the accelerometers where empty.
    pub channels: Vec<String>,
    /// Temperature that all polynomials are about (°C); chosen where absent.
    pub reference_deg_c: Option<f64>,
}

/// What was found.
#[derive(Debug, Clone, PartialEq)]
pub struct Analysis {
    /// All poses that are positions, with the position's number and the level's.
    pub poses: Vec<(Pose, usize, usize)>,
    /// The positions as the fit had them.
    pub taken: Vec<Taken>,
    /// Mean temperature of each level (°C); one that is no number where nothing measures it.
    pub levels_deg_c: Vec<f64>,
    /// What the document will hold: C constant or linear.
    pub fit: Fit,
    /// With C quadratic, where there are three temperatures or more, and how sure it is that it is (χ² of the quadratic terms,
    /// their number, probability of an accident).
    pub quadratic: Option<(Fit, f64, usize, f64)>,
    /// Each temperature by itself.
    pub of_level: Vec<Option<Fit>>,
    /// Reference temperature and half the range (°C).
    pub reference_deg_c: f64,
    /// Half the range of temperature, which polynomials are scaled by (°C).
    pub half_deg_c: f64,
    /// Lowest and highest temperature (°C).
    pub range_deg_c: [f64; 2],
    /// Channels that the orientation follows.
    pub channels: Vec<String>,
    /// Weights that it was found with.
    pub weights: Weights,
    /// Factor by which all standard errors are widened.
    pub widened: f64,
    /// What is to be said.
    pub warnings: Vec<String>,
}

/// Finds everything from the runs of a unit, corrected with the document at hand where that matters.
///
/// # Errors
/// Every reason why it cannot be, with what to do.
pub fn analyse(tracks: &[Track], document: &Document, settings: &Settings) -> Result<Analysis, Vec<String>> {
    let reasons: Vec<String> = tracks.iter().flat_map(faults::dead).collect();
    if !reasons.is_empty() {
        return Err(reasons);
    }
    let (poses, mut warnings) = positions(tracks, settings)?;
    let sensors = tracks.iter().map(|track| track.outputs.len()).max().unwrap_or(0);
    let channels = channels(document, settings);
    let own = own_channels(document, sensors);
    let temperature = |pose: &Pose, channels: &[String]| pose.mean_temperature(channels);
    let axes: Vec<Option<f64>> = poses.iter().map(|(pose, _)| temperature(pose, &channels)).collect();
    let known = !channels.is_empty() && axes.iter().all(Option::is_some);
    let axes: Vec<f64> =
        axes.iter().map(|t| t.filter(|_| known).unwrap_or(document.temperature.assumed_deg_c)).collect();
    let (level_of, levels_deg_c) = levels(&axes);
    let (low, high) = axes.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), t| (a.min(*t), b.max(*t)));
    let reference = settings.reference_deg_c.unwrap_or_else(|| reference(low, high));
    let half = (0.5 * (high - low)).max(1.0);
    let scaled = |t: f64| (t - reference) / half;
    let taken: Vec<Taken> = poses
        .iter()
        .zip(axes.iter().zip(&level_of))
        .map(|((pose, position), (axes_t, level))| Taken {
            position: *position,
            outputs: pose.outputs.clone(),
            ratio: (0..sensors).map(|sensor| board_ratio(document, sensor, pose)).collect(),
            duration_s: pose.duration_s,
            sensor_t: own
                .iter()
                .map(|channel| {
                    let t = channel.as_ref().and_then(|name| pose.temperature_deg_c.get(name).copied());
                    scaled(t.unwrap_or(*axes_t))
                })
                .collect(),
            axes_t: scaled(*axes_t),
            level: *level,
        })
        .collect();
    let plain: Vec<Pose> = poses.iter().map(|(pose, _)| pose.clone()).collect();
    let weights = Weights {
        intensity: intensity(tracks, &plain)?,
        positioning_rad: settings.positioning_rad,
        levelling_rad: settings.levelling_rad,
    };
    let plan = &settings.plan;
    let guess = guesses(plan, &taken, sensors).map_err(|bad| spread(plan, &taken, &bad))?;
    let most = levels_deg_c.len() - 1;
    let degrees = Degrees { sensor: most.min(2), axes: most.min(1) };
    let found = fit(plan, &taken, &guess, &weights, degrees).map_err(|why| vec![no_solution(&why)])?;
    let quadratic = (most >= 2)
        .then(|| fit(plan, &taken, &guess, &weights, Degrees { axes: 2, ..degrees }).ok())
        .flatten()
        .map(|quadratic| {
            let (chi_square, terms) = quadratic_terms(&quadratic, plan);
            let accident = survival(chi_square, terms);
            (quadratic, chi_square, terms, accident)
        });
    let best = quadratic.as_ref().filter(|found| found.3 < ACCIDENT).map_or(&found, |found| &found.0);
    let widened = widening(best, &mut warnings);
    let bent = quadratic.as_ref().is_some_and(|found| found.3 < ACCIDENT);
    if bent {
        warnings.push(
            "C bends with temperature: the quadratic terms are no accident. The document holds the best straight line; the report \
             has both, and what the line leaves"
                .to_owned(),
        );
    }
    few(plan, &taken, levels_deg_c.len(), settings, &mut warnings);
    if !known && !document.temperature.channel.is_empty() {
        warnings.push(
            "the temperature channels have gaps or none is followed by the accelerometers: all positions count as one temperature"
                .to_owned(),
        );
    }
    let of_level = (0..levels_deg_c.len()).map(|level| one_level(plan, &taken, &guess, &weights, level)).collect();
    let poses = poses.into_iter().zip(&level_of).map(|((pose, position), level)| (pose, position, *level));
    let analysis = Analysis {
        poses: poses.collect(),
        taken,
        levels_deg_c,
        fit: found,
        quadratic,
        of_level,
        reference_deg_c: reference,
        half_deg_c: half,
        range_deg_c: [low, high],
        channels: if known { channels } else { Vec::new() },
        weights,
        widened,
        warnings,
    };
    sound(&analysis)?;
    Ok(analysis)
}

/// The poses of all runs that are positions of the plan, with the position's number.
///
/// # Errors
/// What is wrong with each run.
pub fn positions(
    tracks: &[Track],
    settings: &Settings,
) -> Result<(Vec<(Pose, usize)>, Vec<String>), Vec<String>> {
    let mut found = Vec::new();
    let mut warnings = Vec::new();
    let mut reasons = Vec::new();
    for (run, track) in tracks.iter().enumerate() {
        if let Some(times) = &settings.times {
            match times.poses(track, run, &settings.plan) {
                Ok(poses) => found.extend(poses),
                Err(words) => reasons.extend(words),
            }
            continue;
        }
        let intervals = still(track, &settings.limits, None);
        let poses = Pose::of(track, run, &intervals);
        if poses.is_empty() {
            reasons.push(format!(
                "{}: the unit stands still nowhere for {} s after {} s of settling: state less with --least and --settle, or give \
                 the times with --times",
                track.run, settings.limits.least_s, settings.limits.settle_s
            ));
            continue;
        }
        match matched(&settings.plan, track, &poses) {
            Ok(matches) => {
                let others = matches.iter().filter(|position| position.is_none()).count();
                if others > 0 {
                    warnings.push(format!(
                        "{}: {others} of {} still poses are no position of the plan and were left out",
                        track.run,
                        poses.len()
                    ));
                }
                found.extend(poses.into_iter().zip(matches).filter_map(|(pose, position)| Some((pose, position?))));
            }
            Err(words) => reasons.push(format!("{}: {words}", track.run)),
        }
    }
    let poses: Vec<Pose> = found.iter().map(|(pose, _)| pose.clone()).collect();
    reasons.extend(faults::clipped(tracks, &poses));
    if reasons.is_empty() && found.is_empty() {
        reasons.push("no position of the plan was found: is it the right --plan?".to_owned());
    }
    if reasons.is_empty() { Ok((found, warnings)) } else { Err(reasons) }
}

/// Intensities of the noise.
fn intensity(tracks: &[Track], poses: &[Pose]) -> Result<Vec<f64>, Vec<String>> {
    let found = intensities(tracks, poses);
    if found.iter().any(|intensity| intensity.is_nan()) {
        return Err(vec![
            "the positions are too short to tell the noise: each needs two seconds at least".to_owned(),
        ]);
    }
    // Without any noise a stand's errors alone would have to make a covariance that can be inverted.
    let floor = |(sensor, intensity): (usize, f64)| {
        let largest = poses.iter().filter_map(|pose| pose.outputs.get(sensor)).fold(0.0, |a: f64, b| a.max(b.abs()));
        intensity.max((1e-9 * largest).powi(2))
    };
    Ok(found.into_iter().enumerate().map(floor).collect())
}

/// Channels that the orientation follows: as stated, as in the document, or those of the accelerometers.
fn channels(document: &Document, settings: &Settings) -> Vec<String> {
    if !settings.channels.is_empty() {
        return settings.channels.clone();
    }
    let accel = document.accel.as_ref();
    if let Some(thermal) = accel.and_then(|accel| accel.orientation.thermal.as_ref()) {
        return thermal.channels.clone();
    }
    let mut own: Vec<String> = Vec::new();
    for channel in accel.iter().flat_map(|accel| &accel.sensor).filter_map(|sensor| sensor.channel.as_ref()) {
        if !own.contains(channel) {
            own.push(channel.clone());
        }
    }
    own
}

/// The channel of each accelerometer.
fn own_channels(document: &Document, sensors: usize) -> Vec<Option<String>> {
    let of = |sensor: usize| document.accel.as_ref()?.sensor.get(sensor)?.channel.clone();
    (0..sensors).map(of).collect()
}

/// r of the board of an accelerometer in a pose, by the document.
fn board_ratio(document: &Document, sensor: usize, pose: &Pose) -> f64 {
    let stated = || {
        let sensor = document.accel.as_ref()?.sensor.get(sensor)?;
        let t = pose.temperature_deg_c.get(sensor.board_channel.as_ref()?)?;
        value_at(sensor.board_ratio_error.as_ref()?.shape(), *t)
    };
    1.0 + stated().unwrap_or(0.0) * 1e-6
}

/// Value of a document's curve; `None` for a spline.
#[must_use]
pub fn value_at(shape: &Shape, x: f64) -> Option<f64> {
    match shape {
        Shape::Constant { value } => Some(*value),
        Shape::Polynomial { reference, coefficients, range } => {
            let away = x.max(range[0]).min(range[1]) - reference;
            Some(coefficients.iter().rev().fold(0.0, |sum, c| sum * away + c))
        }
        Shape::PiecewiseLinear { knots } => {
            let (first, last) = (knots.first()?, knots.last()?);
            let x = x.max(first[0]).min(last[0]);
            let pair = knots.windows(2).find(|pair| x <= pair[1][0])?;
            let share = (x - pair[0][0]) / (pair[1][0] - pair[0][0]);
            Some(pair[0][1] + share * (pair[1][1] - pair[0][1]))
        }
        Shape::Spline { .. } => None,
    }
}

/// Temperatures that are far enough apart to be several: the number of each one's level, and the levels' means.
#[expect(clippy::cast_precision_loss, reason = "positions")]
fn levels(temperatures: &[f64]) -> (Vec<usize>, Vec<f64>) {
    let mut order: Vec<usize> = (0..temperatures.len()).collect();
    order.sort_by(|a, b| temperatures[*a].total_cmp(&temperatures[*b]));
    let mut level_of = vec![0; temperatures.len()];
    let mut groups: Vec<Vec<f64>> = Vec::new();
    let mut last = f64::NEG_INFINITY;
    for index in order {
        let t = temperatures[index];
        if t - last > LEVEL_GAP_DEG_C {
            groups.push(Vec::new());
        }
        last = t;
        level_of[index] = groups.len() - 1;
        if let Some(group) = groups.last_mut() {
            group.push(t);
        }
    }
    (level_of, groups.iter().map(|group| group.iter().sum::<f64>() / group.len() as f64).collect())
}

/// A reference in whole degrees: 20 °C where that is in the range, else its middle.
fn reference(low: f64, high: f64) -> f64 {
    if low <= 20.0 && high >= 20.0 { 20.0 } else { (0.5 * (low + high)).round() }
}

/// A temperature by itself, where it has enough positions.
fn one_level(plan: &Plan, taken: &[Taken], guess: &[Guess], weights: &Weights, level: usize) -> Option<Fit> {
    let own: Vec<Taken> = taken.iter().filter(|taken| taken.level == level).cloned().collect();
    let enough = guesses(plan, &own, guess.len()).is_ok();
    enough.then(|| fit(plan, &own, guess, weights, Degrees { sensor: 0, axes: 0 }).ok()).flatten()
}

/// χ² of the quadratic terms of C, and their number.
fn quadratic_terms(fit: &Fit, plan: &Plan) -> (f64, usize) {
    let covariance = fit.axes_covariance(plan, 2);
    let model = fit.model(plan);
    let terms: Vec<f64> = (0..fit.guess.len())
        .flat_map(|sensor| [0, 1].map(|which| model.axis_index(sensor, which, 2)))
        .map(|index| fit.solution.parameters[index] * super::model::SMALL)
        .collect();
    let terms = nalgebra::DVector::from_vec(terms);
    let solved = covariance.cholesky().map(|cholesky| terms.dot(&cholesky.solve(&terms)));
    (solved.unwrap_or(0.0), terms.len())
}

/// Probability that χ² is at least so large by accident.
#[expect(clippy::cast_precision_loss, reason = "degrees of freedom")]
fn survival(chi_square: f64, degrees: usize) -> f64 {
    ChiSquared::new(degrees as f64).map_or(1.0, |law| law.sf(chi_square))
}

/// Factor by which standard errors are widened where the positions scatter more than they should.
fn widening(fit: &Fit, warnings: &mut Vec<String>) -> f64 {
    let (chi_square, degrees) = (fit.solution.chi_square, fit.solution.degrees);
    let Some(per_degree) = fit.solution.per_degree() else { return 1.0 };
    if survival(chi_square, degrees) >= ACCIDENT || per_degree <= 1.0 {
        return 1.0;
    }
    let factor = per_degree.sqrt();
    warnings.push(format!(
        "the positions scatter {factor:.1} times as much as positioning, run-out and noise explain (χ² {chi_square:.0} with {degrees} \
         degrees of freedom); all standard errors are widened by that. Look at the largest residuals: a position that is mistaken for \
         another, a unit that was not settled, a stand that is worse than --positioning and --run-out say"
    ));
    factor
}

/// What few, missing and repeated positions mean.
fn few(plan: &Plan, taken: &[Taken], levels: usize, settings: &Settings, warnings: &mut Vec<String>) {
    for level in 0..levels {
        let count = |position: usize| {
            taken.iter().filter(|taken| taken.level == level && taken.position == position).count()
        };
        let names = |which: &dyn Fn(usize) -> bool| -> Vec<&str> {
            let positions = plan.positions.iter().enumerate().filter(|(index, _)| which(count(*index)));
            positions.map(|(_, position)| position.name.as_str()).collect()
        };
        let at = if levels > 1 { format!("temperature {}: ", level + 1) } else { String::new() };
        let (missing, repeated) = (names(&|count| count == 0), names(&|count| count > 1));
        if !missing.is_empty() {
            warnings.push(format!("{at}missing positions: {}", missing.join(", ")));
        }
        if !repeated.is_empty() {
            warnings.push(format!("{at}positions taken more than once, all of them used: {}", repeated.join(", ")));
        }
    }
    let different = (0..plan.positions.len()).filter(|p| taken.iter().any(|taken| taken.position == *p)).count();
    if plan.has_stand() && different < GOOD_POSITIONS {
        warnings.push(format!(
            "{different} different positions do not tell the stand's level from the axes, {GOOD_POSITIONS} or more do: the standard \
             errors of C hold what --levelling states ({:.0}″)",
            settings.levelling_rad * super::budget::ARCSEC_PER_RAD
        ));
    }
}

/// Sensors whose positions do not spread, in words.
fn spread(plan: &Plan, taken: &[Taken], bad: &[usize]) -> Vec<String> {
    let seen = |axis: usize, sign: f64| {
        taken.iter().any(|taken| {
            let position = plan.positions.get(taken.position);
            position.is_some_and(|position| sign * plan.up(&position.attitude, [0.0; 3])[axis] > 0.5)
        })
    };
    let lacking: Vec<String> = (0..3)
        .flat_map(|axis| [(axis, 1.0, "up"), (axis, -1.0, "down")])
        .filter(|(axis, sign, _)| !seen(*axis, *sign))
        .map(|(axis, _, way)| format!("{} {way}", faults::name(axis)))
        .collect();
    let sensors: Vec<String> = bad.iter().map(|sensor| faults::name(*sensor)).collect();
    let lacking = if lacking.is_empty() {
        "the outputs do not follow the positions: is the plan the right one, and the columns of the mapping too?".to_owned()
    } else {
        format!("no position has {}", lacking.join(", "))
    };
    vec![format!(
        "{} positions do not determine scale factor, bias and axis of accelerometer {}: {lacking}",
        taken.len(),
        sensors.join(", ")
    )]
}

/// Whether what was found is a result.
fn sound(analysis: &Analysis) -> Result<(), Vec<String>> {
    let fit = &analysis.fit;
    let per_sensor = fit.solution.parameters.len().saturating_sub(3) / fit.guess.len().max(1);
    let bad = |sensor: usize| {
        let sigma = fit.solution.sigma(sensor * per_sensor) * super::model::SMALL * analysis.widened;
        (!(sigma <= LARGEST_SIGMA)).then(|| {
            format!(
                "accelerometer {}: its scale factor is known to {:.2} % only, at most {} % is a result: look at its residuals, and at \
                 its mapping",
                faults::name(sensor),
                sigma * 100.0,
                LARGEST_SIGMA * 100.0
            )
        })
    };
    let reasons: Vec<String> = (0..fit.guess.len()).filter_map(bad).collect();
    if reasons.is_empty() { Ok(()) } else { Err(reasons) }
}

/// No solution, in words.
fn no_solution(why: &NoSolution) -> String {
    match why {
        NoSolution::NotDetermined(index) => format!(
            "the positions do not determine parameter {index}: take each axis up and down at each temperature, in two orientations"
        ),
        NoSolution::NoMinimum(words) => {
            format!("no fit of the positions was found ({words}): is the plan the right one, and the mapping too?")
        }
    }
}
