//! Pages with diagrams that one can zoom into: one HTML file each that needs nothing beside it and nothing from a network.
//!
//! A [`Page`] is made of paragraphs, tables and [`Chart`]s. A chart stacks [`Panel`]s over one common horizontal axis; a panel
//! holds curves ([`Series`]) or, in one row each, what is the case from when to when ([`Lane`]). [`Mark`]s stand across all
//! panels. Colours are named by what they stand for ([`Ink`]) and follow the reader's light or dark setting.
//!
//! Curves are [`Samples`]: points with their places, or bins of equal width with smallest, largest and mean value. The page
//! draws, for each column of pixels, the smallest and largest of what falls into it, so that no peak is lost at any zoom.
//!
//! ```
//! use isotherm_pages::{Axis, Chart, Content, Form, Ink, Page, Panel, Samples, Series};
//!
//! let residual = Series {
//!     name: "residual".into(),
//!     ink: Ink::Corrected,
//!     form: Form::Dots,
//!     samples: Samples::points([(-40.0, 0.3), (20.0, -0.1), (60.0, 0.2)]),
//! };
//! let mut page = Page::new("Fit of the static bias");
//! page.paragraph("Residuals of the fit against temperature.");
//! page.chart(&Chart {
//!     caption: "Residuals, gyro x.".into(),
//!     x: Axis::of("temperature", "°C"),
//!     panels: vec![Panel {
//!         title: "bias".into(),
//!         unit: "°/h".into(),
//!         height: 160,
//!         logarithmic: false,
//!         content: Content::Series(vec![residual]),
//!     }],
//!     marks: Vec::new(),
//! });
//! assert!(page.to_html().starts_with("<!doctype html>"));
//! ```
//!
//! What this crate refuses to do: know anything of logs, units or calibrations.

mod chart;
mod encode;
#[cfg(test)]
mod tests;

use std::fmt::Write;

pub use chart::{Axis, Bits, Chart, Content, Form, Ink, Lane, Mark, Panel, Places, Samples, Series, Stretch};

use encode::Store;

/// The page's style sheet; the script takes the colours from it too.
const STYLE: &str = include_str!("style.css");

/// The parts of the script that draw a chart, in this order: class `Chart` of the last draws into a figure what a shape says,
/// numbers from its method `list`. The first two know nothing of the page and are tested by themselves.
pub const CHART_SCRIPT: [&str; 5] = [
    include_str!("script/scale.js"),
    include_str!("script/samples.js"),
    include_str!("script/draw.js"),
    include_str!("script/panel.js"),
    include_str!("script/chart.js"),
];

/// Charts of a page: they take their numbers from it, can have lanes, and one can zoom into them.
const PAGE_SCRIPT: [&str; 2] = [include_str!("script/pages.js"), include_str!("script/zoom.js")];

/// A table whose first column names the rows.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Table {
    /// Heads of all columns.
    pub head: Vec<String>,
    /// Rows, each as long as the head.
    pub rows: Vec<Vec<String>>,
}

/// A page that is being written from top to bottom.
#[derive(Debug, Clone)]
pub struct Page {
    title: String,
    body: String,
    store: Store,
    charts: usize,
}

impl Page {
    /// A page with nothing but its title.
    #[must_use]
    pub fn new(title: &str) -> Self {
        let body = format!("<h1>{}</h1>\n", escape(title));
        Self { title: title.to_owned(), body, store: Store::default(), charts: 0 }
    }

    /// Begins a section.
    pub fn heading(&mut self, text: &str) {
        self.line("h2", "", text);
    }

    /// A sentence that says the result, set larger than text.
    pub fn headline(&mut self, text: &str) {
        self.line("p", " class=\"headline\"", text);
    }

    /// Several results, one to a line as a headline: a short sentence, and in smaller letters what is to be known of it.
    pub fn headlines(&mut self, sentences: &[(String, String)]) {
        self.body.push_str("<ul class=\"headline\">\n");
        for (sentence, more) in sentences {
            self.write(format_args!("<li>{}", escape(sentence)));
            if !more.is_empty() {
                self.write(format_args!(" <span>{}</span>", escape(more)));
            }
            self.body.push_str("</li>\n");
        }
        self.body.push_str("</ul>\n");
    }

    /// A paragraph.
    pub fn paragraph(&mut self, text: &str) {
        self.line("p", "", text);
    }

    /// A table; on a phone each row of a wide one is a card.
    pub fn table(&mut self, table: &Table) {
        let kinds: Vec<&str> = (0..table.head.len()).map(|column| kind(table, column)).collect();
        let (wide, none) = (is_wide(table), Vec::new());
        let heads = if wide { &table.head } else { &none };
        self.body.push_str(if wide { "<div class=\"table wide\">" } else { "<div class=\"table\">" });
        self.body.push_str("<table>\n<thead><tr>");
        self.cells("th", &table.head, &kinds, &[]);
        self.body.push_str("</tr></thead>\n<tbody>\n");
        for row in &table.rows {
            let (name, values) = row.split_at(row.len().min(1));
            self.body.push_str("<tr>");
            self.cells("th", name, &kinds, heads);
            self.cells("td", values, kinds.get(1..).unwrap_or_default(), heads.get(1..).unwrap_or_default());
            self.body.push_str("</tr>\n");
        }
        self.body.push_str("</tbody></table></div>\n");
    }

    /// A chart. Without a script its caption and a sentence in place of the diagram are there.
    pub fn chart(&mut self, chart: &Chart) {
        let shape = self.store.chart(chart);
        let id = self.charts;
        self.charts += 1;
        let caption = escape(&chart.caption);
        self.write(format_args!(
            "<figure class=\"chart\" id=\"chart{id}\" tabindex=\"0\" aria-label=\"{caption}\">\n\
             <noscript><p class=\"noscript\">The diagrams are drawn by a script inside this file, and scripts are switched \
             off. The figures in the tables are complete without it.</p></noscript>\n\
             <script type=\"application/json\">{shape}</script>\n<figcaption>{caption}</figcaption>\n</figure>\n",
        ));
    }

    /// The finished page.
    #[must_use]
    pub fn to_html(&self) -> String {
        let data = self.store.to_html();
        let title = escape(&self.title);
        let script = if self.charts == 0 {
            String::new()
        } else {
            format!(
                "<script>\n\"use strict\";\n(() => {{\n{}{}}})();\n</script>\n",
                CHART_SCRIPT.concat(),
                PAGE_SCRIPT.concat()
            )
        };
        format!(
            "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
             <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
             <meta name=\"color-scheme\" content=\"light dark\">\n\
             <title>{title}</title>\n<style>\n{STYLE}</style>\n</head>\n<body>\n<main>\n{}</main>\n{data}{script}</body>\n</html>\n",
            self.body
        )
    }

    /// Cells, each with its column's kind and, where there is one, the head that it is told by without the row of heads.
    fn cells(&mut self, tag: &str, cells: &[String], kinds: &[&str], heads: &[String]) {
        for (index, cell) in cells.iter().enumerate() {
            let kind = kinds.get(index).copied().unwrap_or_default();
            let head = heads.get(index).filter(|head| !head.is_empty());
            let head = head.map_or_else(String::new, |head| format!(" data-head=\"{}\"", escape(head)));
            self.write(format_args!("<{tag}{kind}{head}>{}</{tag}>", escape(cell)));
        }
    }

    fn line(&mut self, tag: &str, attributes: &str, text: &str) {
        self.write(format_args!("<{tag}{attributes}>{}</{tag}>\n", escape(text)));
    }

    fn write(&mut self, text: std::fmt::Arguments<'_>) {
        // Writing to a string cannot fail.
        let _ = self.body.write_fmt(text);
    }
}

/// Longest word or figure that a column is as wide as (letters); longer ones are set in several lines.
const WIDEST: usize = 40;
/// Longest figure, with its sign and arrow (letters): longer ones are formulas and intervals, which are read like words.
const FIGURE: usize = 24;
/// Letters that stand side by side on a phone.
const PHONE: usize = 44;

/// Whether a table is wider than a phone.
fn is_wide(table: &Table) -> bool {
    let width = |column: usize| {
        let cells = table.rows.iter().chain([&table.head]).filter_map(|row| row.get(column));
        cells.map(|cell| cell.chars().count()).max().unwrap_or(0).min(WIDEST) + 2
    };
    (0..table.head.len()).map(width).sum::<usize>() > PHONE
}

/// The attribute of a column's cells: words stand to the left, figures to the right, and the first column as the style sheet has it.
fn kind(table: &Table, column: usize) -> &'static str {
    let cells = || table.rows.iter().filter_map(|row| row.get(column));
    let long = || cells().any(|cell| cell.chars().count() > WIDEST);
    let figure = |cell: &String| {
        if cell.chars().count() > FIGURE {
            return false;
        }
        let bare = cell.trim_start_matches(['→', ' ', '(', '<', '±']);
        bare.is_empty() || bare == "–" || bare.starts_with(|c: char| c.is_ascii_digit() || "-−+".contains(c))
    };
    if column == 0 {
        if long() { " class=\"long\"" } else { "" }
    } else if cells().all(figure) {
        ""
    } else if long() {
        " class=\"words long\""
    } else {
        " class=\"words\""
    }
}

/// Text as it may stand in HTML and in an attribute.
fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
