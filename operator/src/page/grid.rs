//! Tables that fit: columns of least weight are left out rather than lines wrapped. The rest ratatui's table does.

use ratatui::buffer::Buffer;
use ratatui::layout::{Constraint, Rect};
use ratatui::text::{Line, Span};
use ratatui::widgets::{Cell, Row, Table, Widget};

use super::figure::{fit, width};
use super::tone;

/// Blanks between two columns.
const BETWEEN: u16 = 2;

/// A column.
#[derive(Debug, Clone, Copy)]
pub(super) struct Column {
    head: &'static str,
    /// Aligned to the right.
    right: bool,
    /// Weight: columns are left out in falling order of this number; 0 never.
    rank: u8,
    /// It is never narrower than this, so that a live table does not waver.
    least: usize,
    /// It takes what the others leave over; a longer text is cut.
    fills: bool,
}

impl Column {
    /// Words.
    pub(super) const fn words(head: &'static str, rank: u8, least: usize) -> Self {
        Self { head, right: false, rank, least, fills: false }
    }

    /// Numbers.
    pub(super) const fn number(head: &'static str, rank: u8, least: usize) -> Self {
        Self { head, right: true, rank, least, fills: false }
    }

    /// Words that take what is left over.
    pub(super) const fn filling(head: &'static str, rank: u8, least: usize) -> Self {
        Self { head, right: false, rank, least, fills: true }
    }

    fn set<'a>(&self, text: Span<'a>) -> Cell<'a> {
        let line = Line::from(text);
        Cell::from(if self.right { line.right_aligned() } else { line })
    }
}

/// A table, how wide it is and how many rows it has.
#[derive(Debug, Clone)]
pub struct Grid {
    /// The table itself, with its head.
    pub table: Table<'static>,
    pub(super) width: u16,
    rows: u16,
}

impl Grid {
    /// Sets the table in at most `columns` columns of the terminal.
    pub(super) fn set(layout: &[Column], rows: &[Vec<Span<'static>>], columns: usize) -> Self {
        let columns = u16::try_from(columns).unwrap_or(u16::MAX);
        // Of each column what it asks for, and what it could do with.
        let widths = layout.iter().enumerate().map(|(index, column)| {
            let least = column.least.max(width(column.head));
            let cells = rows.iter().filter_map(|row| row.get(index)).map(Span::width);
            let widest = cells.max().unwrap_or(0).max(least);
            let [wanted, widest] = [if column.fills { least } else { widest }, widest]
                .map(|width| u16::try_from(width).unwrap_or(u16::MAX));
            (index, column, wanted, widest)
        });
        let mut shown: Vec<_> = widths.collect();
        let taken = |shown: &[(usize, &Column, u16, u16)]| {
            let widths = shown.iter().map(|(_, _, wanted, _)| wanted.saturating_add(BETWEEN));
            widths.fold(0, u16::saturating_add).saturating_sub(BETWEEN)
        };
        while taken(&shown) > columns {
            let candidates = shown.iter().enumerate().filter(|(_, (_, column, ..))| column.rank > 0);
            let Some((least, _)) = candidates.max_by_key(|(_, (_, column, ..))| column.rank) else { break };
            shown.remove(least);
        }
        // What stays though there is no room for all of it is cut where it is widest.
        let over = taken(&shown).saturating_sub(columns);
        if let Some((_, _, wanted, _)) = shown.iter_mut().max_by_key(|(_, _, wanted, _)| *wanted) {
            *wanted = wanted.saturating_sub(over);
        }
        let left = columns.saturating_sub(taken(&shown));
        for (_, _, wanted, widest) in shown.iter_mut().filter(|(_, column, ..)| column.fills) {
            *wanted = wanted.saturating_add(left).min(*widest);
        }
        let head = shown.iter().map(|(_, column, ..)| column.set(Span::styled(column.head, tone::HEAD)));
        let head = Row::new(head.collect::<Vec<_>>());
        let row = |cells: &Vec<Span<'static>>| {
            let cells = shown.iter().filter_map(|(index, column, width, _)| {
                let cell = cells.get(*index)?;
                Some(column.set(Span::styled(fit(&cell.content, usize::from(*width)), cell.style)))
            });
            Row::new(cells.collect::<Vec<_>>())
        };
        let widths = shown.iter().map(|(_, _, wanted, _)| Constraint::Length(*wanted));
        let table = Table::new(rows.iter().map(row), widths).header(head).column_spacing(BETWEEN);
        let width = taken(&shown).min(columns);
        Self { table, width, rows: u16::try_from(rows.len()).unwrap_or(u16::MAX) }
    }

    /// As lines, the head first.
    pub fn lines(self) -> Vec<Line<'static>> {
        drawn(self.width, self.rows.saturating_add(1), |area, buffer| {
            Widget::render(self.table, area, buffer);
        })
    }

    /// The same, moved in from the left.
    pub(super) fn indented(self) -> Vec<Line<'static>> {
        let mut lines = self.lines();
        for line in &mut lines {
            line.spans.insert(0, Span::raw("  "));
        }
        lines
    }
}

/// What widgets draw on an area of a size, line by line.
pub(super) fn drawn(width: u16, height: u16, draw: impl FnOnce(Rect, &mut Buffer)) -> Vec<Line<'static>> {
    let mut buffer = Buffer::empty(Rect::new(0, 0, width, height));
    draw(buffer.area, &mut buffer);
    let rows = buffer.content.chunks(usize::from(width.max(1))).map(|cells| {
        // Behind a wide character stands a cell that is not seen.
        let mut hidden = 0;
        let seen = cells.iter().filter(|cell| {
            let is_seen = hidden == 0;
            hidden = if is_seen { self::width(cell.symbol()).saturating_sub(1) } else { hidden - 1 };
            is_seen
        });
        let seen: Vec<_> = seen.map(|cell| (cell.symbol(), cell.style())).collect();
        let runs = seen.chunk_by(|(_, before), (_, after)| before == after);
        let spans = runs.map(|run| {
            let text: String = run.iter().map(|(symbol, _)| *symbol).collect();
            Span::styled(text, run.first().map(|(_, style)| *style).unwrap_or_default())
        });
        spans.collect::<Line<'_>>()
    });
    rows.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_of_least_weight_are_left_out_and_nothing_is_ever_too_wide() {
        let layout = [
            Column::words("unit", 0, 0),
            Column::number("big", 2, 0),
            Column::number("small", 9, 0),
            Column::filling("note", 1, 6),
        ];
        let row = ["ZLG-0001", "12", "3", "a note that is rather long"].map(Span::raw).to_vec();
        let shown = |columns| {
            let lines = Grid::set(&layout, std::slice::from_ref(&row), columns).lines();
            assert!(lines.iter().all(|line| line.width() <= columns), "{columns}");
            lines.iter().map(|line| line.to_string().trim_end().to_owned()).collect::<Vec<_>>()
        };
        (1..60).for_each(|columns| drop(shown(columns)));
        assert_eq!(
            shown(50),
            ["unit      big  small  note", "ZLG-0001   12      3  a note that is rather long"]
        );
        assert_eq!(shown(27)[1], "ZLG-0001   12  a note that…");
        assert_eq!(shown(16)[1], "ZLG-0001  a not…");
        assert_eq!(shown(5)[1], "ZLG-…");
    }

    #[test]
    fn what_is_drawn_comes_back_with_its_styles_and_wide_characters() {
        let line = Line::from_iter([Span::styled("水準", tone::GOOD), Span::raw(" a")]);
        let lines = drawn(8, 1, |area, buffer| line.render(area, buffer));
        assert_eq!((lines[0].to_string().as_str(), lines[0].spans[0].style.fg), ("水準 a  ", tone::GOOD.fg));
    }
}
