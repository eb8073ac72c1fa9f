//! The HTML page around tables and figures.

use std::fmt::Write;

use super::draw::ReportError;
use super::figure::Figure;

/// The page's style sheet; it also gives the plots' colours their light and dark values.
const STYLE: &str = include_str!("style.css");

/// A table whose first column names the rows.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Table {
    /// Heads of all columns.
    pub head: Vec<String>,
    /// Rows, each as long as the head.
    pub rows: Vec<Vec<String>>,
}

/// A page that is being written from top to bottom.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Page {
    title: String,
    body: String,
}

impl Page {
    /// A page with nothing but its title.
    #[must_use]
    pub fn new(title: &str) -> Self {
        Self { title: title.to_owned(), body: format!("<h1>{}</h1>\n", escape(title)) }
    }

    /// Begins a section.
    pub fn heading(&mut self, text: &str) {
        self.line("h2", "", text);
    }

    /// A sentence that says the result, set larger than text.
    pub fn headline(&mut self, text: &str) {
        self.line("p", " class=\"headline\"", text);
    }

    /// A paragraph.
    pub fn paragraph(&mut self, text: &str) {
        self.line("p", "", text);
    }

    /// A table.
    pub fn table(&mut self, table: &Table) {
        self.body.push_str("<div class=\"table\"><table>\n<thead><tr>");
        self.cells("th", &table.head);
        self.body.push_str("</tr></thead>\n<tbody>\n");
        for row in &table.rows {
            let (name, values) = row.split_at(row.len().min(1));
            self.body.push_str("<tr>");
            self.cells("th", name);
            self.cells("td", values);
            self.body.push_str("</tr>\n");
        }
        self.body.push_str("</tbody></table></div>\n");
    }

    /// A figure.
    ///
    /// # Errors
    /// [`ReportError`] where it cannot be drawn.
    pub fn figure(&mut self, figure: &Figure) -> Result<(), ReportError> {
        self.body.push_str(&figure.to_html()?);
        Ok(())
    }

    /// The finished page.
    #[must_use]
    pub fn to_html(&self) -> String {
        format!(
            "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
             <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
             <meta name=\"color-scheme\" content=\"light dark\">\n\
             <title>{}</title>\n<style>\n{STYLE}</style>\n</head>\n<body>\n<main>\n{}</main>\n</body>\n</html>\n",
            escape(&self.title),
            self.body
        )
    }

    fn cells(&mut self, tag: &str, cells: &[String]) {
        for cell in cells {
            self.write(format_args!("<{tag}>{}</{tag}>", escape(cell)));
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

/// Text as it may stand in HTML and in an attribute.
pub(super) fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::{Curve, Ink, Mark, Panel};

    /// A page with everything on it.
    fn page() -> String {
        let mut page = Page::new("a < b & \"c\"");
        page.heading("Section");
        page.headline("1.68 → 0.19 °/h");
        page.table(&Table {
            head: vec![String::new(), "A".into()],
            rows: vec![vec!["ticks".into(), "7".into()]],
        });
        let curve = |name: &str, ink, mark| Curve {
            name: name.into(),
            ink,
            mark,
            points: vec![[0.0, 0.0], [1.0, f64::NAN], [2.0, 5.0], [3.0, -5.0]],
        };
        let panel = Panel {
            title: "<all>".into(),
            y_label: "rate error, °/h".into(),
            y_range: Some([-1.0, 1.0]),
            aspect: 0.3,
            bands: vec![[1.0, 2.0]],
            curves: vec![curve("raw", Ink::Raw, Mark::Line), curve("corrected", Ink::Corrected, Mark::Rings)],
        };
        let figure = Figure {
            caption: "what < where".into(),
            x_label: "time, s".into(),
            panels: vec![panel.clone(), panel],
        };
        page.figure(&figure).unwrap();
        page.to_html()
    }

    #[test]
    fn a_page_needs_nothing_beside_it() {
        let html = page();
        let links = html.replace("http://www.w3.org/2000/svg", "");
        for outside in ["http:", "https:", "<script", "<link", "@import", "url(", "src="] {
            assert!(!links.contains(outside), "{outside}");
        }
    }

    #[test]
    fn text_is_escaped_and_every_name_is_in_the_legend_once() {
        let html = page();
        assert!(
            html.contains("a &lt; b &amp; &quot;c&quot;") && html.contains("aria-label=\"what &lt; where\"")
        );
        assert!(html.contains("&lt;all&gt;"));
        assert_eq!(html.matches("<i class=\"line raw\"></i>raw</li>").count(), 1);
        assert_eq!(html.matches("<i class=\"ring corrected\"></i>corrected</li>").count(), 1);
        assert_eq!(html.matches("</svg>").count(), 2, "one for wide windows, one for narrow");
    }
}
