//! One line a unit.

use isotherm_protocol::status::{ChannelStatus, Place, Status};
use ratatui::style::Style;
use ratatui::text::Span;

use super::grid::{Column, Grid};
use super::remark::{Level, knows_rates};
use super::{Lately, Unit, figure, state_word, tone};

/// Widest that a serial may stand; a longer one is cut in its middle.
const WIDEST_SERIAL: usize = 24;

/// The columns, in the order of [`row`].
const COLUMNS: [Column; 16] = [
    Column::words("", 0, 1),
    Column::words("unit", 0, 8),
    Column::words("state", 1, 9),
    Column::number("rev", 5, 3),
    Column::number("°C", 1, 5),
    Column::number("°C/min", 10, 6),
    Column::words("range", 2, 6),
    Column::number("°/h", 6, 5),
    Column::number("mg", 11, 5),
    Column::number("Hz", 3, 5),
    Column::number("gaps", 7, 4),
    Column::number("dup", 14, 3),
    Column::number("late", 13, 4),
    Column::number("bad", 9, 3),
    Column::number("p99", 8, 7),
    Column::number("cal. age", 12, 8),
];

/// What is to be noticed, at the end of each line, gets one part in this many of the line at least.
const NOTE_SHARE: usize = 6;

/// The table: a line a unit, in the order given, in at most `columns` columns of the terminal.
pub fn units(units: &[Unit<'_>], columns: usize) -> Grid {
    let note = Column::filling("note", 4, columns / NOTE_SHARE);
    let layout: Vec<Column> = COLUMNS.into_iter().chain([note]).collect();
    let rows: Vec<Vec<Span<'static>>> = units.iter().map(row).collect();
    Grid::set(&layout, &rows, columns)
}

fn row(unit: &Unit<'_>) -> Vec<Span<'static>> {
    let (status, lately, sums) = (unit.status, unit.lately, Lately::counted(unit.status));
    let remarks = unit.remarks();
    let level = unit.level();
    let (mark, mark_style) = level.mark(status.state);
    // What is gone or does not run is dim as a whole: its numbers are old, or of no weight.
    let base = if level == Level::Gone || !status.state.is_running() { tone::DIM } else { tone::PLAIN };
    let (range, range_style) = range(status);
    let serial = figure::fit_middle(&status.unit, WIDEST_SERIAL);
    let or_base = |style: Style| if base == tone::DIM { base } else { style };
    let counter = |count: u64, grown: u64| {
        let style = match (count, grown) {
            (0, _) => tone::DIM,
            (_, 0) => tone::PLAIN,
            _ => tone::WARNING,
        };
        Span::styled(figure::count(count), or_base(style))
    };
    let rate = status.input_rates.gyro_ticks_per_s;
    let rate = figure::or_none(knows_rates(status).then_some(rate), figure::frequency);
    let in_view = channel_in_view(status);
    let age = status.calibration.as_ref().and_then(figure::age);
    let note = remarks.first();
    let cell = |text: String| Span::styled(text, base);
    let (deg_per_h, mg) = applied(status).map(Into::into).unzip();
    let revision = status.calibration.as_ref().map(|calibration| calibration.revision.counter);
    let p99_ns = Some(status.latency.p99_ns).filter(|p99_ns| *p99_ns > 0);
    vec![
        Span::styled(mark, mark_style),
        Span::styled(serial, if level > Level::Warning { level.style() } else { base }),
        cell(state_word(status.state).to_owned()),
        cell(figure::or_none(revision, |counter| counter.to_string())),
        Span::styled(figure::temperature(in_view.and_then(|c| c.temperature_deg_c)), or_base(range_style)),
        cell(figure::temperature_rate(in_view.and_then(|c| c.rate_deg_c_per_s))),
        Span::styled(range, or_base(range_style)),
        cell(figure::or_none(deg_per_h, figure::digits)),
        cell(figure::or_none(mg, figure::digits)),
        cell(rate),
        counter(sums.gaps, lately.gaps),
        counter(sums.duplicates, lately.duplicates),
        counter(sums.late, lately.late),
        counter(sums.bad, lately.bad),
        cell(figure::or_none(p99_ns, figure::latency)),
        cell(figure::or_none(age, |age| age)),
        Span::styled(
            note.map_or_else(String::new, |remark| remark.words.clone()),
            note.map_or(
                base,
                |remark| if remark.level == Level::Note { tone::DIM } else { remark.level.style() },
            ),
        ),
    ]
}

/// The channel whose temperature stands in the line: the first that is stale or outside its range, else the first.
#[must_use]
pub fn channel_in_view(status: &Status) -> Option<&ChannelStatus> {
    let odd = |channel: &&ChannelStatus| {
        channel.stale || matches!(channel.place, Some(Place::Below | Place::Above))
    };
    status.channels.iter().find(odd).or_else(|| status.channels.first())
}

/// Where the temperatures lie, all of them together, and how it looks.
#[must_use]
pub fn range(status: &Status) -> (&'static str, Style) {
    let some = |is: &dyn Fn(&ChannelStatus) -> bool| status.channels.iter().any(is);
    if some(&|channel| channel.stale) {
        ("stale", tone::WARNING)
    } else if some(&|channel| channel.place == Some(Place::Above)) {
        ("above", tone::WARNING)
    } else if some(&|channel| channel.place == Some(Place::Below)) {
        ("below", tone::WARNING)
    } else if some(&|channel| channel.place == Some(Place::Inside)) {
        ("inside", tone::PLAIN)
    } else {
        (figure::NONE, tone::PLAIN)
    }
}

/// Sizes of angular rate (°/h) and specific force (mg) that are subtracted.
#[must_use]
pub fn applied(status: &Status) -> Option<[f64; 2]> {
    let applied = status.applied?;
    let rate = figure::deg_per_h(length(applied.angular_rate_rad_per_s));
    Some([rate, figure::milli_g(length(applied.specific_force_m_per_s2))])
}

/// Length of a vector.
fn length(vector: [f64; 3]) -> f64 {
    vector.iter().map(|value| value * value).sum::<f64>().sqrt()
}
