//! The screen, drawn from what is known and what the operator looks at.

use std::time::Instant;

use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Position, Rect};
use ratatui::style::{Modifier, Style};
use ratatui::text::{Line, Span};
use ratatui::widgets::Paragraph;

use super::fleet::{Fleet, Key};
use super::help;
use super::order::arrange;
use super::view::{Shown, View};
use crate::page::{self, Unit, tone};

/// The selected line.
const SELECTED: Style = Style::new().add_modifier(Modifier::REVERSED);
/// Share of the screen that lines of services may take, one part in this many.
const SERVICES_SHARE: usize = 6;

/// Draws everything.
pub(super) fn draw(frame: &mut Frame<'_>, fleet: &Fleet, view: &mut View, now: Instant, now_unix_ms: i64) {
    let area = frame.area();
    let columns = usize::from(area.width);
    let all = fleet.units(now, now_unix_ms);
    // A page needs the room more.
    let head = match view.shown {
        Shown::Table => head(fleet, &all, columns, usize::from(area.height)),
        Shown::Page | Shown::Help => Vec::new(),
    };
    let head_height = u16::try_from(head.len()).unwrap_or(u16::MAX);
    let [top, middle, bottom] =
        Layout::vertical([Constraint::Length(head_height), Constraint::Fill(1), Constraint::Length(1)])
            .areas(area);
    let rows = usize::from(middle.height).saturating_sub(1);
    let known = all.len();
    let units = arrange(all, view.sort, view.reversed, &view.filter);
    let order: Vec<Key> =
        units.iter().map(|unit| (unit.status.unit.clone(), unit.status.instance.clone())).collect();
    view.arrange(order, rows);
    frame.render_widget(Paragraph::new(head), top);
    let at = view.selected_at();
    let selected = at.and_then(|at| units.get(at));
    let place = match (view.shown, selected) {
        (Shown::Help, _) => scrolled(frame, middle, view, help::lines()),
        (Shown::Page, Some(unit)) => {
            let lines = page::sheet(unit, fleet.service_of(unit.status), &fleet.pairs, columns);
            scrolled(frame, middle, view, lines)
        }
        // Nothing to show a page of: the filter, or the last unit's end, has left none.
        (Shown::Page | Shown::Table, _) => {
            table(frame, middle, view, &units, known);
            let first = view.table.offset();
            places(first, rows.min(units.len().saturating_sub(first)), units.len())
        }
    };
    foot(frame, bottom, view, &place);
}

/// Services, the tally, and a blank line where there is room for it.
fn head(fleet: &Fleet, units: &[Unit<'_>], columns: usize, height: usize) -> Vec<Line<'static>> {
    let (services, gone) = fleet.services();
    let mut lines = page::pairs(&fleet.pairs, columns);
    lines.extend(page::services((&services, &gone), &fleet.pairs, columns));
    let most = (height / SERVICES_SHARE).max(1);
    if lines.len() > most {
        let more = lines.len() - most + 1;
        lines.truncate(most.saturating_sub(1));
        lines.push(Line::from(Span::styled(format!("and {more} more lines: isotherm status"), tone::DIM)));
    }
    let mut tally = page::tally(units, columns);
    if fleet.not_understood > 0 {
        let statuses = if fleet.not_understood == 1 { "status" } else { "statuses" };
        let words = format!("  ▲ {} {statuses} of another version", fleet.not_understood);
        tally.push_span(Span::styled(words, tone::WARNING));
    }
    lines.extend([tally, Line::default()]);
    lines
}

/// The table, as far as the selected line asks for.
fn table(frame: &mut Frame<'_>, area: Rect, view: &mut View, units: &[Unit<'_>], known: usize) {
    // Set from all units, so that columns stay where they are while one scrolls.
    let table = page::units(units, usize::from(area.width)).table.row_highlight_style(SELECTED);
    frame.render_stateful_widget(table, area, &mut view.table);
    if units.is_empty() {
        let words = if known == 0 {
            "no unit has appeared yet: units appear with their first raw message"
        } else {
            "no unit matches the filter: Esc ends it"
        };
        let below = area.rows().nth(1).unwrap_or_default();
        frame.render_widget(Line::styled(words, tone::DIM), below);
    }
}

/// Lines from the one that was scrolled to on; which these are.
fn scrolled(frame: &mut Frame<'_>, area: Rect, view: &mut View, lines: Vec<Line<'static>>) -> String {
    let height = usize::from(area.height);
    view.height = height;
    view.page_first = view.page_first.min(lines.len().saturating_sub(height));
    let scroll = u16::try_from(view.page_first).unwrap_or(u16::MAX);
    let of = lines.len();
    frame.render_widget(Paragraph::new(lines).scroll((scroll, 0)), area);
    places(view.page_first, height.min(of), of)
}

/// "4–20 of 200", or nothing where all is to be seen.
fn places(first: usize, shown: usize, of: usize) -> String {
    if shown >= of { String::new() } else { format!("{}–{} of {of}", first + 1, first + shown) }
}

/// Keys on the left, what is to be seen on the right; the filter where it is typed.
fn foot(frame: &mut Frame<'_>, area: Rect, view: &View, place: &str) {
    let order =
        if view.reversed { format!("{}, reversed", view.sort.name()) } else { view.sort.name().to_owned() };
    let words = match view.shown {
        Shown::Table if view.typing => format!("/{}", view.filter),
        Shown::Table => {
            let filter =
                if view.filter.is_empty() { "filter".to_owned() } else { format!("filter: {}", view.filter) };
            format!("q quit  ↑↓ select  ⏎ details  s sort: {order}  / {filter}  ? help")
        }
        Shown::Page => "q quit  Esc back  ↑↓ scroll  ←→ other units  ? help".to_owned(),
        Shown::Help => "q quit  Esc back  ↑↓ scroll".to_owned(),
    };
    let place = Line::styled(place.to_owned(), tone::DIM);
    let width = u16::try_from(place.width()).unwrap_or(u16::MAX);
    let [left, right] =
        Layout::horizontal([Constraint::Fill(1), Constraint::Length(width)]).spacing(2).areas(area);
    let words = Line::styled(page::fit(&words, usize::from(left.width)), tone::DIM);
    if view.typing && view.shown == Shown::Table {
        let x = u16::try_from(words.width()).unwrap_or(u16::MAX);
        frame.set_cursor_position(Position::new(area.x.saturating_add(x), area.y));
    }
    frame.render_widget(words, left);
    frame.render_widget(place, right);
}
