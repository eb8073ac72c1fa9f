//! Reports: one HTML file each, with plots inside, that needs nothing beside it and nothing from a network.
//!
//! A [`Page`] is made of paragraphs, tables and [`Figure`]s. A figure stacks [`Panel`]s over one common horizontal axis;
//! it is drawn twice, for a wide and for a narrow window, so that its text keeps its size on a phone. Colours are named by
//! what they stand for ([`Ink`]) and follow the reader's light or dark setting.
//!
//! What this module refuses to do: know anything of units, calibrations or demos.

mod axis;
mod decimate;
mod draw;
mod figure;
mod page;

pub use draw::ReportError;
pub use figure::{Curve, Figure, Ink, Mark, Panel};
pub use page::{Page, Table};

/// A time axis that suits a span: by what to divide seconds, and the symbol of the unit that results.
#[must_use]
pub fn time_unit(span_s: f64) -> (f64, &'static str) {
    match span_s {
        span if span < 0.5 => (1e-3, "ms"),
        span if span < 900.0 => (1.0, "s"),
        span if span < 5.0 * 3600.0 => (60.0, "min"),
        _ => (3600.0, "h"),
    }
}
