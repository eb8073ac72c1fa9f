//! Health of the sensors, and what the drift estimator knows.

use isotherm_correction::sample::SensorFlags;
use isotherm_protocol::status::{DriftStatus, Rest, SensorStatus, Status};
use ratatui::style::Style;
use ratatui::text::Span;

use super::super::figure::{NONE, count, deg_per_h, digits, or_none, signed};
use super::super::grid::Column;
use super::super::remark::sensor_words;
use super::super::tone;
use super::{Section, sensor_name};

/// A line a sensor: how it is now, and how many ticks something was wrong with.
pub(super) fn sensors(status: &Status, columns: usize) -> Section {
    let number = |head, rank| Column::number(head, rank, head.len());
    let layout = [
        Column::words("", 0, 8),
        Column::words("now", 0, 4),
        number("ticks", 7),
        number("invalid", 1),
        number("excluded", 2),
        number("overrange", 3),
        number("not finite", 4),
        number("clamped", 5),
        number("stale", 6),
    ];
    let rows: Vec<_> = status.sensors.iter().map(row).collect();
    let mut section = Section::new("Sensors, in ticks since the start");
    section.grid(&layout, &rows, columns);
    section
}

fn row(sensor: &SensorStatus) -> Vec<Span<'static>> {
    let (now, style) = now(sensor);
    let number = |number: u64| Span::styled(count(number), if number == 0 { tone::DIM } else { tone::PLAIN });
    let SensorStatus { ticks, invalid, overrange, not_finite, clamped, stale, excluded, .. } = *sensor;
    let counts = [ticks, invalid, excluded, overrange, not_finite, clamped, stale].map(number);
    [Span::raw(sensor_name(sensor)), Span::styled(now, style)].into_iter().chain(counts).collect()
}

/// The last tick's flags in words.
fn now(sensor: &SensorStatus) -> (String, Style) {
    let wrong = sensor_words(sensor.flags);
    if !wrong.is_empty() {
        return (wrong.join(", "), tone::FAULT);
    }
    let flags = SensorFlags::from_bits_truncate(sensor.flags);
    if flags.contains(SensorFlags::STALE_TEMPERATURE) {
        ("stale temperature".to_owned(), tone::WARNING)
    } else if flags.intersects(SensorFlags::CLAMPED_TEMPERATURE | SensorFlags::CLAMPED_RATE) {
        ("clamped".to_owned(), tone::WARNING)
    } else if sensor.ticks == 0 {
        (NONE.to_owned(), tone::PLAIN)
    } else if flags.contains(SensorFlags::VALID) {
        ("good".to_owned(), tone::PLAIN)
    } else {
        // Over a mode switch, most often.
        ("not used".to_owned(), tone::PLAIN)
    }
}

/// Estimates of the drift estimator, and whether the unit stands still for it.
pub(super) fn drift(status: &Status, columns: usize) -> Section {
    let mut section = Section::new("Drift estimates");
    let layout = [
        Column::words("", 0, 8),
        Column::number("°/h", 0, 8),
        Column::number("σ °/h", 0, 7),
        Column::number("°/h per h", 3, 8),
        Column::number("used", 2, 5),
        Column::number("refused", 2, 7),
        Column::number("NIS", 4, 5),
        Column::words("", 1, 10),
    ];
    let rows: Vec<_> = status.drift.iter().map(estimate).collect();
    section.grid(&layout, &rows, columns);
    let rest = match &status.rest {
        None => return section,
        Some(Rest::Learning) => "declared; too few ticks yet".to_owned(),
        Some(Rest::Still) => "declared; the unit is still".to_owned(),
        Some(Rest::Moved(words)) => format!("declared, but it moved: {words}"),
    };
    let style = if matches!(status.rest, Some(Rest::Moved(_))) { tone::WARNING } else { tone::PLAIN };
    section.field("rest", &rest, style, columns);
    section
}

fn estimate(drift: &DriftStatus) -> Vec<Span<'static>> {
    vec![
        Span::raw(format!(
            "gyro {}",
            drift.gyro.trim_start_matches("gyro").trim_start_matches([' ', '-', '_'])
        )),
        Span::raw(signed(deg_per_h(drift.rate_rad_per_s))),
        Span::raw(digits(deg_per_h(drift.sigma_rad_per_s))),
        Span::raw(signed(deg_per_h(drift.trend_rad_per_s2) * 3600.0)),
        Span::raw(count(drift.updates)),
        Span::raw(count(drift.refused)),
        Span::raw(or_none(drift.mean_nis, digits)),
        Span::styled(
            if drift.subtracted { "subtracted" } else { "reported" },
            if drift.subtracted { tone::PLAIN } else { tone::DIM },
        ),
    ]
}
