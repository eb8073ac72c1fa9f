//! From the runs of a unit to what its accelerometers are.

use isotherm_protocol::document::Document;

use super::document::held_twice;
use super::doubts::{
    ACCIDENT, excess, few, no_solution, not_as_stated, quadratic_terms, reordered, sound, spread, survival,
    widening,
};
use super::faults;
use super::hysteresis::{Return, returns};
use super::matching::{Matched, detour, matched};
use super::model::{Degrees, Taken};
use super::plan::Plan;
use super::pose::{Pose, intensities};
use super::solve::{Fit, Positions, Weights, guesses};
use super::still::{StillLimits, still};
use super::temperature::{blind, board_ratio, followed, levels, own_deg_c, reference, slopes_deg_c, stuck};
use super::times::Times;
use super::track::Track;
use crate::document::accel_name;
use crate::numbers::{ends, real};
use crate::report::counted;

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
    /// Reference temperature of the polynomials (°C); chosen where absent.
    pub reference_deg_c: Option<f64>,
}

/// What was found.
#[derive(Debug, Clone, PartialEq)]
pub struct Analysis {
    /// All poses that are positions, with the position's number.
    pub poses: Vec<(Pose, usize)>,
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
    /// Lowest and highest temperature that the orientation follows (°C).
    pub range_deg_c: [f64; 2],
    /// What K and S of each accelerometer were taken at: the temperatures of its own channel, by position (°C).
    pub sensors_deg_c: Vec<Vec<f64>>,
    /// Mean temperature of the channels that the slopes of the document's C follow (°C).
    pub slopes_deg_c: f64,
    /// Channels that the orientation follows.
    pub channels: Vec<String>,
    /// Weights that it was found with.
    pub weights: Weights,
    /// Factor by which all standard errors are widened.
    pub widened: f64,
    /// The axes at temperatures that were left and come back to.
    pub returns: Vec<Return>,
    /// What is to be said.
    pub warnings: Vec<String>,
}

/// Finds everything from the runs of a unit, corrected with the document at hand where that matters.
///
/// # Errors
/// Every reason why it cannot be, with what to do.
pub fn analyse(tracks: &[Track], document: &Document, settings: &Settings) -> Result<Analysis, Vec<String>> {
    let reasons = [faults::dead(tracks), held_twice(document)].concat();
    if !reasons.is_empty() {
        return Err(reasons);
    }
    let Found { mut poses, mut others, mut warnings } = positions(tracks, settings)?;
    let sensors = tracks.iter().map(|track| track.outputs.len()).max().unwrap_or(0);
    let (channels, axes) = followed(document, settings, &poses, &mut warnings)?;
    let (level_of, levels_deg_c) = levels(&axes);
    let own = own_deg_c(document, &poses, &axes, sensors);
    let blind = blind(document, &own, levels_deg_c.len());
    if !blind.is_empty() {
        return Err(blind);
    }
    if let Some(words) = stuck(&channels, &axes, &own).filter(|_| !channels.is_empty()) {
        return Err(vec![words]);
    }
    let [low, high] = ends(axes.iter().copied());
    let reference = settings.reference_deg_c.unwrap_or_else(|| reference(low, high));
    let half = (0.5 * (high - low)).max(1.0);
    let scaled = |t: f64| (t - reference) / half;
    let mut taken: Vec<Taken> = poses
        .iter()
        .zip(axes.iter().zip(&level_of))
        .enumerate()
        .map(|(taken, ((pose, position), (axes_t, level)))| Taken {
            position: *position,
            outputs: pose.outputs.clone(),
            ratio: (0..sensors).map(|sensor| board_ratio(document, sensor, pose)).collect(),
            duration_s: pose.duration_s,
            sensor_t: own.iter().map(|deg_c| scaled(deg_c.get(taken).copied().unwrap_or(*axes_t))).collect(),
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
    let stand = &settings.plan;
    let guess = guesses(stand, &taken, sensors).map_err(|bad| spread(stand, &taken, (&bad, sensors)))?;
    let most = levels_deg_c.len() - 1;
    let degrees = Degrees { sensor: most.min(2), axes: most.min(1) };
    let fit_of =
        |taken: &[Taken]| Positions { plan: stand, taken, guess: &guess, weights: &weights, degrees }.fit();
    let mut found = fit_of(&taken).map_err(|why| vec![no_solution(&why, degrees, sensors)])?;
    while let Some((better, words)) = contradicting((&found, &taken), &mut others, fit_of) {
        warnings.push(words);
        (taken, found) = better;
    }
    poses.iter_mut().zip(&taken).for_each(|((_, position), taken)| *position = taken.position);
    let names: Vec<String> = tracks.iter().map(|track| track.run.clone()).collect();
    if settings.times.is_none() {
        warnings.extend(reordered(stand, &poses, &names));
    }
    let all = Positions { plan: stand, taken: &taken, guess: &guess, weights: &weights, degrees };
    let with_bend = Positions { degrees: Degrees { axes: 2, ..degrees }, ..all };
    let quadratic = (most >= 2).then(|| with_bend.fit().ok()).flatten().map(|quadratic| {
        let (chi_square, terms) = quadratic_terms(&quadratic);
        let accident = survival(chi_square, terms);
        (quadratic, chi_square, terms, accident)
    });
    let curved = quadratic.as_ref().filter(|found| found.3 < ACCIDENT);
    let best = curved.map_or(&found, |found| &found.0);
    let widened = widening(best, &mut warnings);
    if curved.is_some() {
        warnings.push(
            "C bends with temperature: the quadratic terms are significant. The document has the best straight line; \
             the report has both, and the remainder"
                .to_owned(),
        );
    }
    few(stand, &taken, levels_deg_c.len(), settings, &mut warnings);
    warnings.extend(not_as_stated(best, document, settings.gravity, &own));
    let of_level = (0..levels_deg_c.len()).map(|level| one_level(&all, level)).collect();
    let returns = returns(&all, &plain, &found, &levels_deg_c);
    for (sensor, kind) in returns.iter().filter_map(|back| back.finding(&names)) {
        warnings.push(kind.of(accel_name(document, sensor)).to_string());
    }
    let analysis = Analysis {
        poses,
        levels_deg_c,
        fit: found,
        quadratic,
        of_level,
        reference_deg_c: reference,
        half_deg_c: half,
        range_deg_c: [low, high],
        sensors_deg_c: own,
        slopes_deg_c: slopes_deg_c(document, &plain).unwrap_or(document.temperature.assumed_deg_c),
        channels,
        weights,
        widened,
        returns,
        warnings,
    };
    sound(&analysis)?;
    Ok(analysis)
}

/// The poses of some runs.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Found {
    /// Poses with their positions' numbers.
    pub poses: Vec<(Pose, usize)>,
    /// What else those of a run may be.
    pub others: Vec<Other>,
    /// What is to be said of them.
    pub warnings: Vec<String>,
}

/// What the poses of a run may be as well.
#[derive(Debug, Clone, PartialEq)]
pub struct Other {
    /// Name of the run.
    run: String,
    /// Its first pose among all.
    from: usize,
    /// Positions of its poses.
    positions: Vec<usize>,
}

impl Other {
    /// Takes the poses for these positions, and keeps those that they were taken for.
    pub fn swap<'a>(&mut self, of_all: impl IntoIterator<Item = &'a mut usize>) {
        let own = of_all.into_iter().skip(self.from).zip(&mut self.positions);
        own.for_each(|(position, other)| std::mem::swap(position, other));
    }
}

/// The run whose positions contradict those of the other runs, taken for what else they may be: the fit with that, and what is to be said.
/// Of runs that tell it alike, the one that is then nearer to the plan's order. `None` where there is none.
fn contradicting<E>(
    (fit, taken): (&Fit, &[Taken]),
    others: &mut [Other],
    fit_of: impl Fn(&[Taken]) -> Result<Fit, E>,
) -> Option<((Vec<Taken>, Fit), String)> {
    let (before, degrees) = (fit.solution.chi_square, fit.solution.degrees);
    excess(before, degrees)?;
    let try_one = |(index, other): (usize, &Other)| {
        let (mut other, mut taken) = (other.clone(), taken.to_vec());
        let way = detour(other.positions.iter().copied());
        other.swap(taken.iter_mut().map(|taken| &mut taken.position));
        let longer = way.saturating_sub(detour(other.positions.iter().copied()));
        Some((index, longer, fit_of(&taken).ok()?))
    };
    let tried: Vec<(usize, usize, Fit)> = others.iter().enumerate().filter_map(try_one).collect();
    let least = tried.iter().map(|(.., fit)| fit.solution.chi_square).fold(f64::INFINITY, f64::min);
    // By how much χ² differs where it is no accident, as far as the positions scatter.
    let telling = -2.0 * libm::log(ACCIDENT) * (least / real(degrees)).max(1.0);
    let alike = tried.into_iter().filter(|(.., fit)| fit.solution.chi_square <= least + telling);
    let (index, _, fit) = alike.min_by_key(|(_, longer, _)| *longer)?;
    let after = fit.solution.chi_square;
    if after >= before - telling {
        return None;
    }
    let (other, mut taken) = (others.get_mut(index)?, taken.to_vec());
    other.swap(taken.iter_mut().map(|taken| &mut taken.position));
    let words = format!(
        "{}: in the order nearest to the plan's its positions contradict those of other logs (χ² {before:.0}): they are taken for those \
         half a turn about the vertical away (χ² {after:.0} with {} of freedom)",
        other.run,
        counted(degrees, "degree", "degrees")
    );
    Some(((taken, fit), words))
}

/// The poses of all runs that are positions of the plan, with the position's number.
///
/// # Errors
/// What is wrong with each run.
pub fn positions(tracks: &[Track], settings: &Settings) -> Result<Found, Vec<String>> {
    let mut found = Vec::new();
    let (mut others, mut warnings) = (Vec::new(), Vec::new());
    let (mut reasons, mut unclear) = (Vec::new(), Vec::new());
    for (run, track) in tracks.iter().enumerate() {
        if let Some(times) = &settings.times {
            match times.poses((track, run), &settings.plan, &settings.limits) {
                Ok(poses) => found.extend(poses),
                Err(words) => reasons.extend(words),
            }
            continue;
        }
        let intervals = still(track, &settings.limits, None);
        let poses = Pose::of(track, run, intervals);
        if poses.is_empty() {
            reasons.push(format!(
                "{}: the unit is never still for {} s after {} s of settling: reduce --least and --settle, or give \
                 the times with --times",
                track.run, settings.limits.least_s, settings.limits.settle_s
            ));
            continue;
        }
        match matched(&settings.plan, track, &poses) {
            Ok(Matched { labels, others: may_be, doubt }) => {
                warnings.extend(doubt.map(|words| format!("{}: {words}", track.run)));
                let none = labels.iter().filter(|position| position.is_none()).count();
                if none > 0 {
                    warnings.push(format!(
                        "{}: {none} of {} {} no position of the plan and left out",
                        track.run,
                        counted(poses.len(), "still pose", "still poses"),
                        if none == 1 { "is" } else { "are" }
                    ));
                }
                others.extend(may_be.into_iter().map(|labels| Other {
                    run: track.run.clone(),
                    from: found.len(),
                    positions: labels.into_iter().flatten().collect(),
                }));
                found.extend(
                    poses.into_iter().zip(labels).filter_map(|(pose, position)| Some((pose, position?))),
                );
            }
            Err(words) => unclear.push((track.run.as_str(), words)),
        }
    }
    // What is wrong with one log of many mostly is with all of them.
    if let Some(((first, words), others)) = unclear.split_first() {
        let others: Vec<&str> = others.iter().map(|(run, _)| *run).collect();
        let likewise =
            if others.is_empty() { String::new() } else { format!(". Likewise {}", faults::logs(&others)) };
        reasons.push(format!("{first}: {words}{likewise}"));
    }
    let poses: Vec<&Pose> = found.iter().map(|(pose, _)| pose).collect();
    reasons.extend(faults::clipped(tracks, &poses));
    if reasons.is_empty() && found.is_empty() {
        reasons.push("no position of the plan was found: is it the right --plan?".to_owned());
    }
    if reasons.is_empty() { Ok(Found { poses: found, others, warnings }) } else { Err(reasons) }
}

/// Intensities of the noise.
fn intensity(tracks: &[Track], poses: &[Pose]) -> Result<Vec<f64>, Vec<String>> {
    let found = intensities(tracks, poses);
    if found.iter().any(|intensity| intensity.is_nan()) {
        return Err(vec![
            "the positions are too short to measure the noise: each needs at least two seconds".to_owned(),
        ]);
    }
    // Without any noise a stand's errors alone would have to make a covariance that can be inverted.
    let floor = |(sensor, intensity): (usize, f64)| {
        let largest =
            poses.iter().filter_map(|pose| pose.outputs.get(sensor)).fold(0.0, |a: f64, b| a.max(b.abs()));
        intensity.max((1e-9 * largest).powi(2))
    };
    Ok(found.into_iter().enumerate().map(floor).collect())
}

/// A temperature by itself, where it has enough positions.
fn one_level(all: &Positions<'_>, level: usize) -> Option<Fit> {
    let own: Vec<Taken> = all.taken.iter().filter(|taken| taken.level == level).cloned().collect();
    guesses(all.plan, &own, all.guess.len()).ok().and_then(|_| all.alone(&own))
}
