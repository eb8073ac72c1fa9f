//! What is to be said where nothing was fitted: a line, tables, charts.

use std::fmt::Write;

use comfy_table::{CellAlignment, presets};
use isotherm_pages::{Chart, Page, Table};

/// A line, sentences, tables and charts.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Sheet {
    /// Title of the page.
    pub title: String,
    /// The first line.
    pub headline: String,
    /// Sentences.
    pub notes: Vec<String>,
    /// Charts, each with its heading; only the page has them.
    pub charts: Vec<(String, Chart)>,
    /// Tables, each with its heading.
    pub tables: Vec<(String, Table)>,
}

impl Sheet {
    /// Adds a table, if there is anything in it.
    pub fn table(
        &mut self,
        heading: &str,
        head: impl IntoIterator<Item = impl Into<String>>,
        rows: impl IntoIterator<Item = Vec<String>>,
    ) {
        let table = Table::of(head, rows);
        if !table.rows.is_empty() {
            self.tables.push((heading.to_owned(), table));
        }
    }

    /// Adds a chart, if there is anything in it.
    pub fn chart(&mut self, heading: &str, chart: Chart) {
        if !chart.panels.is_empty() {
            self.charts.push((heading.to_owned(), chart));
        }
    }

    /// As text.
    pub fn to_text(&self) -> String {
        let mut text = format!("{}\n", self.headline);
        if !self.notes.is_empty() {
            text.push('\n');
        }
        for note in &self.notes {
            let _ = writeln!(text, "{note}");
        }
        for (heading, rows) in &self.tables {
            let _ = writeln!(text, "\n{heading}\n{}", aligned(rows));
        }
        text
    }

    /// As a page.
    pub fn to_html(&self) -> String {
        let mut page = Page::new(&self.title);
        page.headline(&self.headline);
        self.notes.iter().for_each(|note| page.paragraph(note));
        for (heading, chart) in &self.charts {
            page.heading(heading);
            page.chart(chart);
        }
        for (heading, rows) in &self.tables {
            page.heading(heading);
            page.table(rows);
        }
        page.to_html()
    }
}

/// A table as text: figures to the right, words and formulas to the left.
fn aligned(table: &Table) -> String {
    let mut text = comfy_table::Table::new();
    text.load_preset(presets::NOTHING).set_header(&table.head).add_rows(&table.rows);
    for (index, column) in text.column_iter_mut().enumerate().skip(1) {
        let figure = |row: &Vec<String>| {
            row.get(index).is_none_or(|cell| {
                let begins = cell.chars().next().is_none_or(|c| c.is_ascii_digit() || "-−+(–".contains(c));
                begins && !cell.contains('·')
            })
        };
        if table.rows.iter().all(figure) {
            column.set_cell_alignment(CellAlignment::Right);
        }
    }
    text.to_string()
}
