//! Charts of a log's noise and drift.

use isotherm_pages::{Axis, Chart, Ink, Panel, Series};

use super::fit::Analysis;
use super::markov::Fit;
use super::report::Found;
use crate::lsq::correlated::Noise;

/// Most points of a spectrum in the page.
const SPECTRUM_POINTS: usize = 4096;
/// Height of a panel (CSS pixels).
const HEIGHT: u32 = 260;

/// All charts, each with its heading.
pub(super) fn charts(found: &Found) -> Vec<(String, Chart)> {
    let all = [
        ("Allan deviation", allan(found)),
        ("Drift", slow(found)),
        ("Autocorrelation", autocorrelation(found)),
        ("How far a trend can be trusted", extrapolation(found)),
        ("Spectrum", spectrum(found)),
    ];
    let shown = all.into_iter().filter(|(_, chart)| !chart.panels.is_empty());
    shown.map(|(heading, chart)| (heading.to_owned(), chart)).collect()
}

/// Curves of a sensor.
fn panel(found: &Found, sensor: &Analysis, unit: &str, curves: Vec<Series>) -> Panel {
    Panel::of(format!("{} {}", found.kind.sensor(), sensor.name), unit, HEIGHT, curves)
}

fn allan(found: &Found) -> Chart {
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
        panel(found, sensor, found.kind.measure(), curves).logarithmic()
    };
    let caption = "Allan deviation against averaging time, with N, B, K, R and Q fitted to the overlapping variances and their covariance.";
    Chart::of(caption, Axis::of("averaging time", "s").logarithmic(), found.sensors.iter().map(of).collect())
}

fn slow(found: &Found) -> Chart {
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
        panel(found, sensor, found.kind.measure(), curves)
    };
    let x = Axis::of("time since the log's beginning", "h");
    Chart::of(
        "Slow part of the readings, with its trend; σ and correlation time are most likely together with trend, white noise and daily lines.",
        x,
        found.sensors.iter().map(of).collect(),
    )
}

fn autocorrelation(found: &Found) -> Chart {
    let of = |sensor: &Analysis| {
        let auto = sensor.autocorrelation.as_ref()?;
        let points = auto.lag_h.iter().copied().zip(auto.correlation.iter().copied());
        let mut curves = vec![Series::line("of the slow part", Ink::Raw, points)];
        if let Some((Fit { noise: Noise { markov: Some([_, time_h]), .. }, .. }, _)) = &sensor.markov {
            let model = auto.lag_h.iter().map(|lag| (*lag, libm::exp(-lag / time_h)));
            curves.push(Series::line("Markov part", Ink::Second, model));
        }
        Some(panel(found, sensor, "", curves))
    };
    let caption = "Autocorrelation of the slow part less its trend. It falls too early, because mean and trend were fitted to the drift itself.";
    Chart::of(caption, Axis::of("lag", "h"), found.sensors.iter().filter_map(of).collect())
}

fn extrapolation(found: &Found) -> Chart {
    let of = |sensor: &Analysis| {
        let of = sensor.extrapolation.as_ref()?;
        let slow = &sensor.slow;
        let first = slow.time_h.first().copied().unwrap_or(0.0) - 0.5 * slow.width_h;
        let line = |time: f64| of.start + of.slope_per_h * (time - first);
        let points = slow.time_h.iter().copied().zip(slow.mean.iter().copied());
        let fitted = slow.time_h.iter().filter(|time| **time - first <= of.fit_h);
        let rest = slow.time_h.iter().filter(|time| **time - first > of.fit_h);
        let curves = vec![
            Series::line("slow part", Ink::Raw, points),
            Series::line("fitted", Ink::Second, fitted.map(|time| (*time, line(*time)))),
            Series::line("extrapolated", Ink::Alert, rest.map(|time| (*time, line(*time)))),
        ];
        Some(panel(found, sensor, found.kind.measure(), curves))
    };
    let caption = "A straight line through the beginning, the length of a calibration, extrapolated over the rest. In 002 it missed by up to 30 %: therefore the estimator treats the trend's rate as a Markov process.";
    let x = Axis::of("time since the log's beginning", "h");
    Chart::of(caption, x, found.sensors.iter().filter_map(of).collect())
}

fn spectrum(found: &Found) -> Chart {
    let unit = format!("{}/√Hz", found.kind.measure());
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
        Some(panel(found, sensor, &unit, curves).logarithmic())
    };
    let x = Axis::of("frequency", "Hz").logarithmic();
    let panels = found.sensors.iter().filter_map(of).collect();
    Chart::of("Square root of the power spectral density.", x, panels)
}

fn spectrum_at(sensor: &Analysis, frequency_hz: f64) -> f64 {
    let near = sensor.spectrum.as_ref().and_then(|spectrum| {
        let half = 0.5 * spectrum.step_hz;
        spectrum.points().find(|(hz, _)| (hz - frequency_hz).abs() < half)
    });
    near.map_or(f64::NAN, |(_, density)| density.sqrt())
}
