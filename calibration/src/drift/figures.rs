//! Figures as text: units of measure, digits, tables.

use comfy_table::{CellAlignment, Table, presets};

use super::columns::Kind;
use super::markov::Estimate;
use crate::allan::Term;

/// Factor from readings and seconds to the unit of measure that a coefficient is stated in, and its symbol.
#[must_use]
pub fn stated_in(term: Term, kind: Kind) -> (f64, &'static str) {
    match (term, kind) {
        (Term::Quantization, Kind::Rate) => (1.0, "″"),
        (Term::AngleRandomWalk, Kind::Rate) => (1.0 / 60.0, "°/√h"),
        (Term::BiasInstability, Kind::Rate) => (1.0, "°/h"),
        (Term::RateRandomWalk, Kind::Rate) => (60.0, "°/h/√h"),
        (Term::RateRamp, Kind::Rate) => (3600.0, "°/h²"),
        (Term::Quantization, Kind::Force) => (1.0, "m/s"),
        (Term::AngleRandomWalk, Kind::Force) => (60.0, "m/s/√h"),
        (Term::BiasInstability, Kind::Force) => (1.0, "m/s²"),
        (Term::RateRandomWalk, Kind::Force) => (60.0, "m/s²/√h"),
        (Term::RateRamp, Kind::Force) => (3600.0, "m/s²/h"),
    }
}

/// Three significant digits.
#[must_use]
pub fn short(value: f64) -> String {
    let size = value.abs();
    if size == 0.0 || !size.is_finite() {
        format!("{value}")
    } else if !(1e-3..1e5).contains(&size) {
        format!("{value:.2e}")
    } else {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "between 0 and 5")]
        let places = (2.0 - libm::floor(libm::log10(size))).clamp(0.0, 5.0) as usize;
        format!("{value:.places$}")
    }
}

/// A number with its interval.
#[must_use]
pub fn with_interval(estimate: &Estimate) -> String {
    match estimate.interval {
        Some([low, high]) => format!("{} ({}…{})", short(estimate.value), short(low), short(high)),
        None => format!("{} (not bounded)", short(estimate.value)),
    }
}

/// A table as text, numbers to the right.
#[must_use]
pub fn table(head: &[String], rows: &[Vec<String>]) -> String {
    let mut table = Table::new();
    table.load_preset(presets::NOTHING).set_header(head).add_rows(rows);
    for column in table.column_iter_mut().skip(1) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    table.to_string()
}
