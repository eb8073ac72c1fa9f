//! The HTML report of a log's noise and drift.

use isotherm_pages::{Axis, Chart, Content, Form, Ink, Page, Panel, Samples, Series, Table};

use super::analysis::{Analysis, ESTIMATORS};
use super::markov::{Fit, Noise};
use super::report::Report;
use crate::allan::Estimator;

/// Most points of a spectrum in the page.
const SPECTRUM_POINTS: usize = 4096;
/// Height of a panel (CSS pixels).
const HEIGHT: u32 = 260;

/// The report as a page.
#[must_use]
pub fn page(report: &Report) -> String {
    let mut page = Page::new(&format!("Noise and drift of unit {}", report.unit));
    let sentences: Vec<_> =
        report.sentences().into_iter().map(|sentence| (sentence, String::new())).collect();
    page.headlines(&sentences);
    page.paragraph(&format!(
        "{} ticks of {} s, {:.2} h{}.",
        report.ticks,
        super::figures::short(report.tick_s),
        report.length_h,
        if report.corrected { ", corrected and along the case axes" } else { ", raw readings" }
    ));
    report.notes.iter().chain(&report.refused).for_each(|note| page.paragraph(note));
    page.heading("Allan deviation");
    page.chart(&allan(report));
    tabulate(&mut page, report.noise_rows());
    page.paragraph(
        "Coefficients are fitted to the overlapping variances with their covariance; intervals hold 95 %. A \
         coefficient that the log does not show is given as an upper limit.",
    );
    report.noise_words().iter().for_each(|words| page.paragraph(words));
    page.heading("Drift");
    page.chart(&slow(report));
    tabulate(&mut page, report.drift_rows());
    page.paragraph(
        "σ and correlation time are most likely together with trend, white noise and daily lines. The plain \
         autocorrelation falls too early, because mean and trend were fitted to the drift itself.",
    );
    if let Some(chart) = autocorrelation(report) {
        page.chart(&chart);
    }
    let (head, rows) = report.extrapolation_rows();
    if !rows.is_empty() {
        page.heading("How far a trend can be trusted");
        page.paragraph(
            "A straight line is fitted to the beginning, the length of a calibration, and extrapolated over the \
             rest. In 002 it missed by up to 30 %: therefore the estimator treats the trend's rate as a Markov \
             process.",
        );
        page.chart(&extrapolation(report));
        page.table(&Table { head, rows });
    }
    page.heading("Spectrum");
    page.chart(&spectrum(report));
    report.line_words().iter().for_each(|words| page.paragraph(words));
    tabulate(&mut page, report.allan_rows());
    if !report.parameters.is_empty() {
        page.heading("Parameters of the estimator");
        let fields = [
            "sigma_deg_per_h",
            "correlation_time_h",
            "trend_sigma_deg_per_h2",
            "trend_correlation_time_h",
            "initial_sigma_deg_per_h",
            "angle_random_walk_deg_per_sqrt_h",
        ];
        let head = std::iter::once(String::new()).chain(fields.map(str::to_owned)).collect();
        let rows = report.parameters.iter().map(|(name, parameters)| {
            let d = &parameters.drift;
            let values = [
                d.sigma_deg_per_h,
                d.correlation_time_h,
                d.trend_sigma_deg_per_h2,
                d.trend_correlation_time_h,
                d.initial_sigma_deg_per_h,
                d.angle_random_walk_deg_per_sqrt_h,
            ];
            std::iter::once(format!("gyro {name}")).chain(values.map(|value| value.to_string())).collect()
        });
        page.table(&Table { head, rows: rows.collect() });
        for (name, parameters) in &report.parameters {
            for note in &parameters.notes {
                page.paragraph(&format!("gyro {name}: {note}."));
            }
        }
    }
    page.to_html()
}

fn tabulate(page: &mut Page, (head, rows): (Vec<String>, Vec<Vec<String>>)) {
    page.table(&Table { head, rows });
}

fn series(name: String, ink: Ink, form: Form, points: impl IntoIterator<Item = (f64, f64)>) -> Series {
    Series { name, ink, form, samples: Samples::points(points) }
}

fn panel(title: String, unit: &str, logarithmic: bool, content: Vec<Series>) -> Panel {
    Panel { title, unit: unit.to_owned(), height: HEIGHT, logarithmic, content: Content::Series(content) }
}

fn allan(report: &Report) -> Chart {
    let of = |sensor: &Analysis| {
        let curve = |estimator: usize| {
            sensor
                .allan
                .iter()
                .filter_map(move |row| Some((row.tau_s, row.of.get(estimator)?.as_ref()?.value)))
        };
        let inks = [Ink::Second, Ink::First, Ink::Third];
        let mut curves: Vec<Series> = ESTIMATORS
            .iter()
            .enumerate()
            .zip(inks)
            .map(|((index, estimator), ink)| {
                let (name, form) = match estimator {
                    Estimator::Plain => ("plain", Form::Dots),
                    Estimator::Overlapping => ("overlapping", Form::Line),
                    Estimator::Modified => ("modified", Form::Line),
                };
                series(name.to_owned(), ink, form, curve(index))
            })
            .collect();
        for end in [0, 1] {
            let limit = sensor
                .allan
                .iter()
                .filter_map(move |row| Some((row.tau_s, row.of[1].as_ref()?.interval[end])));
            curves.push(series("95 % of overlapping".to_owned(), Ink::Faint, Form::Line, limit));
        }
        if let Some(noise) = sensor.stated_noise() {
            let fit = sensor
                .allan
                .iter()
                .map(|row| (row.tau_s, noise.variances(row.tau_s).iter().sum::<f64>().sqrt()));
            curves.push(series("fit".to_owned(), Ink::Fourth, Form::Line, fit));
        }
        panel(format!("{} {}", report.kind.sensor(), sensor.name), report.kind.measure(), true, curves)
    };
    Chart {
        caption: "Allan deviation against averaging time, with the fit of N, B, K, R and Q.".to_owned(),
        x: Axis { label: "averaging time".to_owned(), unit: "s".to_owned(), logarithmic: true },
        panels: report.sensors.iter().map(of).collect(),
        marks: Vec::new(),
    }
}

fn slow(report: &Report) -> Chart {
    let of = |sensor: &Analysis| {
        let slow = &sensor.slow;
        let mut curves = vec![series(
            "slow part".to_owned(),
            Ink::Raw,
            Form::Line,
            slow.time_h.iter().copied().zip(slow.mean.iter().copied()),
        )];
        let fits = [
            (sensor.markov.as_ref().map(|(fit, _)| fit), "first order", Ink::Second),
            (sensor.second_order.as_ref(), "second order", Ink::Third),
        ];
        for (fit, name, ink) in fits {
            if let Some(fit) = fit {
                let points = slow.time_h.iter().map(|time| (*time, fit.trend_at(*time)));
                curves.push(series(name.to_owned(), ink, Form::Line, points));
            }
        }
        panel(format!("{} {}", report.kind.sensor(), sensor.name), report.kind.measure(), false, curves)
    };
    Chart {
        caption: "Slow part of the readings, with its trend.".to_owned(),
        x: Axis::of("time since the log's beginning", "h"),
        panels: report.sensors.iter().map(of).collect(),
        marks: Vec::new(),
    }
}

fn autocorrelation(report: &Report) -> Option<Chart> {
    let of = |sensor: &Analysis| {
        let auto = sensor.autocorrelation.as_ref()?;
        let points = auto.lag_h.iter().copied().zip(auto.correlation.iter().copied());
        let mut curves = vec![series("of the slow part".to_owned(), Ink::Raw, Form::Line, points)];
        if let Some((Fit { noise: Noise { correlation_time_h: time_h, markov: true, .. }, .. }, _)) =
            &sensor.markov
        {
            let model = auto.lag_h.iter().map(|lag| (*lag, libm::exp(-lag / time_h)));
            curves.push(series("Markov part".to_owned(), Ink::Second, Form::Line, model));
        }
        Some(panel(format!("{} {}", report.kind.sensor(), sensor.name), "", false, curves))
    };
    let panels: Vec<Panel> = report.sensors.iter().filter_map(of).collect();
    (!panels.is_empty()).then(|| Chart {
        caption: "Autocorrelation of the slow part less its trend.".to_owned(),
        x: Axis::of("lag", "h"),
        panels,
        marks: Vec::new(),
    })
}

fn extrapolation(report: &Report) -> Chart {
    let of = |sensor: &Analysis| {
        let found = sensor.extrapolation.as_ref()?;
        let slow = &sensor.slow;
        let first = slow.time_h.first().copied().unwrap_or(0.0) - 0.5 * slow.width_h;
        let line = |time: f64| found.start + found.slope_per_h * (time - first);
        let points = slow.time_h.iter().copied().zip(slow.mean.iter().copied());
        let fitted = slow.time_h.iter().filter(|time| **time - first <= found.fit_h);
        let rest = slow.time_h.iter().filter(|time| **time - first > found.fit_h);
        let curves = vec![
            series("slow part".to_owned(), Ink::Raw, Form::Line, points),
            series("fitted".to_owned(), Ink::Second, Form::Line, fitted.map(|time| (*time, line(*time)))),
            series("extrapolated".to_owned(), Ink::Alert, Form::Line, rest.map(|time| (*time, line(*time)))),
        ];
        Some(panel(format!("{} {}", report.kind.sensor(), sensor.name), report.kind.measure(), false, curves))
    };
    Chart {
        caption: "A straight line through the beginning, extrapolated over the rest.".to_owned(),
        x: Axis::of("time since the log's beginning", "h"),
        panels: report.sensors.iter().filter_map(of).collect(),
        marks: Vec::new(),
    }
}

fn spectrum(report: &Report) -> Chart {
    let unit = format!("{}/√Hz", report.kind.measure());
    let of = |sensor: &Analysis| {
        let spectrum = sensor.spectrum.as_ref()?;
        let stride = spectrum.density.len().div_ceil(SPECTRUM_POINTS).max(1);
        // The largest of each group, so that no line is lost.
        let points: Vec<(f64, f64)> = spectrum.points().map(|(hz, density)| (hz, density.sqrt())).collect();
        let largest = |group: &[(f64, f64)]| {
            group
                .iter()
                .copied()
                .fold((0.0, 0.0), |best: (f64, f64), point| if point.1 > best.1 { point } else { best })
        };
        let points: Vec<(f64, f64)> =
            points.chunks(stride).map(largest).filter(|point| point.0 > 0.0).collect();
        let mut curves = vec![series("density".to_owned(), Ink::Raw, Form::Line, points)];
        let lines =
            sensor.lines.iter().map(|line| (line.frequency_hz, spectrum_at(sensor, line.frequency_hz)));
        curves.push(series("lines".to_owned(), Ink::Alert, Form::Dots, lines));
        Some(panel(format!("{} {}", report.kind.sensor(), sensor.name), &unit, true, curves))
    };
    Chart {
        caption: "Square root of the power spectral density.".to_owned(),
        x: Axis { label: "frequency".to_owned(), unit: "Hz".to_owned(), logarithmic: true },
        panels: report.sensors.iter().filter_map(of).collect(),
        marks: Vec::new(),
    }
}

fn spectrum_at(sensor: &Analysis, frequency_hz: f64) -> f64 {
    let near = sensor.spectrum.as_ref().and_then(|spectrum| {
        let half = 0.5 * spectrum.step_hz;
        spectrum.points().find(|(hz, _)| (hz - frequency_hz).abs() < half)
    });
    near.map_or(f64::NAN, |(_, density)| density.sqrt())
}
