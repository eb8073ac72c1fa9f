//! What a figure is made of, and its HTML.

use std::fmt::Write;

use super::draw::{self, Layout, ReportError};
use super::page::escape;

/// Colour by what it stands for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ink {
    /// What came in.
    Raw,
    /// What went out.
    Corrected,
    /// What was really there.
    Truth,
    /// Other quantities, in this order.
    First,
    /// The second other quantity.
    Second,
    /// The third other quantity.
    Third,
}

impl Ink {
    /// Class of the ink in the page's style sheet.
    pub(super) const fn class(self) -> &'static str {
        match self {
            Self::Raw => "raw",
            Self::Corrected => "corrected",
            Self::Truth => "truth",
            Self::First => "first",
            Self::Second => "second",
            Self::Third => "third",
        }
    }
}

/// How the points of a curve are shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mark {
    /// Joined by a line.
    Line,
    /// Joined by a thin line, for what only guides the eye.
    ThinLine,
    /// Joined by a line, each with a dot.
    DottedLine,
    /// Rings that are not joined.
    Rings,
}

/// Points of one quantity, in the order of x.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    /// Name in the legend; curves of the same name share an entry.
    pub name: String,
    /// Colour.
    pub ink: Ink,
    /// How the points are shown.
    pub mark: Mark,
    /// Points (x, y); those that are not finite are left out.
    pub points: Vec<[f64; 2]>,
}

/// One diagram of a figure.
#[derive(Debug, Clone, PartialEq)]
pub struct Panel {
    /// What stands above it; empty for nothing.
    pub title: String,
    /// Quantity and unit of the vertical axis, e.g. "rate error, °/h".
    pub y_label: String,
    /// Range of the vertical axis; `None` fits it to the data. Curves are cut off at its ends.
    pub y_range: Option<[f64; 2]>,
    /// Height of the diagram relative to its width in a wide window.
    pub aspect: f64,
    /// Stretches of x that are shaded.
    pub bands: Vec<[f64; 2]>,
    /// The curves; later ones lie above earlier ones.
    pub curves: Vec<Curve>,
}

/// Panels over a common horizontal axis.
#[derive(Debug, Clone, PartialEq)]
pub struct Figure {
    /// Sentence below the figure; also what a screen reader says instead of it.
    pub caption: String,
    /// Quantity and unit of the horizontal axis, e.g. "time, min".
    pub x_label: String,
    /// The panels from top to bottom.
    pub panels: Vec<Panel>,
}

impl Figure {
    /// The figure as HTML, drawn for wide and for narrow windows.
    pub(super) fn to_html(&self) -> Result<String, ReportError> {
        let mut html = format!("<figure>\n{}", self.legend());
        for layout in [Layout::WIDE, Layout::NARROW] {
            let svg = draw::svg(self, &layout)?;
            let tag = format!(
                "<svg class=\"{}\" role=\"img\" aria-label=\"{}\" ",
                layout.class,
                escape(&self.caption)
            );
            html.push_str(&svg.replacen("<svg ", &tag, 1));
        }
        // Writing to a string cannot fail.
        let _ = writeln!(html, "<figcaption>{}</figcaption>\n</figure>", escape(&self.caption));
        Ok(html)
    }

    /// Legend of all curves, each name once.
    fn legend(&self) -> String {
        let mut seen = Vec::new();
        let mut html = String::from("<ul class=\"legend\">");
        for curve in self.panels.iter().flat_map(|panel| &panel.curves) {
            if seen.contains(&&curve.name) {
                continue;
            }
            seen.push(&curve.name);
            let key = if curve.mark == Mark::Rings { "ring" } else { "line" };
            let _ =
                write!(html, "<li><i class=\"{key} {}\"></i>{}</li>", curve.ink.class(), escape(&curve.name));
        }
        html.push_str("</ul>\n");
        html
    }
}
