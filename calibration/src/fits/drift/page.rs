//! The HTML report of a log's noise and drift.

use isotherm_pages::{Axis, Chart, Ink, Page, Panel, Series, Table};

use super::fit::Analysis;
use super::markov::{Fit, Noise};
use super::report::Report;
use crate::report::short;

/// Most points of a spectrum in the page.
const SPECTRUM_POINTS: usize = 4096;
/// Height of a panel (CSS pixels).
const HEIGHT: u32 = 260;

/// The report as a page.
pub fn page(report: &Report) -> String {
    let mut page = Page::new(&format!("Noise and drift of unit {}", report.unit));
    let sentences: Vec<_> =
        report.sentences().into_iter().map(|sentence| (sentence, String::new())).collect();
    page.headlines(&sentences);
    page.paragraph(&format!(
        "{} ticks of {} s, {:.2} h{}.",
        report.ticks,
        short(report.tick_s),
        report.length_h,
        if report.corrected { ", corrected and along the case axes" } else { ", raw readings" }
    ));
    report.notes.iter().chain(&report.refused).for_each(|note| page.paragraph(note));
    page.heading("Allan deviation");
    page.chart(&allan(report));
    page.table(&report.noise_rows());
    page.paragraph(
        "Coefficients are fitted to the overlapping variances with their covariance; intervals hold 95 %. A \
         coefficient that the log does not show is given as an upper limit.",
    );
    report.noise_words().iter().for_each(|words| page.paragraph(words));
    page.heading("Drift");
    page.chart(&slow(report));
    page.table(&report.drift_rows());
    page.paragraph(
        "σ and correlation time are most likely together with trend, white noise and daily lines. The plain \
         autocorrelation falls too early, because mean and trend were fitted to the drift itself.",
    );
    if let Some(chart) = autocorrelation(report) {
        page.chart(&chart);
    }
    let extrapolated = report.extrapolation_rows();
    if !extrapolated.rows.is_empty() {
        page.heading("How far a trend can be trusted");
        page.paragraph(
            "A straight line is fitted to the beginning, the length of a calibration, and extrapolated over the \
             rest. In 002 it missed by up to 30 %: therefore the estimator treats the trend's rate as a Markov \
             process.",
        );
        page.chart(&extrapolation(report));
        page.table(&extrapolated);
    }
    page.heading("Spectrum");
    page.chart(&spectrum(report));
    report.line_words().iter().for_each(|words| page.paragraph(words));
    page.table(&report.allan_rows());
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
        page.table(&Table::of(std::iter::once("").chain(fields), rows));
        for (name, parameters) in &report.parameters {
            for note in &parameters.notes {
                page.paragraph(&format!("gyro {name}: {note}."));
            }
        }
    }
    page.to_html()
}

/// Curves of a sensor.
fn panel(report: &Report, sensor: &Analysis, unit: &str, curves: Vec<Series>) -> Panel {
    Panel::of(format!("{} {}", report.kind.sensor(), sensor.name), unit, HEIGHT, curves)
}

fn allan(report: &Report) -> Chart {
    let of = |sensor: &Analysis| {
        let curve = |estimator: usize| {
            sensor
                .allan
                .iter()
                .filter_map(move |row| Some((row.tau_s, row.of.get(estimator)?.as_ref()?.value)))
        };
        let mut curves = vec![
            Series::dots("plain", Ink::Second, curve(0)),
            Series::line("overlapping", Ink::First, curve(1)),
            Series::line("modified", Ink::Third, curve(2)),
        ];
        for end in [0, 1] {
            let limit = sensor
                .allan
                .iter()
                .filter_map(move |row| Some((row.tau_s, row.of[1].as_ref()?.interval[end])));
            curves.push(Series::line("95 % of overlapping", Ink::Faint, limit));
        }
        if let Some(noise) = sensor.stated_noise() {
            let fit = sensor
                .allan
                .iter()
                .map(|row| (row.tau_s, noise.variances(row.tau_s).iter().sum::<f64>().sqrt()));
            curves.push(Series::line("fit", Ink::Fourth, fit));
        }
        panel(report, sensor, report.kind.measure(), curves).logarithmic()
    };
    let caption = "Allan deviation against averaging time, with the fit of N, B, K, R and Q.";
    Chart::of(caption, Axis::of("averaging time", "s").logarithmic(), report.sensors.iter().map(of).collect())
}

fn slow(report: &Report) -> Chart {
    let of = |sensor: &Analysis| {
        let slow = &sensor.slow;
        let points = slow.time_h.iter().copied().zip(slow.mean.iter().copied());
        let mut curves = vec![Series::line("slow part", Ink::Raw, points)];
        let fits = [
            (sensor.markov.as_ref().map(|(fit, _)| fit), "first order", Ink::Second),
            (sensor.second_order.as_ref(), "second order", Ink::Third),
        ];
        for (fit, name, ink) in fits {
            if let Some(fit) = fit {
                let points = slow.time_h.iter().map(|time| (*time, fit.trend_at(*time)));
                curves.push(Series::line(name, ink, points));
            }
        }
        panel(report, sensor, report.kind.measure(), curves)
    };
    let x = Axis::of("time since the log's beginning", "h");
    Chart::of("Slow part of the readings, with its trend.", x, report.sensors.iter().map(of).collect())
}

fn autocorrelation(report: &Report) -> Option<Chart> {
    let of = |sensor: &Analysis| {
        let auto = sensor.autocorrelation.as_ref()?;
        let points = auto.lag_h.iter().copied().zip(auto.correlation.iter().copied());
        let mut curves = vec![Series::line("of the slow part", Ink::Raw, points)];
        if let Some((Fit { noise: Noise { correlation_time_h: time_h, markov: true, .. }, .. }, _)) =
            &sensor.markov
        {
            let model = auto.lag_h.iter().map(|lag| (*lag, libm::exp(-lag / time_h)));
            curves.push(Series::line("Markov part", Ink::Second, model));
        }
        Some(panel(report, sensor, "", curves))
    };
    let panels: Vec<Panel> = report.sensors.iter().filter_map(of).collect();
    let caption = "Autocorrelation of the slow part less its trend.";
    (!panels.is_empty()).then(|| Chart::of(caption, Axis::of("lag", "h"), panels))
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
            Series::line("slow part", Ink::Raw, points),
            Series::line("fitted", Ink::Second, fitted.map(|time| (*time, line(*time)))),
            Series::line("extrapolated", Ink::Alert, rest.map(|time| (*time, line(*time)))),
        ];
        Some(panel(report, sensor, report.kind.measure(), curves))
    };
    let caption = "A straight line through the beginning, extrapolated over the rest.";
    let x = Axis::of("time since the log's beginning", "h");
    Chart::of(caption, x, report.sensors.iter().filter_map(of).collect())
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

        let lines =
            sensor.lines.iter().map(|line| (line.frequency_hz, spectrum_at(sensor, line.frequency_hz)));
        let curves =
            vec![Series::line("density", Ink::Raw, points), Series::dots("lines", Ink::Alert, lines)];
        Some(panel(report, sensor, &unit, curves).logarithmic())
    };
    let x = Axis::of("frequency", "Hz").logarithmic();
    let panels = report.sensors.iter().filter_map(of).collect();
    Chart::of("Square root of the power spectral density.", x, panels)
}

fn spectrum_at(sensor: &Analysis, frequency_hz: f64) -> f64 {
    let near = sensor.spectrum.as_ref().and_then(|spectrum| {
        let half = 0.5 * spectrum.step_hz;
        spectrum.points().find(|(hz, _)| (hz - frequency_hz).abs() < half)
    });
    near.map_or(f64::NAN, |(_, density)| density.sqrt())
}
