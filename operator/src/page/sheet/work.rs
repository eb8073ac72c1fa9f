//! Pre-launch calibration and self-test.

use isotherm_correction::sample::LasingMode as Mode;
use isotherm_protocol::status::{
    ConstantsChange, PreLaunchGyro, PreLaunchMode, PreLaunchVerdict, SelfTestItem, Status,
};
use ratatui::text::{Line, Span};

use super::super::chart::bar;
use super::super::figure::{self, deg_per_h, digits, of, or_none, signed};
use super::super::grid::Column;
use super::super::tone;
use super::Section;

/// Width of the bar of progress.
const BAR: usize = 30;

/// The pre-launch calibration that is running, or else what came of the last one.
pub(super) fn pre_launch(status: &Status, columns: usize) -> Section {
    let mut section = Section::new("Pre-launch calibration");
    if let Some(progress) = &status.pre_launch {
        let (share, left) = figure::progress(progress);
        let full = bar(share, BAR);
        let empty = "░".repeat(BAR.saturating_sub(full.chars().count()));
        section.lines.push(Line::from(format!("  {full}{empty} {:.0} %, {left} left", share * 100.0)));
        let layout = [
            Column::words("gyro", 0, 6),
            Column::number("σ °/h", 0, 7),
            Column::words("ticks of each mode", 1, 10),
        ];
        let rows: Vec<_> = progress.gyros.iter().map(gyro).collect();
        section.grid(&layout, &rows, columns);
        return section;
    }
    let Some(outcome) = &status.pre_launch_outcome else { return section };
    match &outcome.verdict {
        PreLaunchVerdict::Accepted(changes) => {
            let overlay = outcome.overlay.map_or_else(
                || "not stored".to_owned(),
                |digest| format!("overlay {}", figure::digest(Some(digest), [0; 8])),
            );
            section.field("last one", &format!("accepted, {overlay}"), tone::PLAIN, columns);
            let layout = [
                Column::words("gyro", 0, 6),
                Column::number("ΔC0 °/h", 0, 8),
                Column::number("σ", 0, 6),
                Column::number("ΔB0 °/h", 0, 8),
                Column::number("σ", 0, 6),
            ];
            let rows: Vec<_> = changes.iter().map(change).collect();
            section.grid(&layout, &rows, columns);
        }
        PreLaunchVerdict::Refused(reasons) => {
            section.field("last one", "refused; the constants stay", tone::WARNING, columns);
            for reason in reasons {
                section.field("", reason, tone::PLAIN, columns);
            }
        }
        PreLaunchVerdict::Aborted => {
            section.field("last one", "aborted; the constants stay", tone::PLAIN, columns);
        }
    }
    section
}

fn gyro(gyro: &PreLaunchGyro) -> Vec<Span<'static>> {
    let sigma = or_none(gyro.sigma_rad_per_s, |sigma| digits(deg_per_h(sigma)));
    let modes: Vec<_> = gyro.modes.iter().map(mode).collect();
    vec![Span::raw(gyro.name.clone()), Span::raw(sigma), Span::raw(modes.join(", "))]
}

fn mode(mode: &PreLaunchMode) -> String {
    let name = match mode.mode {
        Some(Mode::Plus) => "plus ",
        Some(Mode::Minus) => "minus ",
        None => "",
    };
    format!("{name}{} in {:.0} s", mode.ticks, mode.time_s)
}

fn change(change: &ConstantsChange) -> Vec<Span<'static>> {
    let maybe = |value: Option<f64>, words: fn(f64) -> String| {
        Span::raw(or_none(value, |value| words(deg_per_h(value))))
    };
    vec![
        Span::raw(change.gyro.clone()),
        maybe(Some(change.static_bias_change_rad_per_s), signed),
        maybe(Some(change.static_bias_sigma_rad_per_s), digits),
        maybe(change.magnetic_bias_change_rad_per_s, signed),
        maybe(change.magnetic_bias_sigma_rad_per_s, digits),
    ]
}

/// The last self-test: what failed in it, and how much was checked.
pub(super) fn self_test(status: &Status, columns: usize) -> Section {
    let mut section = Section::new("Self-test");
    let Some(report) = &status.self_test else { return section };
    let failed: Vec<_> = report.items.iter().filter(|item| !item.passed).collect();
    let checked = of(report.items.len(), "check");
    let (words, style) = if report.passed {
        (format!("passed: {checked} over {:.1} s", report.length_s), tone::PLAIN)
    } else {
        (format!("failed: {} of {checked} over {:.1} s", failed.len(), report.length_s), tone::FAULT)
    };
    section.field("last one", &words, style, columns);
    for item in failed {
        let name = Span::styled(format!("  ! {}: ", item.name), tone::FAULT);
        section.lines.push(Line::from_iter([name, Span::raw(measured(item))]));
    }
    section
}

/// Value and limits of a check.
fn measured(item: &SelfTestItem) -> String {
    let unit =
        if item.unit_of_measure.is_empty() { String::new() } else { format!(" {}", item.unit_of_measure) };
    let value = item.value.map_or_else(|| "nothing came".to_owned(), |value| format!("{value}{unit}"));
    let limits = match (item.at_least, item.at_most) {
        (Some(low), Some(high)) => format!(", must be {low} to {high}{unit}"),
        (Some(low), None) => format!(", must be at least {low}{unit}"),
        (None, Some(high)) => format!(", must be at most {high}{unit}"),
        (None, None) => String::new(),
    };
    format!("{value}{limits}")
}
