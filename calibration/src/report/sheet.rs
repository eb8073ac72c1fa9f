//! What is to be said where nothing was fitted: a line, tables, charts.

use std::fmt::Write;

use isotherm_log::plot::page::{Chart, Page, Table};

use crate::drift::figures::table;

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
    pub fn table(&mut self, heading: &str, head: &[&str], rows: Vec<Vec<String>>) {
        if !rows.is_empty() {
            let head = head.iter().map(|word| (*word).to_owned()).collect();
            self.tables.push((heading.to_owned(), Table { head, rows }));
        }
    }

    /// As text.
    #[must_use]
    pub fn to_text(&self) -> String {
        let mut text = format!("{}\n", self.headline);
        if !self.notes.is_empty() {
            text.push('\n');
        }
        for note in &self.notes {
            let _ = writeln!(text, "{note}");
        }
        for (heading, rows) in &self.tables {
            let _ = writeln!(text, "\n{heading}\n{}", table(&rows.head, &rows.rows));
        }
        text
    }

    /// As a page.
    #[must_use]
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
