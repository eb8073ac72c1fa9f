//! Plots in SVG.

use std::ops::Range;

use plotters::prelude::*;

use crate::chain::{Measure, Row, middle};

const SIZE: (u32, u32) = (960, 460);
/// Of the relay, of the service, of the rest.
const COLOURS: [RGBColor; 4] =
    [RGBColor(120, 120, 120), RGBColor(196, 78, 32), RGBColor(38, 98, 168), RGBColor(80, 140, 70)];

fn colour(index: usize) -> RGBColor {
    COLOURS.get(index % COLOURS.len()).copied().unwrap_or(BLACK)
}

/// Latency from the median to 99 of 100 ticks, by load; one mark for each subject.
#[expect(clippy::cast_precision_loss, reason = "a handful of rows")]
pub(super) fn latency(rows: &[Row]) -> Result<String, String> {
    let rows: Vec<&Row> = rows.iter().filter(|row| row.measure == Measure::Latency).collect();
    let (mut loads, mut subjects): (Vec<String>, Vec<String>) = (Vec::new(), Vec::new());
    for row in &rows {
        if !loads.contains(&row.name) {
            loads.push(row.name.clone());
        }
        if !subjects.contains(&middle(row)) {
            subjects.push(middle(row));
        }
    }
    let all = rows.iter().flat_map(|row| [row.median.latency_us[0], row.median.latency_us[2]]);
    let within = decades(all);
    let mut svg = String::new();
    {
        let root = SVGBackend::with_string(&mut svg, SIZE).into_drawing_area();
        root.fill(&WHITE).map_err(words)?;
        let mut chart = ChartBuilder::on(&root)
            .caption("End-to-end latency: p50 (dot) to p99 (bar)", ("sans-serif", 18))
            .margin(12)
            .margin_right(40)
            .x_label_area_size(36)
            .y_label_area_size(70)
            .build_cartesian_2d(-0.5..loads.len() as f64 - 0.5, within.log_scale())
            .map_err(words)?;
        let name = |x: &f64| {
            let whole = (x.round() - x).abs() < 1e-6;
            let index = (0..loads.len()).find(|index| whole && (*index as f64 - x).abs() < 0.5);
            index
                .and_then(|index| loads.get(index))
                .map_or_else(String::new, |load| load.replace(", batches of ", " / "))
        };
        let mut mesh = chart.configure_mesh();
        mesh.disable_x_mesh()
            .x_labels(loads.len() + 2)
            .x_label_formatter(&name)
            .y_desc("µs")
            .y_label_formatter(&whole);
        mesh.label_style(("sans-serif", 12)).draw().map_err(words)?;
        for (index, subject) in subjects.iter().enumerate() {
            let style = colour(index).stroke_width(5);
            let of: Vec<&&Row> = rows.iter().filter(|row| middle(row) == *subject).collect();
            let place = |row: &Row| {
                let load = loads.iter().position(|load| *load == row.name).unwrap_or(0);
                load as f64 + 0.16 * (index as f64 - (subjects.len() as f64 - 1.0) / 2.0)
            };
            let bars = of.iter().map(|row| {
                let [p50, _, p99, _] = row.median.latency_us;
                PathElement::new(vec![(place(row), p50), (place(row), p99)], style)
            });
            let drawn = chart.draw_series(bars).map_err(words)?;
            drawn
                .label(subject.clone())
                .legend(move |(x, y)| PathElement::new(vec![(x, y), (x + 18, y)], style));
            let dots = of
                .iter()
                .map(|row| Circle::new((place(row), row.median.latency_us[0]), 5, colour(index).filled()));
            chart.draw_series(dots).map_err(words)?;
        }
        legend(&mut chart)?;
        root.present().map_err(words)?;
    }
    Ok(svg)
}

/// Processor time per tick and resident memory over the number of units.
#[expect(clippy::cast_precision_loss, reason = "far below 2⁵³")]
pub(super) fn units(rows: &[Row]) -> Result<String, String> {
    let of = |figure: &dyn Fn(&Row) -> f64| -> Vec<(f64, f64)> {
        rows.iter().map(|row| (row.case.units as f64, figure(row))).collect()
    };
    let series = [
        ("processor time per tick (ns)", of(&|row| row.median.cpu_us_per_tick * 1e3)),
        ("resident memory (MiB)", of(&|row| row.median.resident_kib as f64 / 1024.0)),
        ("start-up (ms)", of(&|row| row.median.start_s * 1e3)),
        ("one swap (ms)", of(&|row| row.median.swap_ms)),
    ];
    let [across, within] = [
        decades(rows.iter().map(|row| row.case.units as f64)),
        decades(series.iter().flat_map(|(_, points)| points.iter().map(|(_, y)| *y))),
    ];
    let mut svg = String::new();
    {
        let root = SVGBackend::with_string(&mut svg, SIZE).into_drawing_area();
        root.fill(&WHITE).map_err(words)?;
        let mut chart = ChartBuilder::on(&root)
            .caption("The service over the number of units", ("sans-serif", 18))
            .margin(12)
            .margin_right(40)
            .x_label_area_size(44)
            .y_label_area_size(70)
            .build_cartesian_2d(across.log_scale(), within.log_scale())
            .map_err(words)?;
        let mut mesh = chart.configure_mesh();
        mesh.x_desc("units")
            .x_label_formatter(&whole)
            .y_label_formatter(&whole)
            .label_style(("sans-serif", 12))
            .draw()
            .map_err(words)?;
        for (index, (name, points)) in series.into_iter().enumerate() {
            let style = colour(index).stroke_width(3);
            let drawn = chart.draw_series(LineSeries::new(points.clone(), style)).map_err(words)?;
            drawn.label(name).legend(move |(x, y)| PathElement::new(vec![(x, y), (x + 18, y)], style));
            let dots = points.into_iter().map(|point| Circle::new(point, 4, colour(index).filled()));
            chart.draw_series(dots).map_err(words)?;
        }
        legend(&mut chart)?;
        root.present().map_err(words)?;
    }
    Ok(svg)
}

fn legend<'a, X, Y>(chart: &mut ChartContext<'a, SVGBackend<'a>, Cartesian2d<X, Y>>) -> Result<(), String>
where
    X: Ranged<ValueType = f64> + 'a,
    Y: Ranged<ValueType = f64> + 'a,
{
    let mut labels = chart.configure_series_labels();
    labels
        .position(SeriesLabelPosition::UpperLeft)
        .background_style(WHITE.mix(0.8))
        .border_style(BLACK.mix(0.3));
    labels.label_font(("sans-serif", 13)).draw().map_err(words)
}

/// A number on an axis.
#[expect(clippy::trivially_copy_pass_by_ref, reason = "the axis hands it over so")]
fn whole(number: &f64) -> String {
    format!("{number:.0}")
}

/// Whole powers of ten around some figures; what has no logarithm is left out.
fn decades(figures: impl Iterator<Item = f64>) -> Range<f64> {
    let (low, high) = figures
        .filter(|figure| *figure > 0.0)
        .fold((f64::INFINITY, 0.0_f64), |(low, high), figure| (low.min(figure), high.max(figure)));
    if high == 0.0 {
        return 1.0..10.0;
    }
    let (low, high) = (low.log10().floor(), (high * 1.01).log10().ceil());
    10.0_f64.powf(low)..10.0_f64.powf(high)
}

fn words(error: impl std::fmt::Display) -> String {
    error.to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn decades_hold_all_figures() {
        let range = decades([30.0, 0.0, 4.0, 1234.0].into_iter());
        assert!((range.start - 1.0).abs() < 1e-12 && (range.end - 10_000.0).abs() < 1e-8, "{range:?}");
        assert_eq!(decades(std::iter::empty()), 1.0..10.0);
    }
}
