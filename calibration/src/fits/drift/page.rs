//! Charts of a log's noise and drift.

use isotherm_pages::{Axis, Chart, Content, Ink, Panel, Series};

use super::fit::Analysis;
use super::markov::Fit;
use super::report::Found;
use super::slow::Slow;
use crate::lsq::correlated::Noise;

/// Most points of a spectrum in the page.
const SPECTRUM_POINTS: usize = 4096;
/// Height of a panel (CSS pixels).
const HEIGHT: u32 = 260;

/// Curves of a sensor; none where it has nothing to show.
type Curves = fn(&Analysis) -> Vec<Series>;

/// All charts, each with its heading.
pub(super) fn charts(found: &Found) -> Vec<(String, Chart)> {
    let measure = found.kind.measure();
    let density = format!("{measure}/√Hz");
    let since = Axis::of("time since the log's beginning", "h");
    let all: [(&str, &str, Axis, &str, Curves); 5] = [
        (
            "Allan deviation",
            "Allan deviation against averaging time, with N, B, K, R and Q fitted to the overlapping variances and their covariance.",
            Axis::of("averaging time", "s").logarithmic(),
            measure,
            allan,
        ),
        (
            "Drift",
            "Slow part of the readings, with its trend; σ and correlation time are most likely together with trend, white noise and daily lines.",
            since.clone(),
            measure,
            slow,
        ),
        (
            "Autocorrelation",
            "Autocorrelation of the slow part less its trend. It falls too early, because mean and trend were fitted to the drift itself.",
            Axis::of("lag", "h"),
            "",
            autocorrelation,
        ),
        (
            "How far a trend can be trusted",
            "A straight line through the beginning, the length of a calibration, extrapolated over the rest. In 002 it missed by up to 30 %: therefore the estimator treats the trend's rate as a Markov process.",
            since,
            measure,
            extrapolation,
        ),
        (
            "Spectrum",
            "Square root of the power spectral density.",
            Axis::of("frequency", "Hz").logarithmic(),
            &density,
            spectrum,
        ),
    ];
    let has_curves = |panel: &Panel| !matches!(&panel.content, Content::Series(curves) if curves.is_empty());
    let chart = |(heading, caption, x, unit, curves): (&str, &str, Axis, &str, Curves)| {
        let panel = |sensor: &Analysis| {
            let title = format!("{} {}", found.kind.sensor(), sensor.name);
            Panel { logarithmic: x.logarithmic, ..Panel::of(title, unit, HEIGHT, curves(sensor)) }
        };
        let panels = found.sensors.iter().map(panel).filter(has_curves).collect();
        (heading.to_owned(), Chart::of(caption, x, panels))
    };
    all.into_iter().map(chart).filter(|(_, chart)| !chart.panels.is_empty()).collect()
}

fn allan(sensor: &Analysis) -> Vec<Series> {
    let rows = || sensor.allan.iter();
    let curve = |estimator: usize| rows().filter_map(move |row| Some((row.tau_s, row.of[estimator]?.value)));
    let limit = |end: usize| rows().filter_map(move |row| Some((row.tau_s, row.of[1]?.interval[end])));
    let mut curves = vec![
        Series::dots("plain", Ink::Second, curve(0)),
        Series::line("overlapping", Ink::First, curve(1)),
        Series::line("modified", Ink::Third, curve(2)),
    ];
    curves.extend([0, 1].map(|end| Series::line("95 % of overlapping", Ink::Faint, limit(end))));
    if let Some(noise) = sensor.stated_noise() {
        let fit = rows().map(|row| (row.tau_s, noise.variances(row.tau_s).iter().sum::<f64>().sqrt()));
        curves.push(Series::line("fit", Ink::Fourth, fit));
    }
    curves
}

/// Means over bins.
fn slow_part(sensor: &Analysis) -> Series {
    let Slow { time_h, mean, .. } = &sensor.slow;
    Series::line("slow part", Ink::Raw, time_h.iter().copied().zip(mean.iter().copied()))
}

fn slow(sensor: &Analysis) -> Vec<Series> {
    let trend = |name: &'static str, ink: Ink, fit: &Fit| {
        Series::line(name, ink, sensor.slow.time_h.iter().map(|time| (*time, fit.trend_at(*time))))
    };
    let mut curves = vec![slow_part(sensor)];
    curves.extend(sensor.markov.as_ref().map(|(fit, _)| trend("first order", Ink::Second, fit)));
    curves.extend(sensor.second_order.as_ref().map(|fit| trend("second order", Ink::Third, fit)));
    curves
}

fn autocorrelation(sensor: &Analysis) -> Vec<Series> {
    let Some(auto) = &sensor.autocorrelation else { return Vec::new() };
    let points = auto.lag_h.iter().copied().zip(auto.correlation.iter().copied());
    let mut curves = vec![Series::line("of the slow part", Ink::Raw, points)];
    if let Some((Fit { noise: Noise { markov: Some([_, time_h]), .. }, .. }, _)) = &sensor.markov {
        let model = auto.lag_h.iter().map(|lag| (*lag, libm::exp(-lag / time_h)));
        curves.push(Series::line("Markov part", Ink::Second, model));
    }
    curves
}

fn extrapolation(sensor: &Analysis) -> Vec<Series> {
    let Some(of) = &sensor.extrapolation else { return Vec::new() };
    let slow = &sensor.slow;
    let first = slow.time_h.first().copied().unwrap_or(0.0) - 0.5 * slow.width_h;
    let line = |time: &f64| (*time, of.start + of.slope_per_h * (time - first));
    let (fitted, rest): (Vec<f64>, Vec<f64>) =
        slow.time_h.iter().partition(|time| **time - first <= of.fit_h);
    vec![
        slow_part(sensor),
        Series::line("fitted", Ink::Second, fitted.iter().map(line)),
        Series::line("extrapolated", Ink::Alert, rest.iter().map(line)),
    ]
}

fn spectrum(sensor: &Analysis) -> Vec<Series> {
    let Some(spectrum) = &sensor.spectrum else { return Vec::new() };
    let stride = spectrum.density.len().div_ceil(SPECTRUM_POINTS).max(1);
    let points: Vec<(f64, f64)> = spectrum.points().map(|(hz, density)| (hz, density.sqrt())).collect();
    // The largest of each group, so that no line is lost.
    let largest = |group: &[(f64, f64)]| {
        let larger = |best: (f64, f64), point: &(f64, f64)| if point.1 > best.1 { *point } else { best };
        group.iter().fold((0.0, 0.0), larger)
    };
    let shown = points.chunks(stride).map(largest).filter(|point| point.0 > 0.0);
    let at = |hz: f64| {
        let near = points.iter().find(|point| (point.0 - hz).abs() < 0.5 * spectrum.step_hz);
        near.map_or(f64::NAN, |(_, density)| *density)
    };
    let lines = sensor.lines.iter().map(|line| (line.frequency_hz, at(line.frequency_hz)));
    vec![Series::line("density", Ink::Raw, shown), Series::dots("lines", Ink::Alert, lines)]
}
