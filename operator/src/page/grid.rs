//! Columns that fit: those of least weight are left out rather than lines wrapped.

use ratatui::style::Style;
use ratatui::text::{Line, Span};

use super::figure::{fit, width};
use super::tone;

/// Blanks between two columns.
const BETWEEN: usize = 2;

/// A column.
#[derive(Debug, Clone, Copy)]
pub(super) struct Column {
    /// Its head.
    pub(super) head: &'static str,
    /// Aligned to the right.
    pub(super) right: bool,
    /// Weight: columns are left out in falling order of this number; 0 never.
    pub(super) rank: u8,
    /// It is never narrower than this, so that a live table does not waver.
    pub(super) least: usize,
    /// It takes what the others leave over; a longer text is cut.
    pub(super) fills: bool,
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
}

/// What stands in a column of a line.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Cell {
    text: String,
    style: Style,
}

impl Cell {
    pub(super) fn new(text: impl Into<String>, style: Style) -> Self {
        Self { text: text.into(), style }
    }

    pub(super) fn plain(text: impl Into<String>) -> Self {
        Self::new(text, tone::PLAIN)
    }
}

/// A table: its head, and its lines.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Grid {
    /// The head.
    pub head: Line<'static>,
    /// The lines, each with the cells of one row.
    pub lines: Vec<Line<'static>>,
}

impl Grid {
    /// Sets the table in at most `columns` columns of the terminal.
    pub(super) fn set(layout: &[Column], rows: &[Vec<Cell>], columns: usize) -> Self {
        // Of each column what it asks for, and what it could do with.
        let wanted: Vec<(usize, usize)> = layout
            .iter()
            .enumerate()
            .map(|(index, column)| {
                let cells = rows.iter().filter_map(|row| row.get(index)).map(|cell| width(&cell.text));
                let widest = cells.max().unwrap_or(0).max(width(column.head)).max(column.least);
                (if column.fills { column.least.max(width(column.head)) } else { widest }, widest)
            })
            .collect();
        let mut shown = vec![true; layout.len()];
        let taken = |shown: &[bool]| -> usize {
            let widths = wanted.iter().zip(shown).filter(|(_, shown)| **shown);
            widths.map(|((wanted, _), _)| wanted + BETWEEN).sum::<usize>().saturating_sub(BETWEEN)
        };
        while taken(&shown) > columns {
            let candidates =
                layout.iter().zip(&mut shown).filter(|(column, shown)| column.rank > 0 && **shown);
            let Some((_, least)) = candidates.max_by_key(|(column, _)| column.rank) else { break };
            *least = false;
        }
        let left = columns.saturating_sub(taken(&shown));
        let widths: Vec<Option<usize>> = layout
            .iter()
            .zip(&wanted)
            .zip(&shown)
            .map(|((column, (wanted, widest)), shown)| {
                let width = if column.fills { (*widest).min(wanted + left) } else { *wanted };
                shown.then_some(width)
            })
            .collect();
        let head = layout.iter().map(|column| Cell::new(column.head, tone::HEAD)).collect::<Vec<_>>();
        let line = |cells: &[Cell]| line(layout, &widths, cells, columns);
        Self { head: line(&head), lines: rows.iter().map(|row| line(row)).collect() }
    }

    /// Head and lines, moved in from the left.
    pub(super) fn indented(self) -> Vec<Line<'static>> {
        let indent = |mut line: Line<'static>| {
            line.spans.insert(0, Span::raw("  "));
            line
        };
        std::iter::once(self.head).chain(self.lines).map(indent).collect()
    }
}

/// One line; what does not fit even so is cut at the end of the terminal's line.
fn line(layout: &[Column], widths: &[Option<usize>], cells: &[Cell], columns: usize) -> Line<'static> {
    let mut line = Line::default();
    let mut left = columns;
    for ((column, cell_width), cell) in layout.iter().zip(widths).zip(cells) {
        let Some(cell_width) = cell_width else { continue };
        if !line.spans.is_empty() {
            line.push_span(" ".repeat(BETWEEN.min(left)));
            left = left.saturating_sub(BETWEEN);
        }
        let text = fit(&cell.text, (*cell_width).min(left));
        let blanks = " ".repeat(cell_width.min(&left).saturating_sub(width(&text)));
        left = left.saturating_sub(*cell_width);
        let parts = if column.right {
            [(blanks, tone::PLAIN), (text, cell.style)]
        } else {
            [(text, cell.style), (blanks, tone::PLAIN)]
        };
        for (text, style) in parts {
            if !text.is_empty() {
                line.push_span(Span::styled(text, style));
            }
        }
    }
    line
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
        let row = ["ZLG-0001", "12", "3", "a note that is rather long"].map(Cell::plain).to_vec();
        let shown = |columns| {
            let grid = Grid::set(&layout, std::slice::from_ref(&row), columns);
            assert!(grid.head.width() <= columns && grid.lines[0].width() <= columns, "{columns}");
            [grid.head, grid.lines[0].clone()].map(|line| line.to_string().trim_end().to_owned())
        };
        (0..60).for_each(|columns| drop(shown(columns)));
        let [head, line] = shown(50);
        assert_eq!(head, "unit      big  small  note");
        assert_eq!(line, "ZLG-0001   12      3  a note that is rather long");
        assert_eq!(shown(27)[1], "ZLG-0001   12  a note that…");
        assert_eq!(shown(16)[1], "ZLG-0001  a not…");
        assert_eq!(shown(5)[1], "ZLG-…");
    }
}
