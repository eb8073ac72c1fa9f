//! The calibration in force, the one that waits, and what is subtracted.

use isotherm_cli::grouped;
use isotherm_protocol::history::WallTime;
use isotherm_protocol::status::{ActiveCalibration, Output, Status};
use ratatui::text::Span;

use super::super::figure::{self, signed, since_s};
use super::super::grid::Column;
use super::super::remark::schedule;
use super::super::tone;
use super::Section;

/// Calibration, pending change, swaps.
pub(super) fn section(status: &Status, columns: usize) -> Section {
    let mut section = Section::new("Calibration");
    match &status.calibration {
        Some(calibration) => in_force(&mut section, calibration, columns),
        None => section.field("revision", none(status.output), tone::WARNING, columns),
    }
    if let Some(pending) = &status.pending {
        let digest = figure::digest(pending.digest, pending.revision.digest);
        let when = schedule(pending.schedule, pending.slew_s);
        let words = format!("revision {} ({digest}) {when}; {}", pending.revision.counter, pending.source);
        section.field("waits", &words, tone::PLAIN, columns);
    }
    let swaps = &status.swaps;
    let words = format!("{} accepted, {} refused", grouped(swaps.accepted), grouped(swaps.refused));
    section.field("swaps", &words, tone::PLAIN, columns);
    if let Some(refusal) = &swaps.last_refusal {
        section.field("last refusal", refusal, tone::PLAIN, columns);
    }
    section
}

fn none(output: Output) -> &'static str {
    match output {
        Output::Held => "none: nothing is published, as configured",
        Output::PassThrough | Output::Calibrated => "none: raw readings pass through, flagged",
    }
}

fn in_force(section: &mut Section, calibration: &ActiveCalibration, columns: usize) {
    let mut field = |name: &str, text: &str| section.field(name, text, tone::PLAIN, columns);
    let digest = figure::digest(calibration.digest, calibration.revision.digest);
    field("revision", &format!("{} ({digest})", calibration.revision.counter));
    if !calibration.source.is_empty() {
        field("from", &calibration.source);
    }
    match (calibration.created_unix_s.and_then(day), age(calibration)) {
        (Some(day), Some(age)) => field("made", &format!("{day}, {age}")),
        (Some(made), None) | (None, Some(made)) => field("made", &made),
        (None, None) => field("made", "not stated in the document"),
    }
    if let Some(overlay) = calibration.overlay {
        field("overlay", &figure::digest(Some(overlay), [0; 8]));
    }
}

fn age(calibration: &ActiveCalibration) -> Option<String> {
    Some(match (figure::days(calibration), calibration.age_s?) {
        (Some(0), _) => "today".to_owned(),
        (Some(1), _) => "1 day old".to_owned(),
        (Some(days), _) => format!("{days} days old"),
        (None, age_s) if age_s < 0 => since_s(age_s),
        (None, age_s) => format!("{} ago", since_s(age_s)),
    })
}

/// The day of a time (s since 1970-01-01 UTC); `None` before that, and beyond the year 9999.
fn day(unix_s: i64) -> Option<String> {
    let time = WallTime::from_unix_ms(unix_s.checked_mul(1000)?);
    // Beyond what it holds, it is another time.
    (time.unix_ms() / 1000 == unix_s).then(|| time.to_string().chars().take(10).collect())
}

/// What is subtracted at present, by case axis.
pub(super) fn correction(status: &Status, columns: usize) -> Section {
    let mut section = Section::new("Correction subtracted, in case axes");
    let Some(applied) = status.applied else { return section };
    let rates = applied.angular_rate_rad_per_s.map(figure::deg_per_h);
    let forces = applied.specific_force_m_per_s2.map(figure::milli_g);
    let row = |name: &'static str, values: [f64; 3]| {
        let cells = values.into_iter().map(|value| Span::raw(signed(value)));
        std::iter::once(Span::styled(name, tone::DIM)).chain(cells).collect()
    };
    let [x, y, z] = ["x", "y", "z"].map(|axis| Column::number(axis, 0, 9));
    let layout = [Column::words("", 0, super::NAME - 2), x, y, z];
    section.grid(&layout, &[row("°/h", rates), row("mg", forces)], columns);
    section
}
