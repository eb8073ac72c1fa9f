//! Tables for people.

use std::ops::RangeBounds;

use comfy_table::{CellAlignment, Row, Table, presets};

/// A table without lines; columns in `right`, those of figures, are aligned to the right. Without a head where that has no cells.
pub fn table<R: Into<Row>>(
    head: impl Into<Row>,
    rows: impl IntoIterator<Item = R>,
    right: impl RangeBounds<usize>,
) -> Table {
    let (mut table, head) = (Table::new(), head.into());
    table.load_preset(presets::NOTHING);
    if head.cell_count() > 0 {
        table.set_header(head);
    }
    table.add_rows(rows);
    let figures = table.column_iter_mut().enumerate().filter(|(index, _)| right.contains(index));
    figures.for_each(|(_, column)| column.set_cell_alignment(CellAlignment::Right));
    table
}
