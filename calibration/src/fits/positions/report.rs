//! What is said of a calibration on a stand.

use isotherm_pages::Table;
use isotherm_protocol::document::{Document, Sample};

use super::charts::{axes_chart, bend, by_level, left_chart, shown};
use super::doubts::LARGEST_LEFT_SHARE;
use super::fit::{Analysis, Settings};
use super::hysteresis::Return;
use super::judged::{Judgement, curves, lengths};
use super::model::SMALL;
use super::solve::Fit;
use crate::axes::{AXES, across};
use crate::document::accel_name;
use crate::numbers::ARCSEC_PER_RAD;
use crate::report::{Curve, Report, Verdict, counted, fixed, or_dash, output_unit, per_deg_c, short, six};

/// A set of judged positions with the names of its runs.
#[derive(Debug, Clone, Copy)]
pub struct Set<'a> {
    /// The positions.
    pub judged: &'a [Judgement],
    /// Names of the runs.
    pub runs: &'a [String],
}

/// Everything that is said.
pub fn report(
    document: &Document,
    analysis: &Analysis,
    settings: &Settings,
    inside: Set<'_>,
    outside: Option<Set<'_>>,
) -> Report {
    let title = "Accelerometers from positions of a stand";
    let mut report = Report { counted: Some("positions"), ..Report::new(title, &document.unit) };
    report.residuals = curves(inside.judged, inside.runs, Sample::In);
    if let Some(set) = outside {
        report.residuals.extend(curves(set.judged, set.runs, Sample::Out));
    }
    report.verdicts = Curve::verdicts(&report.residuals);
    let [length, outside] = [Some(inside), outside].map(|set| set.map(|set| lengths(set.judged)));
    let length = Verdict::of_values("|f|−g", "m/s²", length.unwrap_or_default(), outside);
    report.verdicts.push(match far(&length, settings.gravity) {
        Some(words) => length.refused(words),
        None => length,
    });
    report.verdicts = as_a_whole(report.verdicts);
    report.warnings.clone_from(&analysis.warnings);
    report.notes = notes(document, analysis, settings);
    let names = (0..analysis.fit.guess.len()).map(|index| accel_name(document, index).to_owned());
    let names: Vec<String> = names.collect();
    coefficients(&mut report, document, (analysis, settings.gravity), &names);
    report.charts.push(("What is left".to_owned(), left_chart(settings, inside.judged)));
    report.tables.push(("Positions".to_owned(), position_rows(settings, inside)));
    if analysis.levels_deg_c.len() > 1 {
        report.tables.push(("Axes by temperature, ″".to_owned(), level_rows(analysis, &names)));
        report.charts.push(("Axes over temperature".to_owned(), axes_chart(analysis, &names)));
    }
    if !analysis.returns.is_empty() {
        let table = return_rows(analysis, &names, inside.runs);
        report.tables.push(("Axes after a thermal cycle: turn, ″".to_owned(), table));
    }
    report
}

/// By how much the axes turned from one visit of a temperature to the next.
fn return_rows(analysis: &Analysis, names: &[String], runs: &[String]) -> Table {
    let head = ["°C", "before", "after"].into_iter().chain(names.iter().map(String::as_str));
    let row = |back: &Return| {
        let logs = back.runs.map(|run| runs.get(run).cloned().unwrap_or_default());
        let turns = back.turns.iter().map(|[turn, sigma]| format!("{turn:.1} ± {sigma:.1}"));
        std::iter::once(fixed(back.deg_c, 1)).chain(logs).chain(turns).collect()
    };
    Table::of(head, analysis.returns.iter().map(row))
}

/// Words where far too much is left of |f| − g: no set of coefficients holds for these logs.
fn far(length: &Verdict, gravity: f64) -> Option<String> {
    let [_, after] = length.deciding();
    let share = after.rms / gravity;
    (share > LARGEST_LEFT_SHARE).then(|| {
        format!(
            "{} % of g remain{}, at most {} % is accepted: check that unit of measure and unit are the same",
            short(100.0 * share),
            if length.out_of_sample.is_some() { " in the log that judges" } else { "" },
            100.0 * LARGEST_LEFT_SHARE
        )
    })
}

/// K, S and C of all accelerometers are of one mounting of the unit and of the same temperatures: with one axis all are refused.
fn as_a_whole(verdicts: Vec<Verdict>) -> Vec<Verdict> {
    let bad: Vec<String> =
        verdicts.iter().filter(|verdict| !verdict.accepted).map(|verdict| verdict.of.clone()).collect();
    let with = |verdict: Verdict| {
        if bad.is_empty() || !verdict.accepted {
            return verdict;
        }
        verdict.refused(format!(
            "K, S and C of all accelerometers are one fit, accepted as a whole, and {} is refused",
            bad.join(", ")
        ))
    };
    verdicts.into_iter().map(with).collect()
}

fn notes(document: &Document, analysis: &Analysis, settings: &Settings) -> Vec<String> {
    let fit = &analysis.fit.solution;
    let levels: Vec<String> = analysis.levels_deg_c.iter().map(|t| fixed(*t, 1)).collect();
    let arcsec = |rad: f64| rad * ARCSEC_PER_RAD;
    let noise: Vec<String> = analysis.weights.intensity.iter().map(|q| short(*q)).collect();
    let mut notes = vec![
        format!(
            "{} at {} °C; g = {} m/s²; C about {} °C.",
            counted(analysis.poses.len(), "position", "positions"),
            levels.join(", "),
            six(settings.gravity),
            six(analysis.reference_deg_c)
        ),
        format!(
            "Weighted with a stand of {:.1}″ (positioning and run-out) and white noise of {} ({})²·s; level known to {:.0}″ \
             beforehand. χ² {:.1} with {} of freedom.",
            arcsec(analysis.weights.positioning_rad),
            noise.join(", "),
            output_unit(document),
            arcsec(analysis.weights.levelling_rad),
            fit.chi_square,
            counted(fit.degrees, "degree", "degrees")
        ),
    ];
    if let Some((_, chi_square, terms, accident)) = &analysis.quadratic {
        notes.push(format!(
            "Quadratic terms of C: χ² {chi_square:.1} with {terms} of them, by chance with probability {}; the \
             straight line of the document is off by {:.1}″ at most.",
            short(*accident),
            arcsec(bend(analysis))
        ));
    }
    notes
}

fn coefficients(
    report: &mut Report,
    document: &Document,
    (analysis, gravity): (&Analysis, f64),
    names: &[String],
) {
    let fit = &analysis.fit;
    let output = output_unit(document);
    let by_power = |power: usize| analysis.half_deg_c.powi(-i32::try_from(power).unwrap_or(0));
    for (index, (name, sensor)) in names.iter().zip(&fit.sensors).enumerate() {
        let guess = fit.guess[index].scale;
        let mut place = index * fit.degrees.of_sensor();
        let per_input = format!("{output}/(m/s²)");
        for (letter, values, unit, per) in
            [("K", &sensor.scale, per_input.as_str(), gravity), ("S", &sensor.bias, output, 1.0)]
        {
            for (power, value) in values.iter().enumerate() {
                let factor = by_power(power);
                let sigma = fit.solution.sigma(place) * SMALL * (guess / per * factor) * analysis.widened;
                let name = format!("accelerometer {name} {letter}{power}");
                report.coefficient(name, per_deg_c(unit, power), value * factor / per, sigma);
                place += 1;
            }
        }
    }
    let mut axes = |fit: &Fit, from: usize, what: &str| {
        for (index, (name, sensor)) in names.iter().zip(&fit.sensors).enumerate() {
            for (power, row) in sensor.axis.iter().enumerate().skip(from) {
                let factor = by_power(power) * ARCSEC_PER_RAD;
                let sigma = fit.axis_sigma(index, power);
                for i in across(&sensor.axis[0]) {
                    let name = format!("accelerometer {name} C{power}{what} along {}", AXES[i]);
                    let sigma = sigma[i] * factor * analysis.widened;
                    report.coefficient(name, per_deg_c("″", power), row[i] * factor, sigma);
                }
            }
        }
    };
    axes(fit, 0, "");
    if let Some((quadratic, ..)) = &analysis.quadratic {
        axes(quadratic, 1, " (quadratic form)");
    }
    for (index, (value, sigma)) in fit.stand.iter().enumerate() {
        let (value, sigma) = (value * ARCSEC_PER_RAD, sigma * ARCSEC_PER_RAD * analysis.widened);
        report.coefficient(format!("stand δ{}", index + 1), "″", value, sigma);
    }
}

fn position_rows(settings: &Settings, set: Set<'_>) -> Table {
    let head = ["position", "log", "at, s", "°C", "x, mg", "y, mg", "z, mg", "|f| − g, mg"];
    let row = |judgement: &Judgement| {
        let position = settings.plan.positions.get(judgement.position);
        let milli_g = |error: f64| fixed(error / settings.gravity * 1e3, 4);
        let mut row = vec![
            position.map_or_else(String::new, |position| position.name.clone()),
            set.runs.get(judgement.run).cloned().unwrap_or_default(),
            format!("{:.1}", judgement.time_s),
            or_dash(judgement.deg_c.is_finite().then(|| fixed(judgement.deg_c, 2))),
        ];
        row.extend(judgement.error[1].map(milli_g));
        row.push(milli_g(judgement.length[1]));
        row
    };
    Table::of(head, set.judged.iter().map(row))
}

fn level_rows(analysis: &Analysis, names: &[String]) -> Table {
    let shown = shown(analysis);
    let elements = shown.iter().map(|(index, i)| format!("{} along {}", names[*index], AXES[*i]));
    let columns: Vec<_> = shown.iter().map(|element| by_level(analysis, *element)).collect();
    let row = |(level, deg_c): (usize, &f64)| {
        let cell = |column: &Vec<(f64, Option<[f64; 2]>)>| {
            or_dash(column[level].1.map(|[value, sigma]| format!("{} ± {sigma:.1}", fixed(value, 1))))
        };
        std::iter::once(fixed(*deg_c, 2)).chain(columns.iter().map(cell)).collect()
    };
    let head = std::iter::once("°C".to_owned()).chain(elements);
    Table::of(head, analysis.levels_deg_c.iter().enumerate().map(row))
}
