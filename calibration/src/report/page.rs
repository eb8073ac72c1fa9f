//! The report as a page.

use std::collections::BTreeSet;

use isotherm_pages::{Axis, Chart, Ink, Mark, Page, Panel, Series, Table};
use isotherm_protocol::document::Sample;

use super::{Coefficient, Curve, Report, Verdict, stated};
use crate::fits::drift::spectrum::Spectrum;
use crate::numbers::{ends, once_each, real};

/// Most points of a curve on the page; of more, the smallest and the largest of each group are there.
const POINTS: usize = 4096;
/// Height of a panel of curves (CSS pixels).
const HEIGHT: u32 = 170;
/// Least range of temperature that is worth a diagram over it (°C).
const LEAST_DEG_C: f64 = 1.0;
/// Height of a panel of coefficients.
const LOW: u32 = 110;

impl Report {
    /// The report as a page that needs nothing beside it.
    pub fn to_html(&self) -> String {
        let mut page = Page::new(&self.heading());
        let verdict = |verdict: &Verdict| (verdict.sentence(), verdict.reason.clone());
        page.headlines(&self.verdicts.iter().map(verdict).collect::<Vec<_>>());
        self.notes.iter().for_each(|note| page.paragraph(note));
        if !self.warnings.is_empty() {
            page.heading("Warnings");
            self.warnings.iter().for_each(|warning| page.paragraph(warning));
        }
        // A document that is shown was not judged.
        let was_judged = self.verdicts.iter().any(Verdict::has_samples);
        if self.summary.is_some() || was_judged {
            let summary = if self.summary.is_some() { "Summary" } else { "Before and after" };
            section(&mut page, summary, &self.rows(false));
        }
        self.over_time(&mut page);
        self.over_temperature(&mut page);
        for (heading, chart) in &self.charts {
            page.heading(heading);
            page.chart(chart);
        }
        if !self.coefficients.is_empty() {
            page.heading("Coefficients");
            if let Some(chart) = coefficients(&self.coefficients) {
                page.chart(&chart);
            }
            page.table(&self.coefficient_rows());
        }
        if let Some(validation) = &self.validation {
            section(&mut page, "Cross-validation", validation);
        }
        if let Some(chart) = spectrum(&self.residuals) {
            page.heading("Spectrum of the residual");
            page.chart(&chart);
        }
        self.tables.iter().for_each(|(heading, rows)| section(&mut page, heading, rows));
        page.to_html()
    }

    fn over_time(&self, page: &mut Page) {
        let runs: BTreeSet<(&str, bool)> = self.residuals.iter().map(of_run).collect();
        if !runs.is_empty() {
            page.heading("Over time");
        }
        for run in runs {
            let curves: Vec<&Curve> = self.residuals.iter().filter(|curve| of_run(curve) == run).collect();
            let mut panels: Vec<Panel> = curves
                .iter()
                .map(|curve| {
                    let over = |values: &[f64]| thin(curve.time_s.iter().copied(), values);
                    let both = pair(over(&curve.before), over(&curve.after), Series::line);
                    Panel::of(&curve.of, &curve.measure, HEIGHT, both)
                })
                .collect();
            panels.extend(temperatures(&curves));
            let caption = format!("{}, {}: error before and after.", run.0, sample_words(run.1));
            page.chart(&Chart::of(caption, Axis::of("time since the run's beginning", "s"), panels));
        }
    }

    fn over_temperature(&self, page: &mut Page) {
        let chart = |outside: bool| {
            let own = self.residuals.iter().filter(|curve| (curve.sample == Sample::Out) == outside);
            let finite = |deg_c: &f64| deg_c.is_finite();
            let curves: Vec<&Curve> =
                own.filter(|curve| curve.temperature_deg_c.iter().any(finite)).collect();
            let [low, high] =
                ends(curves.iter().flat_map(|curve| curve.temperature_deg_c.iter().copied().filter(finite)));
            let names = once_each(curves.iter().map(|curve| (curve.of.as_str(), curve.measure.as_str())));
            let panel_of = |(of, measure): (&str, &str)| {
                let (mut before, mut after) = (Vec::new(), Vec::new());
                for curve in curves.iter().filter(|curve| curve.of == of) {
                    let over = |values: &[f64]| thin(curve.temperature_deg_c.iter().copied(), values);
                    before.extend(over(&curve.before));
                    after.extend(over(&curve.after));
                }
                Panel::of(of, measure, HEIGHT, pair(before, after, Series::dots))
            };
            let caption = format!("All runs {}: error before and after.", sample_words(outside));
            let panels = || names.into_iter().map(panel_of).collect();
            (high - low >= LEAST_DEG_C).then(|| Chart::of(caption, Axis::of("temperature", "°C"), panels()))
        };
        let charts: Vec<Chart> = [false, true].into_iter().filter_map(chart).collect();
        if !charts.is_empty() {
            page.heading("Over temperature");
        }
        for chart in &charts {
            page.chart(chart);
        }
    }
}

/// A heading with its table, if there is anything in it.
fn section(page: &mut Page, heading: &str, table: &Table) {
    if !table.rows.is_empty() {
        page.heading(heading);
        page.table(table);
    }
}

/// Run, and whether it is out of sample: those of the fit come first.
fn of_run(curve: &Curve) -> (&str, bool) {
    (&curve.run, curve.sample == Sample::Out)
}

fn sample_words(outside: bool) -> &'static str {
    if outside { "out of sample" } else { "in sample" }
}

/// Curves before and after, as a constructor of series draws them.
fn pair(
    before: Vec<(f64, f64)>,
    after: Vec<(f64, f64)>,
    drawn: fn(&'static str, Ink, Vec<(f64, f64)>) -> Series,
) -> Vec<Series> {
    vec![drawn("before", Ink::Raw, before), drawn("after", Ink::Corrected, after)]
}

/// The different temperatures of a run's curves.
fn temperatures(curves: &[&Curve]) -> Option<Panel> {
    let mut shown: Vec<&Curve> = Vec::new();
    for curve in curves.iter().filter(|curve| !curve.temperature_deg_c.is_empty()) {
        let bits = |curve: &Curve| curve.temperature_deg_c.iter().map(|t| t.to_bits()).collect::<Vec<_>>();
        if shown.iter().all(|other| bits(other) != bits(curve)) {
            shown.push(curve);
        }
    }
    let series = |(curve, ink): (&&Curve, Ink)| {
        let name = if shown.len() > 1 { format!("of {}", curve.of) } else { "temperature".to_owned() };
        Series::line(name, ink, thin(curve.time_s.iter().copied(), &curve.temperature_deg_c))
    };
    let series: Vec<Series> = shown.iter().zip(Ink::several()).map(series).collect();
    (!series.is_empty()).then(|| Panel::of("temperature", "°C", LOW, series))
}

/// Points, or the smallest and the largest of each group of them where they are many.
fn thin(places: impl Iterator<Item = f64>, values: &[f64]) -> Vec<(f64, f64)> {
    let points: Vec<(f64, f64)> = places.zip(values.iter().copied()).collect();
    if points.len() <= POINTS {
        return points;
    }
    let ends = |group: &[(f64, f64)]| {
        let indexed = || group.iter().enumerate().filter(|(_, point)| point.1.is_finite());
        let low = indexed().min_by(|a, b| a.1.1.total_cmp(&b.1.1));
        let high = indexed().max_by(|a, b| a.1.1.total_cmp(&b.1.1));
        let mut ends: Vec<(usize, &(f64, f64))> = low.into_iter().chain(high).collect();
        ends.sort_by_key(|(index, _)| *index);
        ends.into_iter().map(|(_, point)| *point).collect::<Vec<_>>()
    };
    points.chunks(points.len().div_ceil(POINTS / 2)).flat_map(ends).collect()
}

/// Coefficients with error bars, those of one unit of measure in one panel; `None` where none has a standard error.
fn coefficients(all: &[Coefficient]) -> Option<Chart> {
    let units = once_each(all.iter().map(|coefficient| coefficient.unit.as_str()));
    let place = |index: usize| real(index + 1);
    let of_unit = |unit: &str| {
        let mine = || all.iter().enumerate().filter(move |(_, coefficient)| coefficient.unit == unit);
        let values = mine().map(|(index, coefficient)| (place(index), coefficient.value));
        let known = mine().filter_map(|(index, coefficient)| {
            let sigma = coefficient.sigma.filter(|sigma| sigma.is_finite())?;
            Some((place(index), [coefficient.value, sigma]))
        });
        let zero = [(place(0), 0.0), (place(all.len().saturating_sub(1)), 0.0)];

        let content = vec![
            Series::line("zero", Ink::Faint, zero),
            bars("95 %", Ink::Alert, known),
            Series::dots("value", Ink::Corrected, values),
        ];
        // The unit of measure says it all.
        let title = if unit.is_empty() { "without unit" } else { "" };
        Panel::of(title, unit, LOW, content)
    };
    let mark = |(index, c): (usize, &Coefficient)| Mark {
        x: place(index),
        kind: "coefficient".to_owned(),
        words: {
            let sigma = c.sigma.map_or_else(String::new, |sigma| format!(" ± {}", super::short(sigma)));
            format!("{}: {}{sigma} {}", c.name, stated(c.value, c.sigma), c.unit)
        },
        ink: Ink::Faint,
    };
    let caption = "Coefficients by their number in the table; bars hold 95 %.";
    let panels = units.into_iter().map(of_unit).collect();
    all.iter().any(|coefficient| coefficient.sigma.is_some()).then(|| Chart {
        marks: all.iter().enumerate().map(mark).collect(),
        ..Chart::of(caption, Axis::of("number of the coefficient", ""), panels)
    })
}

/// Error bars that hold 95 %, at places with a value and its standard error.
pub(crate) fn bars(
    name: &'static str,
    ink: Ink,
    values: impl IntoIterator<Item = (f64, [f64; 2])>,
) -> Series {
    let bar = |(x, [value, sigma]): (f64, [f64; 2])| {
        let half = 1.96 * sigma;
        [(x, value - half), (x, value + half), (x, f64::NAN)]
    };
    Series::line(name, ink, values.into_iter().flat_map(bar))
}

/// Spectra before and after of each sensor: out of sample where there is such a run.
fn spectrum(curves: &[Curve]) -> Option<Chart> {
    let outside = curves.iter().any(|curve| curve.sample == Sample::Out);
    let deciding: Vec<&Curve> = curves
        .iter()
        .filter(|curve| (curve.sample == Sample::Out) == outside && curve.window_s > 0.0)
        .collect();
    let panel_of = |named: &Curve| {
        let of = |values: fn(&Curve) -> &[f64]| {
            let same = |curve: &&&Curve| {
                curve.of == named.of && curve.window_s.to_bits() == named.window_s.to_bits()
            };
            let pieces: Vec<&[f64]> =
                deciding.iter().filter(same).flat_map(|curve| pieces(values(curve))).collect();
            let spectrum = Spectrum::of(&pieces, 0.0, named.window_s)?;
            Some(spectrum.points().map(|(hz, density)| (hz, density.sqrt())).collect::<Vec<_>>())
        };
        let unit = format!("{}/√Hz", named.measure);
        let content = pair(of(|curve| &curve.before)?, of(|curve| &curve.after)?, Series::line);
        Some(Panel::of(&named.of, unit, HEIGHT, content).logarithmic())
    };
    let names = Curve::firsts(deciding.iter().copied());
    let panels: Vec<Panel> = names.into_iter().filter_map(panel_of).collect();
    let caption = format!(
        "Square root of the power spectral density of the window means, {}: a slope to the left is left by \
         temperature, a level is noise.",
        sample_words(outside)
    );
    (!panels.is_empty()).then(|| Chart::of(caption, Axis::of("frequency", "Hz").logarithmic(), panels))
}

/// Stretches without a gap.
fn pieces(values: &[f64]) -> impl Iterator<Item = &[f64]> {
    values.split(|value| !value.is_finite()).filter(|piece| !piece.is_empty())
}
