//! Temperature channels, with their course where somebody has looked on.

use std::time::Duration;

use isotherm_protocol::status::{ChannelStatus, Place};
use ratatui::style::Style;
use ratatui::text::{Line, Span};

use super::super::chart::spark;
use super::super::figure;
use super::super::grid::Column;
use super::super::{Past, Unit, tone};
use super::Section;

/// Courses narrower than this show nothing.
const NARROWEST: usize = 8;
/// Blanks before a course.
const BEFORE: usize = 2;
/// The course of a temperature is shown over no less than this (°C).
const LEAST_SPAN_DEG_C: f64 = 0.1;
/// The course of a rate, over no less than this (°C/s).
const LEAST_SPAN_DEG_C_PER_S: f64 = 0.001;

/// A line a channel.
pub(super) fn section(unit: &Unit<'_>, columns: usize) -> Section {
    let layout = [
        Column::words("channel", 0, 9),
        Column::number("°C", 0, 6),
        Column::number("°C/min", 0, 6),
        Column::number("calibrated", 2, 9),
        Column::words("", 1, 6),
    ];
    let rows: Vec<_> = unit.status.channels.iter().map(row).collect();
    let mut section = Section::new("Temperatures");
    let used = section.grid(&layout, &rows, columns);
    courses(&mut section.lines, unit, columns.saturating_sub(used));
    section
}

fn row(channel: &ChannelStatus) -> Vec<Span<'static>> {
    let (place, style) = place(channel);
    let range = figure::or_none(channel.calibrated_range_deg_c, |[low, high]| format!("{low} … {high}"));
    vec![
        Span::raw(channel.name.as_str().to_owned()),
        Span::styled(figure::temperature(channel.temperature_deg_c), style),
        Span::raw(figure::temperature_rate(channel.rate_deg_c_per_s)),
        Span::raw(range),
        Span::styled(place, style),
    ]
}

fn place(channel: &ChannelStatus) -> (&'static str, Style) {
    if channel.stale {
        return ("stale", tone::WARNING);
    }
    match channel.place {
        Some(Place::Below) => ("below", tone::WARNING),
        Some(Place::Above) => ("above", tone::WARNING),
        Some(Place::Inside) | None if channel.warming_up => ("warming up", tone::DIM),
        Some(Place::Inside) => ("inside", tone::PLAIN),
        None => ("", tone::PLAIN),
    }
}

/// Puts the courses of temperature and rate behind the lines of the channels, as far as there is room.
fn courses(lines: &mut [Line<'static>], unit: &Unit<'_>, left: usize) {
    let room = left / 2;
    if unit.past.len() < 2 || room < NARROWEST + BEFORE {
        return;
    }
    let width = room - BEFORE;
    let ends = unit.past.first().zip(unit.past.last());
    let span = ends.map_or(Duration::ZERO, |(first, last)| last.at.saturating_duration_since(first.at));
    let heads = [format!("°C, {}", figure::since(span)), "°C/min".to_owned()];
    let [head, channels @ ..] = lines else { return };
    for title in heads {
        let title = figure::fit(&title, width);
        let blanks = width.saturating_sub(figure::width(&title));
        head.push_span(Span::styled(format!("  {title}{}", " ".repeat(blanks)), tone::HEAD));
    }
    for (line, channel) in channels.iter_mut().zip(&unit.status.channels) {
        let course = |value: &dyn Fn(f64, f64) -> f64| -> Vec<f64> {
            let at = |past: &Past| {
                let found = past.channels.iter().find(|(name, ..)| *name == channel.name);
                found.map_or(f64::NAN, |(_, temperature, rate)| value(*temperature, *rate))
            };
            unit.past.iter().map(at).collect()
        };
        let temperature = spark(&course(&|temperature, _| temperature), width, LEAST_SPAN_DEG_C);
        let rate = spark(&course(&|_, rate| rate), width, LEAST_SPAN_DEG_C_PER_S);
        for course in [temperature, rate] {
            let blanks = width.saturating_sub(figure::width(&course));
            line.push_span(format!("  {course}{}", " ".repeat(blanks)));
        }
    }
}
