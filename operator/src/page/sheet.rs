//! Everything of one unit, section by section; in two columns where the terminal is wide enough.

mod calibration;
mod counters;
mod latency;
mod sensors;
mod temperatures;
mod work;

use isotherm_protocol::pair::PairReport;
use isotherm_protocol::service_status::ServiceStatus;
use isotherm_protocol::status::{SensorKind, SensorStatus, Status};
use ratatui::layout::{Constraint, Layout};
use ratatui::style::Style;
use ratatui::text::{Line, Span};
use ratatui::widgets::{Paragraph, Widget};

use super::figure::{fit, fit_middle, frequency, width, wrap};
use super::grid::{Column, Grid, drawn};
use super::pairs::{name, of_unit};
use super::remark::{Level, knows_rates};
use super::{Unit, tone};

/// From this width on sections stand in two columns.
const TWO_COLUMNS: usize = 150;
/// Lines longer than this are hard to read.
const WIDEST: usize = 110;
/// Blanks between the two columns.
const GUTTER: usize = 4;
/// Width of the names of fields.
const NAME: usize = 13;

/// A heading and what stands under it.
#[derive(Debug, Clone)]
pub(super) struct Section {
    title: &'static str,
    lines: Vec<Line<'static>>,
}

impl Section {
    fn new(title: &'static str) -> Self {
        Self { title, lines: Vec::new() }
    }

    /// A name and a text, over as many lines as it takes.
    fn field(&mut self, name: &str, text: &str, style: Style, columns: usize) {
        let mut name = name;
        for part in wrap(text, columns.saturating_sub(NAME + 2)) {
            let head = Span::styled(format!("  {name:NAME$}"), tone::DIM);
            self.lines.push(Line::from_iter([head, Span::styled(part, style)]));
            name = "";
        }
    }

    /// A table, moved in from the left; how wide it is. None where it has no rows.
    fn grid(&mut self, layout: &[Column], rows: &[Vec<Span<'static>>], columns: usize) -> usize {
        if rows.is_empty() {
            return 0;
        }
        let grid = Grid::set(layout, rows, columns.saturating_sub(2));
        let width = usize::from(grid.width) + 2;
        self.lines.extend(grid.indented());
        width
    }

    /// With its heading, and a blank line behind it.
    fn set(self) -> Vec<Line<'static>> {
        let title = Line::from(Span::styled(self.title, tone::HEAD));
        std::iter::once(title).chain(self.lines).chain([Line::default()]).collect()
    }
}

/// What a sensor is called.
pub(super) fn sensor_name(sensor: &SensorStatus) -> String {
    let kind = match sensor.kind {
        SensorKind::Gyro => "gyro",
        SensorKind::Accel => "accel",
    };
    // Where the document gives it no name it has a number.
    if sensor.name.starts_with(kind) { sensor.name.clone() } else { format!("{kind} {}", sensor.name) }
}

/// The page of a unit in at most `columns` columns; `service` is the instance that it belongs to, where that is known; the last line says what
/// all `instances` do for it.
pub fn sheet(
    unit: &Unit<'_>,
    service: Option<&ServiceStatus>,
    instances: &[PairReport],
    columns: usize,
) -> Vec<Line<'static>> {
    let two = columns >= TWO_COLUMNS;
    let of_one = if two { (columns - GUTTER) / 2 } else { columns.min(WIDEST) };
    let mut lines = title(unit, columns.min(WIDEST));
    let status = unit.status;
    let sections = [
        calibration::section(status, of_one),
        stream(status, service, &name(instances, &status.instance), of_one),
        temperatures::section(unit, of_one),
        calibration::correction(status, of_one),
        sensors::sensors(status, of_one),
        sensors::drift(status, of_one),
        work::pre_launch(status, of_one),
        work::self_test(status, of_one),
        counters::faults(unit, of_one),
        latency::section(&status.latency, of_one),
        counters::counters(status, of_one),
    ];
    let set: Vec<_> =
        sections.into_iter().filter(|section| !section.lines.is_empty()).map(Section::set).collect();
    if two {
        lines.extend(side_by_side(set, of_one));
    } else {
        lines.extend(set.into_iter().flatten());
    }
    for line in &mut lines {
        trim(line);
    }
    while lines.last().is_some_and(|line| line.width() == 0) {
        lines.pop();
    }
    lines.extend(of_unit(instances, &status.unit));
    lines
}

/// Takes the blanks at the end of a line away.
fn trim(line: &mut Line<'static>) {
    while let Some(last) = line.spans.last_mut() {
        let trimmed = last.content.trim_end();
        if !trimmed.is_empty() {
            last.content = trimmed.to_owned().into();
            return;
        }
        line.spans.pop();
    }
}

/// Serial, state and what is to be noticed.
fn title(unit: &Unit<'_>, columns: usize) -> Vec<Line<'static>> {
    let status = unit.status;
    let level = unit.level();
    let (mark, style) = level.mark(status.state);
    // What it is doing stands in a line of its own where the serial would have to be cut.
    let name = format!("  {}", status.state.name());
    let serial = fit_middle(&status.unit, columns.saturating_sub(2));
    let mut line =
        Line::from_iter([Span::styled(format!("{mark} "), style), Span::styled(serial, tone::HEAD)]);
    let mut lines = Vec::new();
    if line.width() + width(&name) > columns {
        lines.push(std::mem::replace(&mut line, Line::from(fit(&name, columns))));
    } else {
        line.push_span(name);
    }
    lines.push(line);
    for remark in unit.remarks() {
        let mut mark = match remark.level {
            Level::Fine | Level::Note => "·",
            level => level.mark(status.state).0,
        };
        for part in wrap(&remark.words, columns.saturating_sub(4)) {
            lines.push(Line::from(Span::styled(format!("  {mark} {part}"), remark.level.style())));
            mark = " ";
        }
    }
    lines.push(Line::default());
    lines
}

/// Where it comes from, what comes in, how far it is.
fn stream(status: &Status, service: Option<&ServiceStatus>, name: &str, columns: usize) -> Section {
    let mut section = Section::new("Stream");
    let mut field = |name: &str, text: &str| section.field(name, text, tone::PLAIN, columns);
    let mut by = format!("version {}", status.version);
    if !name.is_empty() {
        by = format!("{name}, {by}");
    }
    if let Some(pid) = service.and_then(|service| service.pid) {
        by = format!("{by}, pid {pid}");
    }
    field("service", &by);
    let rates = status.input_rates;
    if knows_rates(status) {
        let [gyro, accel, temperature, messages] = [
            rates.gyro_ticks_per_s,
            rates.accel_ticks_per_s,
            rates.temperature_readings_per_s,
            rates.messages_per_s,
        ]
        .map(frequency);
        let words = format!("{gyro} gyro ticks/s, {accel} accelerometer ticks/s,");
        field("input", &format!("{words} {temperature} temperature readings/s, in {messages} messages/s"));
    }
    match status.last_tick {
        Some(tick) => {
            field("last tick", &format!("sequence {}, series {}", tick.sequence, tick.series));
            field("", &format!("ended at {} ns on the producer's clock", tick.end_time_ns));
        }
        None => field("last tick", "none published yet"),
    }
    section
}

/// Sections in two columns of about the same height, in the order of reading.
fn side_by_side(sections: Vec<Vec<Line<'static>>>, of_one: usize) -> Vec<Line<'static>> {
    let heights: Vec<usize> = sections.iter().map(Vec::len).collect();
    let total: usize = heights.iter().sum();
    let height = |split: usize| {
        let left: usize = heights.iter().take(split).sum();
        left.max(total - left)
    };
    let split = (0..=sections.len()).min_by_key(|split| height(*split)).unwrap_or(0);
    let mut right = sections;
    let left: Vec<_> = right.drain(..split).flatten().collect();
    let right: Vec<_> = right.into_iter().flatten().collect();
    let size = |length: usize| u16::try_from(length).unwrap_or(u16::MAX);
    drawn(size(2 * of_one + GUTTER), size(height(split)), |area, buffer| {
        let columns = [Constraint::Length(size(of_one)); 2];
        let [on_the_left, on_the_right] = Layout::horizontal(columns).spacing(size(GUTTER)).areas(area);
        Paragraph::new(left).render(on_the_left, buffer);
        Paragraph::new(right).render(on_the_right, buffer);
    })
}
