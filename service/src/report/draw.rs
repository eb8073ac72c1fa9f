//! A figure as SVG.

use std::ops::Range;

use plotters::coord::Shift;
use plotters::coord::ranged1d::{DefaultFormatting, KeyPointHint};
use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;
use thiserror::Error;

use super::axis::{self, Ticks};
use super::decimate::decimate;
use super::figure::{Curve, Figure, Ink, Mark, Panel};

/// Why a report cannot be made.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ReportError {
    /// The plotting library could not draw a figure.
    #[error("cannot draw the figure \"{caption}\": {reason}")]
    Draw {
        /// Caption of the figure.
        caption: String,
        /// What the library says.
        reason: String,
    },
}

/// Sizes of a drawing, in its own pixels; there are two of them to each pixel of the window.
#[derive(Debug)]
pub(super) struct Layout {
    pub(super) class: &'static str,
    width: u32,
    /// Height of a panel relative to the same panel in a wide drawing's proportions.
    stretch: f64,
    text: f64,
    left: u32,
    line: u32,
    dot: u32,
    ring: u32,
    x_ticks: u32,
    points: usize,
}

impl Layout {
    /// For a laptop.
    pub(super) const WIDE: Self = Self {
        class: "wide",
        width: 1920,
        stretch: 1.0,
        text: 26.0,
        left: 124,
        line: 3,
        dot: 5,
        ring: 12,
        x_ticks: 12,
        points: 2000,
    };
    /// For a phone.
    pub(super) const NARROW: Self = Self {
        class: "narrow",
        width: 740,
        stretch: 1.9,
        text: 24.0,
        left: 112,
        line: 3,
        dot: 3,
        ring: 7,
        x_ticks: 5,
        points: 700,
    };

    /// Height of a line of text.
    fn row(&self) -> u32 {
        whole(self.text * 1.7)
    }

    /// Height of a panel's diagram, without title and labels.
    fn diagram(&self, panel: &Panel) -> u32 {
        whole(f64::from(self.width) * self.stretch * panel.aspect)
    }

    /// Height of a panel with its title above and, for the last one, the labels of the axis below.
    fn panel(&self, panel: &Panel, is_last: bool) -> u32 {
        let below = if is_last { 2 * self.row() } else { self.row() / 2 };
        self.diagram(panel) + self.title(panel) + below
    }

    fn title(&self, panel: &Panel) -> u32 {
        if panel.title.is_empty() { self.row() / 3 } else { self.row() }
    }

    fn font(&self) -> TextStyle<'static> {
        // The library divides the size by 1.24 when it writes SVG.
        ("sans-serif", self.text * 1.24).into_font().color(&FAINT)
    }
}

// The style sheet replaces these colours by name; here they must only differ.
const FAINT: RGBColor = RGBColor(0x59, 0x63, 0x6f);
const RULE: RGBColor = RGBColor(0xdf, 0xe3, 0xe8);
const BAND: RGBColor = RGBColor(0xec, 0xef, 0xf3);

const fn colour(ink: Ink) -> RGBColor {
    match ink {
        Ink::Raw => RGBColor(0xc2, 0x57, 0x1a),
        Ink::Corrected => RGBColor(0x1b, 0x6c, 0xa8),
        Ink::Truth => RGBColor(0x1d, 0x23, 0x2b),
        Ink::First => RGBColor(0xb3, 0x26, 0x1e),
        Ink::Second => RGBColor(0x2e, 0x7d, 0x32),
        Ink::Third => RGBColor(0x7a, 0x51, 0x95),
    }
}

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
type Chart<'a, 'b> = ChartContext<'a, SVGBackend<'b>, Cartesian2d<Axis, Axis>>;
type DrawError = Box<dyn std::error::Error>;

/// An axis with ticks of our own choice; the library's are too dense for a phone.
#[derive(Debug, Clone)]
struct Axis {
    range: Range<f64>,
    ticks: Vec<f64>,
}

impl Axis {
    fn new([low, high]: [f64; 2], ticks: &Ticks) -> Self {
        Self { range: low..high, ticks: ticks.values.clone() }
    }
}

impl Ranged for Axis {
    type FormatOption = DefaultFormatting;
    type ValueType = f64;

    fn map(&self, value: &f64, limit: (i32, i32)) -> i32 {
        RangedCoordf64::from(self.range.clone()).map(value, limit)
    }

    fn key_points<Hint: KeyPointHint>(&self, _: Hint) -> Vec<f64> {
        self.ticks.clone()
    }

    fn range(&self) -> Range<f64> {
        self.range.clone()
    }
}

/// Draws the figure.
pub(super) fn svg(figure: &Figure, layout: &Layout) -> Result<String, ReportError> {
    let mut text = String::new();
    draw(figure, layout, &mut text)
        .map_err(|error| ReportError::Draw { caption: figure.caption.clone(), reason: error.to_string() })?;
    Ok(text)
}

fn draw(figure: &Figure, layout: &Layout, text: &mut String) -> Result<(), DrawError> {
    let count = figure.panels.len();
    let heights = figure.panels.iter().zip(1..).map(|(panel, index)| layout.panel(panel, index == count));
    let heights: Vec<u32> = heights.collect();
    let points = || figure.panels.iter().flat_map(|panel| &panel.curves).flat_map(|curve| &curve.points);
    let x_range = axis::extent(points().map(|point| point[0])).unwrap_or([0.0, 1.0]);
    let x_range = if x_range[1] > x_range[0] { x_range } else { [x_range[0] - 0.5, x_range[1] + 0.5] };

    let mut rest = SVGBackend::with_string(text, (layout.width, heights.iter().sum())).into_drawing_area();
    for (index, (panel, height)) in figure.panels.iter().zip(&heights).enumerate() {
        let (area, below) = rest.split_vertically(*height);
        let x_label = (index + 1 == count).then_some(figure.x_label.as_str());
        draw_panel(&area, panel, layout, x_range, x_label)?;
        rest = below;
    }
    rest.present()?;
    Ok(())
}

fn draw_panel(
    area: &Area<'_>,
    panel: &Panel,
    layout: &Layout,
    x_range: [f64; 2],
    x_label: Option<&str>,
) -> Result<(), DrawError> {
    let points = || panel.curves.iter().flat_map(|curve| &curve.points);
    let y_range =
        panel.y_range.or_else(|| axis::fitted(points().map(|point| point[1]))).unwrap_or([-1.0, 1.0]);
    let x_ticks = Ticks::new(x_range, layout.x_ticks);
    let y_ticks = Ticks::new(y_range, (layout.diagram(panel) / 40).clamp(5, 9));

    let below = if x_label.is_some() { 2 * layout.row() } else { layout.row() / 2 };
    let mut chart = ChartBuilder::on(area)
        .margin_top(layout.title(panel))
        .margin_right(layout.row() / 2)
        .margin_bottom(if x_label.is_some() { 0 } else { below })
        .x_label_area_size(if x_label.is_some() { below } else { 0 })
        .y_label_area_size(layout.left + layout.row())
        .build_cartesian_2d(Axis::new(x_range, &x_ticks), Axis::new(y_range, &y_ticks))?;

    let [bottom, top] = y_range;
    for [from, to] in &panel.bands {
        let corners = [(from.max(x_range[0]), top), (to.min(x_range[1]), bottom)];
        chart.draw_series([Rectangle::new(corners, BAND.filled())])?;
    }
    chart
        .configure_mesh()
        .label_style(layout.font())
        .axis_desc_style(layout.font())
        .bold_line_style(RULE.stroke_width(2))
        .light_line_style(TRANSPARENT)
        .axis_style(FAINT.stroke_width(2))
        .x_labels(x_ticks.values.len())
        .y_labels(y_ticks.values.len())
        .x_label_formatter(&|value| x_ticks.label(*value))
        .y_label_formatter(&|value| y_ticks.label(*value))
        .x_desc(x_label.unwrap_or_default())
        .y_desc(panel.y_label.as_str())
        .draw()?;
    for curve in &panel.curves {
        draw_curve(&mut chart, curve, layout, y_range)?;
    }
    if !panel.title.is_empty() {
        let corner = (i32::try_from(layout.left + layout.row())?, i32::try_from(layout.row() / 5)?);
        area.draw(&Text::new(panel.title.clone(), corner, layout.font()))?;
    }
    Ok(())
}

fn draw_curve(
    chart: &mut Chart<'_, '_>,
    curve: &Curve,
    layout: &Layout,
    y_range: [f64; 2],
) -> Result<(), DrawError> {
    let colour = colour(curve.ink);
    let finite: Vec<_> =
        curve.points.iter().copied().filter(|[x, y]| x.is_finite() && y.is_finite()).collect();
    let points = decimate(&finite, layout.points);
    if curve.mark != Mark::Rings {
        let width = if curve.mark == Mark::ThinLine { layout.line - 1 } else { layout.line };
        for piece in clipped(&points, y_range) {
            chart.draw_series([PathElement::new(piece, colour.stroke_width(width))])?;
        }
    }
    let within =
        || points.iter().filter(|[_, y]| (y_range[0]..=y_range[1]).contains(y)).map(|&[x, y]| (x, y));
    match curve.mark {
        Mark::Line | Mark::ThinLine => {}
        Mark::DottedLine => {
            chart.draw_series(within().map(|point| Circle::new(point, layout.dot, colour.filled())))?;
        }
        Mark::Rings => {
            chart.draw_series(
                within().map(|point| Circle::new(point, layout.ring, colour.stroke_width(layout.line))),
            )?;
        }
    }
    Ok(())
}

/// The parts of a line that lie within the range, cut exactly at its ends.
fn clipped(points: &[[f64; 2]], [low, high]: [f64; 2]) -> Vec<Vec<(f64, f64)>> {
    let mut pieces: Vec<Vec<(f64, f64)>> = Vec::new();
    let mut open = false;
    for pair in points.windows(2) {
        let ([x0, y0], [x1, y1]) = (pair[0], pair[1]);
        // Shares of the way from the first point to the second at which the line enters and leaves the range.
        let (mut enter, mut leave) = (0.0_f64, 1.0_f64);
        let slope = y1 - y0;
        if slope == 0.0 {
            if !(low..=high).contains(&y0) {
                leave = -1.0;
            }
        } else {
            let (at_low, at_high) = ((low - y0) / slope, (high - y0) / slope);
            enter = enter.max(at_low.min(at_high));
            leave = leave.min(at_low.max(at_high));
        }
        if enter > leave {
            open = false;
            continue;
        }
        let at = |share: f64| (x0 + share * (x1 - x0), y0 + share * slope);
        match pieces.last_mut() {
            Some(piece) if open => piece.push(at(leave)),
            _ => pieces.push(vec![at(enter), at(leave)]),
        }
        open = leave >= 1.0;
    }
    pieces
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "sizes of a drawing: some thousand pixels"
)]
fn whole(pixels: f64) -> u32 {
    pixels.round() as u32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_cut_where_it_leaves_the_range_and_goes_on_where_it_returns() {
        let points = [[0.0, 0.0], [1.0, 2.0], [2.0, 2.0], [3.0, 0.0], [4.0, 0.5], [5.0, -4.0], [6.0, 4.0]];
        let pieces = clipped(&points, [-1.0, 1.0]);
        assert_eq!(
            pieces,
            [
                vec![(0.0, 0.0), (0.5, 1.0)],
                vec![(2.5, 1.0), (3.0, 0.0), (4.0, 0.5), (4.0 + 1.5 / 4.5, -1.0)],
                vec![(5.375, -1.0), (5.625, 1.0)],
            ]
        );
    }
}
