//! A document judged on logs that it was not made from.
//!
//! Every run is corrected twice by the service's own code: with the document, and with what is left of it when everything
//! that knows of temperature, bias or mode is taken out ("nominal"). Along each case axis what is left is averaged over
//! windows; an axis that the document makes larger than the nominal one is refused. A log whose digest stands in the
//! document's origin counts as in sample, and decides nothing where another is there.

mod coverage;
mod runs;

use isotherm_correction::earth::Place;
use isotherm_correction::units::AngularRate;
use isotherm_protocol::document::{Document, Sample};

use crate::axes::{AXES, output_name};
use crate::document::Written;
use crate::error::Error;
use crate::fits::thermal::Stand;
use crate::fits::thermal::checks::{far, frozen, judging, quiet};
use crate::numbers::{Size, dot, is_white, norm, real};
use crate::report::{Curve, FLAT, Report, Rest, SAME_SHARE, Verdict, counted, short, six};
use crate::runs::swapped::{Shown, at_opposite_latitude, by_curves, force_at_rest, moved};
use crate::runs::table::{Rows, Table, earth_rate, is_one_g, usual_window_s};
use coverage::Coverage;
pub use runs::JudgedLog;

/// How a document is judged.
#[derive(Debug, Clone, Copy)]
pub struct Wanted {
    /// Length of the windows (s); without it as [`usual_window_s`] has it for the longest log.
    pub window_s: Option<f64>,
    /// Where the unit is and how it stands, where that is known.
    pub place: Option<Place>,
}

/// Length of the windows in short logs (s).
const WINDOW_S: f64 = 10.0;
/// By how much a figure may change where the document says nothing of it: rounding of sums.
const SAME: f64 = 1e-9;
/// Share of the deviation of the most lively axis below which a sensor is dead: what is left comes through the axes.
const DEAD: f64 = 1e-3;
/// Fewest windows that judge: less their mean, fewer say nothing.
const FEWEST_WINDOWS: usize = 3;
/// Share of windows that should be whole.
const WHOLE: f64 = 0.9;
/// Least part of the Earth's rate that is told of what is left, and what else there may be beside it.
const EARTH_LEFT: [f64; 2] = [0.5, 0.1];
/// Largest mean rate, and range of mean rates, of a unit that counts as being at rest (°/h): 5 °/s.
const REST_RATE_DEG_PER_H: f64 = 18_000.0;
/// Largest angle between mean specific forces of a unit that counts as being at rest (sine).
const REST_TILT: f64 = 0.035;

/// Judges a document on the runs of one unit.
///
/// # Errors
/// [`Error::Refused`] where the runs do not allow it: of another unit, nothing in them, not at rest.
pub fn validate(written: &Written, logs: &[JudgedLog], wanted: Wanted) -> Result<Report, Error> {
    let Written { name, document, .. } = written;
    let bare = Written::compiled(&document.nominal())?;
    let mut report = Report::new(format!("Judgement of {name}"), document.unit.clone());
    let mut coverage = Coverage::of(written);
    let mut readings = Vec::new();
    for log in logs {
        let run = &log.run;
        if run.unit.to_string() != document.unit {
            return Err(Error::refused(format!(
                "{} is of unit {}, {name} is for unit {}: give the log with its own document",
                run.name, run.unit, document.unit
            )));
        }
        let series = run.series()?;
        let at_rest = Stand::default();
        let mut faults = judging(&run.name, &series, &at_rest);
        faults.extend(frozen(&run.name, &series, document));
        let (found, left_out) =
            far(&run.name, &series, (document, &at_rest), wanted.window_s.unwrap_or(WINDOW_S));
        faults.extend([found.refusals, found.warnings].concat());
        readings.push((faults, series.gyros.length_s(), left_out));
    }
    let longest_s = readings.iter().map(|(_, length_s, _)| *length_s).fold(0.0, f64::max);
    let window_s = wanted.window_s.unwrap_or_else(|| usual_window_s(longest_s, WINDOW_S));
    for (log, (faults, length_s, left_out)) in logs.iter().zip(readings) {
        let run = &log.run.without(left_out);
        let documents = [written.loaded.clone(), bare.clone()];
        let rows = Rows::mostly_valid(window_s);
        let seen = |tick: &_, unit: &_| coverage.count(tick, unit);
        let tables = Table::together_seen(run, &documents, rows, seen)?;
        let [after, nominal] = <[Table; 2]>::try_from(tables).unwrap_or_default();
        if let Some(reason) = no_windows(&run.name, name, (&after, length_s)) {
            return Err(Error::Refused([vec![reason], after.troubles, faults].concat()));
        }
        if let Some(reason) = at_rest(&run.name, &after) {
            return Err(Error::Refused([vec![reason], faults].concat()));
        }
        report.warnings.extend(faults);
        let rest = rest(&run.name, &after, wanted.place.as_ref())?;
        let sample = if log.known { Sample::In } else { Sample::Out };
        let curves = Curve::of_tables(&run.name, sample, [&nominal, &after], document, &rest);
        report.warnings.extend(doubts(&run.name, &curves, &after));
        report.warnings.extend(quiet(&run.name, (0..3).map(|axis| nominal.rate(axis))));
        report.warnings.extend(earth_left(&run.name, &curves, &rest));
        report.warnings.extend(curves_swapped(&run.name, &curves));
        report.warnings.extend(looks_swapped(&run.name, &nominal, (&rest, wanted.place.as_ref())));
        report.residuals.extend(curves);
        report.warnings.extend(after.troubles.iter().map(|words| format!("{}: {words}", run.name)));
        if log.known {
            report.warnings.push(format!(
                "{} is one of the logs that the document was made from: it counts as in sample, whichever part of it was \
                 fitted",
                run.name
            ));
        }
    }
    if let Some(channels) = coverage.silent() {
        let deaf = format!(
            "{name} follows the temperatures {channels}, of which the logs have no reading: is it the document of this \
             unit?"
        );
        return Err(Error::Refused([vec![deaf], report.warnings].concat()));
    }
    report.verdicts = Curve::verdicts(&report.residuals);
    let liveliest = |of: &Verdict| {
        let alike = report.verdicts.iter().filter(|verdict| verdict.measure == of.measure);
        alike.map(|verdict| verdict.deciding()[0].deviation).fold(0.0, f64::max)
    };
    let limits: Vec<f64> = report.verdicts.iter().map(|verdict| DEAD * liveliest(verdict)).collect();
    for (verdict, limit) in report.verdicts.iter_mut().zip(limits) {
        let [before, after] = verdict.deciding();
        if before.count > 1 && before.deviation <= limit {
            *verdict = verdict
                .clone()
                .refused("its reading is constant: the sensor is dead, or its column is wrong");
        } else if verdict.accepted && (after.rms - before.rms).abs() <= before.rms * SAME {
            let mine = report.residuals.iter().filter(|curve| curve.of == verdict.of);
            let flat = mine.flat_map(|curve| curve.before.iter().copied()).collect::<Vec<f64>>();
            verdict.reason = if is_white(&flat) {
                format!("{FLAT}; left unchanged")
            } else {
                "the document does not change it".to_owned()
            };
        } else if verdict.accepted && (after.rms - before.rms).abs() <= before.rms * SAME_SHARE {
            "unchanged within 1 %".clone_into(&mut verdict.reason);
        }
    }
    missing(document, &mut report)?;
    report.notes = notes(&report.residuals, logs, (window_s, wanted.place.is_some()));
    report.warnings.extend(coverage.warnings());
    report.tables.extend(coverage.tables());
    Ok(report)
}

/// Why a run of such a length (s) cannot judge: too few windows, or none with a rate.
fn no_windows(run: &str, document: &str, (table, length_s): (&Table, f64)) -> Option<String> {
    let (count, window_s) = (table.len(), six(table.window_s));
    let good_s: f64 = table.taken_s[0].iter().sum();
    if count < FEWEST_WINDOWS {
        return Some(format!(
            "{run}: {} s long, {} of {window_s} s, at least {FEWEST_WINDOWS} are needed to judge: give a longer log, or --window {} \
             or less",
            six(length_s),
            counted(count, "window", "windows"),
            short(0.33 * length_s)
        ));
    }
    let is_empty = (0..3).all(|axis| Size::of(table.rate(axis)).count == 0);
    is_empty.then(|| {
        if good_s > 0.0 {
            format!(
                "{run}: no window of {window_s} s is complete, though {} s of rates are valid: look for gaps and flags with \
                 isotherm-replay correct, or choose a shorter --window",
                short(good_s)
            )
        } else {
            format!(
                "{run}: {document} gives no valid rate for any gyro tick: check that it is the document of this unit, \
                 and the mapping"
            )
        }
    })
}

/// What a run's curves show of sensors that do not work, and of gaps.
fn doubts(name: &str, curves: &[Curve], means: &Table) -> Vec<String> {
    let mut doubts = Vec::new();
    if let Some(force) = means.mean_force() {
        let length = norm(force);
        if !is_one_g(length) {
            doubts.push(format!(
                "{name}: the mean specific force is {} m/s², gravity is 9.76 to 9.84: check the unit of the columns, \
                 their order, and the document",
                short(length)
            ));
        }
    }
    for curve in curves {
        let of = &curve.of;
        let [before, _] = curve.sizes();
        let share = real(before.count) / real(curve.before.len().max(1));
        if share < WHOLE {
            doubts.push(format!(
                "{name}: {of}: {:.0} % of the windows have gaps or flags and are left out",
                (1.0 - share) * 100.0
            ));
        }
    }
    doubts
}

/// Columns that look swapped, where the attitude is known.
fn looks_swapped(name: &str, means: &Table, (rest, place): (&Rest, Option<&Place>)) -> Vec<String> {
    let sizes = |column: fn(&Table, usize) -> &[f64]| [0, 1, 2].map(|axis| Size::of(column(means, axis)));
    let (rates, forces) = (sizes(Table::rate), sizes(Table::force));
    let force = place.and_then(force_at_rest);
    let opposite = rest.rate_deg_per_h.zip(force.or(means.mean_force()));
    let opposite = opposite.map(|(earth, force)| at_opposite_latitude(earth, force));
    let gyros =
        rest.rate_deg_per_h.map(|earth| Shown::of(["gyros", "°/h"], rates, earth).or_opposite(opposite));
    let accels = force.map(|force| Shown::of(["accelerometers", "m/s²"], forces, force));
    let looks = [gyros, accels].into_iter().flatten().filter_map(|shown| shown.swapped());
    looks.map(|looks| format!("{name}: {looks}")).collect()
}

/// The curves of the three axes of a kind.
fn three(curves: &[Curve], gyro: bool) -> Option<[&Curve; 3]> {
    let of = |axis: usize| curves.iter().find(|curve| curve.of == output_name(gyro, axis));
    Some([of(0)?, of(1)?, of(2)?])
}

/// Columns that look swapped, by the curves over temperature that the document takes off.
fn curves_swapped(name: &str, curves: &[Curve]) -> Vec<String> {
    let words = |(gyro, kind): (bool, &str)| {
        let own = three(curves, gyro)?;
        let (order, [left, other]) = by_curves(own.map(|curve| [&*curve.before, &*curve.after]))?;
        Some(format!(
            "{name}: {kind} {} look swapped: with the document's curves over temperature they leave {} {} rms, with each other's {}; \
             check the columns in the mapping",
            moved(order),
            short(left),
            own[0].measure,
            short(other)
        ))
    };
    [(true, "gyros"), (false, "accelerometers")].into_iter().filter_map(words).collect()
}

/// That the Earth's rate is what is left of the gyros in a stated attitude, with how many times of it.
fn earth_left(name: &str, curves: &[Curve], rest: &Rest) -> Option<String> {
    let earth = rest.rate_deg_per_h?;
    let left = three(curves, true)?.map(|curve| curve.sizes()[1].mean);
    let times = dot(left, earth) / dot(earth, earth);
    let beside = norm([0, 1, 2].map(|axis| left[axis] - times * earth[axis]));
    (times.abs() > EARTH_LEFT[0] && beside < EARTH_LEFT[1] * norm(earth)).then(|| {
        format!(
            "{name}: what is left of the gyros is {times:.2} times the Earth's rate of the stated place (-1: the output lacks it, -2: it has \
             the wrong sign): check weights and signs in document and mapping, and the attitude"
        )
    })
}

/// Why a run cannot judge in which the unit was moved: what is left would be its motion.
fn at_rest(name: &str, means: &Table) -> Option<String> {
    let refuse = |what: String| {
        Some(format!(
            "{name}: the unit was not at rest: {what}. Cut the log to the part at rest with --start and --duration"
        ))
    };
    for (axis, of) in AXES.into_iter().enumerate() {
        let Size { mean, peak_to_peak: range, .. } = Size::of(means.rate(axis));
        if range > REST_RATE_DEG_PER_H {
            return refuse(format!(
                "the mean rate about {of} covers {} °/s, at most 5 °/s are drift",
                short(range / 3600.0)
            ));
        }
        if mean.abs() > REST_RATE_DEG_PER_H {
            return refuse(format!(
                "the mean rate about {of} is {} °/s, at most ±5 °/s are bias",
                short(mean / 3600.0)
            ));
        }
    }
    let mean @ [a, b, c] = means.mean_force()?;
    let forces = means.force(0).iter().zip(means.force(1)).zip(means.force(2));
    let sines =
        forces.filter(|((x, y), z)| x.is_finite() && y.is_finite() && z.is_finite()).map(|((x, y), z)| {
            norm([b * z - c * y, c * x - a * z, a * y - b * x]) / (norm(mean) * norm([*x, *y, *z]))
        });
    let largest = sines.filter(|sine| sine.is_finite()).fold(0.0, f64::max);
    if largest > REST_TILT {
        let degrees = libm::asin(largest.min(1.0)).to_degrees();
        return refuse(format!("the specific force turns by {} °, at most 2 ° are drift", short(degrees)));
    }
    None
}

/// What the unit would put out without error.
fn rest(name: &str, means: &Table, place: Option<&Place>) -> Result<Rest, Error> {
    let Some(place) = place else { return Ok(Rest::default()) };
    let rate = earth_rate(place, means.mean_force()).map_err(|error| error.of(name))?;
    let rate = rate.map(|rate| AngularRate::from_rad_per_s(rate).as_deg_per_h());
    Ok(Rest { rate_deg_per_h: Some(rate), ..Rest::default() })
}

/// Axes that nothing can be said of.
fn missing(document: &Document, report: &mut Report) -> Result<(), Error> {
    let accels = document.accel.is_some().then_some("accelerometer");
    for kind in ["gyro"].into_iter().chain(accels) {
        let has = |axis: &str| report.verdicts.iter().any(|verdict| verdict.of == format!("{kind} {axis}"));
        let gone: Vec<&str> = AXES.into_iter().filter(|axis| !has(axis)).collect();
        if !gone.is_empty() {
            let (axes, with) = (gone.join(", "), gone.len());
            report.warnings.push(format!(
                "{kind} {axes}: no window is complete and without flags, so {} cannot be judged: check the flags \
                 with isotherm-replay correct, and choose a shorter --window if the log has gaps",
                if with == 1 { "it" } else { "they" }
            ));
        }
    }
    if report.verdicts.is_empty() {
        return Err(Error::Refused(std::mem::take(&mut report.warnings)));
    }
    Ok(())
}

/// What was done, in sentences.
fn notes(curves: &[Curve], logs: &[JudgedLog], (window_s, placed): (f64, bool)) -> Vec<String> {
    let names = |known: bool| -> Vec<String> {
        logs.iter().filter(|log| log.known == known).map(|log| log.run.name.clone()).collect()
    };
    let (outside, inside) = (names(false), names(true));
    let length = |curve: &Curve| curve.time_s.last().copied().unwrap_or(0.0);
    let hours = curves.iter().filter(|curve| curve.of == "gyro x").map(length).sum::<f64>() / 3600.0;
    let mut notes = vec![format!(
        "Before is nominal: the document without its temperature, bias and mode terms. Means over {} s, {} h.",
        short(window_s),
        short(hours)
    )];
    if !outside.is_empty() {
        notes.push(format!("Out of sample: {}.", outside.join(", ")));
    }
    if !inside.is_empty() {
        notes.push(format!("In sample (the document was made from them): {}.", inside.join(", ")));
    }
    notes.push(if placed {
        "Removed: Earth's rate from the rates, the mean over the run from each specific force.".to_owned()
    } else {
        "Each axis' mean over the run is removed, before and after: a constant bias is not judged. With --latitude \
         and --heading that of the gyros is."
            .to_owned()
    });
    notes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_earths_rate_that_is_left_is_told_with_its_sign() {
        let earth = [7.4, -6.2, -11.5];
        let rest = Rest { rate_deg_per_h: Some(earth), ..Rest::default() };
        let told = |times: f64, beside: f64| {
            let curve = |axis: usize| Curve {
                of: output_name(true, axis),
                measure: "°/h".to_owned(),
                run: "log.csv".to_owned(),
                sample: Sample::Out,
                window_s: 10.0,
                time_s: [0.0].into(),
                temperature_deg_c: Vec::new(),
                before: vec![0.0],
                after: vec![times * earth[axis] + if axis == 0 { beside } else { 0.0 }],
            };
            earth_left("log.csv", &[0, 1, 2].map(curve), &rest)
        };
        assert_eq!((told(-0.02, 0.0), told(-1.0, 9.0)), (None, None));
        insta::assert_snapshot!([told(-1.0, 0.3), told(-2.0, 0.0)].map(Option::unwrap).join("\n"));
    }
}
