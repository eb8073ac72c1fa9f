//! What is doubtful about a result, and what makes it none.

use isotherm_protocol::document::Document;
use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::faults;
use super::fit::{Analysis, Settings};
use super::model::{self, Degrees, Taken};
use super::plan::Plan;
use super::pose::Pose;
use super::sense::of_accelerometers;
use super::solve::Fit;
use crate::axes::{AXES, sensor_name, several};
use crate::document::scale_at;
use crate::lsq::linear;
use crate::lsq::nonlinear::NoSolution;
use crate::numbers::{ARCSEC_PER_RAD, grouped, mean, once_each, real};
use crate::report::{counted, short};

/// Fewest positions that tell the stand's errors from the axes.
pub const GOOD_POSITIONS: usize = 9;
/// Probability below which something is no accident.
pub(super) const ACCIDENT: f64 = 1e-3;
/// Largest |f| − g (rms, a share of g) where the fit decides.
pub(crate) const LARGEST_LEFT_SHARE: f64 = 0.02;
/// Largest standard error of a scale factor that is still a result (relative).
const LARGEST_SIGMA: f64 = 1e-2;
/// Largest angle between an axis and where the document at hand has it (°): half of a skewed unit's way to the next one.
pub const LARGEST_TURN_DEG: f64 = 30.0;

/// χ² of the quadratic terms of C, and their number.
pub(super) fn quadratic_terms(fit: &Fit) -> (f64, usize) {
    let index = fit.degrees.axes_indices(fit.guess.len(), 2);
    let terms = index.iter().map(|index| fit.solution.parameters[*index] * model::SMALL);
    let terms = nalgebra::DVector::from_iterator(index.len(), terms);
    (linear::chi_square(&terms, &fit.axes_covariance(2)).unwrap_or(0.0), index.len())
}

/// Probability that χ² is at least so large by accident.
pub(super) fn survival(chi_square: f64, degrees: usize) -> f64 {
    ChiSquared::new(real(degrees)).map_or(1.0, |law| law.sf(chi_square))
}

/// χ² per degree of freedom where it is larger than by accident.
pub(super) fn excess(chi_square: f64, degrees: usize) -> Option<f64> {
    let per_degree = chi_square / real(degrees);
    (degrees > 0 && per_degree > 1.0 && survival(chi_square, degrees) < ACCIDENT).then_some(per_degree)
}

/// Factor by which standard errors are widened where the positions scatter more than they should.
pub(super) fn widening(fit: &Fit, warnings: &mut Vec<String>) -> f64 {
    let (chi_square, degrees) = (fit.solution.chi_square, fit.solution.degrees);
    let Some(per_degree) = excess(chi_square, degrees) else { return 1.0 };
    let factor = per_degree.sqrt();
    warnings.push(format!(
        "the positions scatter {factor:.1} times as much as positioning, run-out and noise explain (χ² \
         {chi_square:.0} with {} of freedom); all standard errors are widened by this. Check the largest residuals: \
         a position mistaken for another, a unit not settled, a stand worse than --positioning and --run-out",
        counted(degrees, "degree", "degrees")
    ));
    factor
}

/// Runs whose poses were found in another order than that of the plan; a position that is taken again is none.
pub(super) fn reordered(plan: &Plan, poses: &[(Pose, usize)], names: &[String]) -> Vec<String> {
    const SHOWN: usize = 3;
    let name = |position: usize| &plan.positions[position].name;
    let told = names.iter().enumerate().filter_map(|(run, log)| {
        let own = poses.iter().filter(|(pose, _)| pose.run == run).map(|(_, position)| *position);
        let own = once_each(own);
        let back = own.windows(2).filter(|pair| pair[1] < pair[0]);
        let words: Vec<String> =
            back.map(|pair| format!("{} after {}", name(pair[1]), name(pair[0]))).collect();
        let more = words.len().saturating_sub(SHOWN);
        let others = if more > 0 { format!(" and {more} more") } else { String::new() };
        (!words.is_empty()).then(|| (log.as_str(), words[..words.len() - more].join(", ") + &others))
    });
    grouped(told)
        .into_iter()
        .map(|(words, runs)| {
            format!("{}: positions in another order than the plan's: {words}", faults::logs(&runs))
        })
        .collect()
}

/// What few, missing and repeated positions mean.
pub(super) fn few(
    plan: &Plan,
    taken: &[Taken],
    levels: usize,
    settings: &Settings,
    warnings: &mut Vec<String>,
) {
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
            warnings.push(format!("{at}repeated positions, all of them used: {}", repeated.join(", ")));
        }
    }
    let different =
        (0..plan.positions.len()).filter(|p| taken.iter().any(|taken| taken.position == *p)).count();
    if plan.has_stand() && different < GOOD_POSITIONS {
        warnings.push(format!(
            "{} not separate the stand's level from the axes, {GOOD_POSITIONS} or more do: the standard errors of C \
             include --levelling ({:.0}″)",
            if different == 1 { "1 position does".to_owned() } else { format!("{different} different positions do") },
            settings.levelling_rad * ARCSEC_PER_RAD
        ));
    }
}

/// Axes that lie far from where the document at hand has them (swapped columns, a sign, or another mounting), and scale factors that are
/// not those of the unit of measure that it states; `own` are the temperatures that each accelerometer was taken at (°C).
pub(super) fn not_as_stated(fit: &Fit, document: &Document, gravity: f64, own: &[Vec<f64>]) -> Vec<String> {
    let Some(accel) = &document.accel else { return Vec::new() };
    let stated = accel.sensor.iter().zip(own).map(|(sensor, deg_c)| scale_at(sensor, mean(deg_c)));
    let stated: Vec<f64> = stated.collect();
    let scale: Vec<f64> = fit.sensors.iter().map(|sensor| sensor.scale[0] / gravity).collect();
    let rows: Vec<[f64; 3]> = fit.sensors.iter().map(|sensor| sensor.axis[0]).collect();
    let (elsewhere, measure) = of_accelerometers(accel, [&scale, &stated], &rows);
    let mounted = "Or is the unit mounted differently from the plan?";
    elsewhere.map(|words| format!("{words}. {mounted}")).into_iter().chain(measure).collect()
}

/// Axes that none of some positions shows up or down, such as "none has x up", or what to say where there are none.
pub(super) fn unseen(plan: &Plan, positions: &[usize], none: &str, otherwise: &str) -> String {
    let seen = |axis: usize, sign: f64| {
        positions.iter().any(|position| sign * plan.up(*position, [0.0; 3])[axis] > 0.5)
    };
    let ways = (0..3).flat_map(|axis| [(axis, 1.0, "up"), (axis, -1.0, "down")]);
    let unseen = ways.filter(|(axis, sign, _)| !seen(*axis, *sign));
    let unseen: Vec<String> = unseen.map(|(axis, _, way)| format!("{} {way}", AXES[axis])).collect();
    if unseen.is_empty() { otherwise.to_owned() } else { format!("{none} has {}", unseen.join(", ")) }
}

/// Sensors whose positions do not spread, in words.
pub(super) fn spread(plan: &Plan, taken: &[Taken], (bad, sensors): (&[usize], usize)) -> Vec<String> {
    let positions: Vec<usize> = taken.iter().map(|taken| taken.position).collect();
    let otherwise = "the outputs do not follow the positions: check the plan and the columns of the mapping";
    let lacking = unseen(plan, &positions, "no position", otherwise);
    vec![format!(
        "{} not determine scale factor, bias and axis of {}: {lacking}",
        counted(taken.len(), "position does", "positions do"),
        several("accelerometer", bad, sensors)
    )]
}

/// Whether what was found is a result.
pub(super) fn sound(analysis: &Analysis) -> Result<(), Vec<String>> {
    let fit = &analysis.fit;
    let sigma = |sensor: usize| {
        fit.solution.sigma(sensor * fit.degrees.of_sensor()) * model::SMALL * analysis.widened
    };
    let bad: Vec<usize> = (0..fit.guess.len())
        .filter(|sensor| sigma(*sensor).is_nan() || sigma(*sensor) > LARGEST_SIGMA)
        .collect();
    if bad.is_empty() {
        return Ok(());
    }
    let known: Vec<String> = bad.iter().map(|sensor| short(sigma(*sensor) * 100.0)).collect();
    let why = if analysis.widened > 1.0 {
        format!(
            "the positions scatter {} times as much as positioning, run-out and noise explain. Is a position \
             mistaken for another (--times, --plan), does the unit of measure change between or within logs, did \
             zeros drift?",
            short(analysis.widened)
        )
    } else {
        "use longer or more positions, and check the noise of the sensors".to_owned()
    };
    Err(vec![format!(
        "{}: {} known only to {} %, at most {} % is accepted: {why}",
        several("accelerometer", &bad, fit.guess.len()),
        if bad.len() == 1 { "its scale factor is" } else { "their scale factors are" },
        known.join(", "),
        LARGEST_SIGMA * 100.0
    )])
}

/// No solution, in words.
pub(super) fn no_solution(why: &NoSolution, degrees: Degrees, sensors: usize) -> String {
    let (own, of_sensor) = (degrees.sensor + 1, degrees.of_sensor());
    let name = |index: usize| {
        let (sensor, place) = (index / of_sensor, index % of_sensor);
        if sensor >= sensors {
            return format!("the stand's δ{}", index - sensors * of_sensor + 1);
        }
        let (what, power) = match place {
            place if place < own => ("the scale factor", place),
            place if place < 2 * own => ("the bias", place - own),
            place => ("the axis", (place - 2 * own) % (degrees.axes + 1)),
        };
        let over = if power > 0 { " over temperature" } else { "" };
        format!("{what} of accelerometer {}{over}", sensor_name(sensor, sensors))
    };
    why.words(
        "the positions",
        name,
        "take each axis up and down at each temperature, in two orientations",
        "no scale factors, biases and axes fit all positions: check the plan, every column of the mapping, and that \
         the unit of measure is the same throughout",
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_not_found_is_said_in_plain_words() {
        let degrees = Degrees { sensor: 1, axes: 1 };
        let of = |why: NoSolution| no_solution(&why, degrees, 3);
        let mut told = vec![of(NoSolution::NoMinimum)];
        told.extend([0, 11, 20, 25].map(|index| of(NoSolution::NotDetermined(index))));
        insta::assert_snapshot!(told.join("\n"));
    }
}
