//! The report of a command, the same for all of them: verdicts, before and after, coefficients, cross-validation, tables, charts.
//!
//! A command fills a [`Report`]; what is said of it as text, as JSON and as a page is written here once. The verdicts of a fit are
//! also what the document states as its residuals ([`residuals`]), so that no two places can say different things.
//!
//! | module | holds |
//! |---|---|
//! | [`verdict`] | what came of one sensor, and its sentence |
//! | [`curve`] | before and after over time and temperature, taken from a corrected run |
//! | [`batch`] | several units at once, and the table that closes them |
//! | `figures` | digits, tables |
//! | [`sigma`] | standard errors as documents keep them |
//! | `words` | the lines of a terminal; one sentence for all gyros, or logs, that it holds of |
//! | `page`, `json` | the report as a page and as JSON |

pub mod batch;
pub mod curve;
mod figures;
mod json;
mod page;
pub mod sigma;
#[cfg(test)]
mod tests;
pub mod verdict;
mod words;

use std::fmt::Write;

use isotherm_pages::{Chart, Table};
use serde_json::{Value, json};

pub use batch::{Batch, in_parallel, of_unit};
pub use curve::{Curve, Judged, Rest, judge, output_unit};
pub use figures::{alike, counted, fixed, or_dash, per_deg_c, short, six, superscript, table, within};
pub(crate) use page::bars;
pub use sigma::Sigmas;
pub use verdict::{FLAT, SAME_SHARE, Verdict, beside, few, is_worse, residuals};

pub(crate) use words::{gyros, of_logs, together};

use words::dozen;

/// Most lines of a terminal for what was found; the others are for what is to be looked at.
const MOST_FOUND: usize = 9;

/// One fitted coefficient.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Coefficient {
    /// What it is, such as "gyro x thermal rate, run-up".
    pub name: String,
    /// Symbol of its unit of measure.
    pub unit: String,
    /// Its value.
    pub value: f64,
    /// Its standard error, where the fit knows one.
    pub sigma: Option<f64>,
}

/// What a command has to say; lists that do not apply stay empty.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Report {
    /// What was done, such as "Thermal calibration, method joint".
    pub title: String,
    /// Serial of the unit; empty where it is of documents or of no unit.
    pub unit: String,
    /// What came of each sensor: the first lines.
    pub verdicts: Vec<Verdict>,
    /// What is to be looked at, and what to do about it.
    pub warnings: Vec<String>,
    /// What was done, in sentences: logs, ranges, method, time constants.
    pub notes: Vec<String>,
    /// The coefficients.
    pub coefficients: Vec<Coefficient>,
    /// What the sizes of the verdicts are over, such as "poses"; windows where nothing is said.
    pub counted: Option<&'static str>,
    /// The cross-validation.
    pub validation: Option<Table>,
    /// Before and after, by sensor and run.
    pub residuals: Vec<Curve>,
    /// Further tables, each with its heading.
    pub tables: Vec<(String, Table)>,
    /// Further charts, each with its heading.
    pub charts: Vec<(String, Chart)>,
    /// A row for each sensor, or case, where sizes before and after do not say what came of it.
    pub summary: Option<Table>,
    /// What its JSON has besides: an object, or nothing.
    pub figures: Value,
}

impl Report {
    /// A report with nothing in it but what was done to which unit.
    pub fn new(title: impl Into<String>, unit: impl Into<String>) -> Self {
        Self { title: title.into(), unit: unit.into(), ..Self::default() }
    }

    /// A report of something that has one sentence to say.
    pub fn saying(title: impl Into<String>, of: impl Into<String>, words: impl Into<String>) -> Self {
        let verdicts = vec![Verdict::said(of, words)];
        Self { title: title.into(), verdicts, ..Self::default() }
    }

    /// Adds a coefficient with its standard error, where that is known.
    pub fn coefficient(
        &mut self,
        name: impl Into<String>,
        unit: impl Into<String>,
        value: f64,
        sigma: impl Into<Option<f64>>,
    ) {
        let (name, unit, sigma) = (name.into(), unit.into(), sigma.into());
        self.coefficients.push(Coefficient { name, unit, value, sigma });
    }

    /// Adds a table unless it has no rows.
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

    /// Adds a chart unless it has no panels.
    pub fn chart(&mut self, heading: &str, chart: Chart) {
        if !chart.panels.is_empty() {
            self.charts.push((heading.to_owned(), chart));
        }
    }

    /// Adds sentences, of which those that begin with "warning: " are to be looked at.
    pub fn tell(&mut self, words: impl IntoIterator<Item = String>) {
        for words in words {
            match words.strip_prefix("warning: ") {
                Some(warning) => self.warnings.push(warning.to_owned()),
                None => self.notes.push(words),
            }
        }
    }

    /// What came of each sensor as a table: of sizes in and out of sample, or of those that decide.
    fn rows(&self, only_deciding: bool) -> Table {
        let sizes = || verdict::rows(&self.verdicts, self.counted.unwrap_or("windows"), only_deciding);
        self.summary.clone().unwrap_or_else(sizes)
    }

    /// Every verdict, one sentence each, in one line.
    pub fn headline(&self) -> String {
        verdict::sentences(&self.verdicts).join(" ")
    }

    /// The coefficients by name as documents keep them, with their standard errors, 0 where none is known; what is no number is left out.
    pub fn coefficients_by_name(&self) -> serde_json::Map<String, Value> {
        let numbers = self.coefficients.iter().filter(|c| c.value.is_finite());
        let known =
            numbers.filter_map(|c| Some((c, Some(c.sigma.unwrap_or(0.0)).filter(|s| s.is_finite())?)));
        known
            .map(|(c, sigma)| (c.name.clone(), json!({ "value": c.value, "sigma": sigma, "unit": c.unit })))
            .collect()
    }

    /// Whether every sensor was accepted.
    pub fn accepted(&self) -> bool {
        self.verdicts.iter().all(|verdict| verdict.accepted)
    }

    /// What is refused, for the end of a command, which has printed why.
    pub fn refusals(&self) -> Option<String> {
        let refused = self.verdicts.iter().filter(|verdict| !verdict.accepted);
        let refused: Vec<&str> = refused.map(|verdict| verdict.of.as_str()).collect();
        (!refused.is_empty())
            .then(|| format!("{}: {}: refused, for the reasons above", self.unit, refused.join(", ")))
    }

    /// What an engineer decides by, as the lines of a terminal.
    pub fn to_text(&self) -> String {
        let mut found = verdict::sentences(&self.verdicts);
        let summary = self.summary.as_ref().map(table).unwrap_or_default();
        if found.len() + summary.lines().count() <= MOST_FOUND {
            found.extend(summary.lines().map(str::to_owned));
        }
        let warnings: Vec<String> = self.warnings.iter().map(|words| format!("warning: {words}")).collect();
        let coefficients = match self.coefficients.len() {
            0 => String::new(),
            count => format!("{} and ", counted(count, "coefficient", "coefficients")),
        };
        let rest = format!("{}: what was done, {coefficients}all tables", self.heading());
        dozen(&found, &warnings, &rest)
    }

    /// Everything but charts and tables, as text.
    pub fn summary_text(&self) -> String {
        let mut text = format!("{}\n", self.headline());
        let warnings = self.warnings.iter().map(|words| format!("warning: {words}"));
        let lines: Vec<String> = warnings.chain(self.notes.iter().cloned()).collect();
        if !lines.is_empty() {
            let _ = writeln!(text, "\n{}", lines.join("\n"));
        }
        if let Some(summary) = &self.summary {
            let _ = writeln!(text, "\n{}", table(summary));
        }
        text
    }

    /// Everything that is not a chart, as text.
    pub fn whole_text(&self) -> String {
        let mut text = self.summary_text();
        for (heading, rows) in &self.tables {
            let _ = writeln!(text, "\n{heading}\n{}", table(rows));
        }
        text
    }

    /// What was done to which unit.
    fn heading(&self) -> String {
        let unit = if self.unit.is_empty() { String::new() } else { format!(", unit {}", self.unit) };
        format!("{}{unit}", self.title)
    }

    /// Coefficients as a table; the first column numbers them as the chart does.
    fn coefficient_rows(&self) -> Table {
        let row = |(index, coefficient): (usize, &Coefficient)| {
            let Coefficient { name, unit, value, sigma } = coefficient;
            let known = sigma.filter(|sigma| sigma.is_finite());
            let ratio = known.filter(|sigma| *sigma > 0.0).map(|sigma| value.abs() / sigma);
            vec![
                (index + 1).to_string(),
                name.clone(),
                stated(*value, known),
                or_dash(known.map(short)),
                or_dash(ratio.map(short)),
                unit.clone(),
            ]
        };
        let head = ["", "coefficient", "value", "± σ", "value/σ", "unit"];
        Table::of(head, self.coefficients.iter().enumerate().map(row))
    }
}

/// A value to the digits that its standard error leaves meaning to, and one more.
fn stated(value: f64, sigma: Option<f64>) -> String {
    let Some(sigma) = sigma.filter(|sigma| *sigma > 0.0 && value != 0.0) else { return short(value) };
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "between 2 and 12")]
    let digits = (libm::floor(libm::log10(value.abs() / sigma)) + 2.0).clamp(2.0, 12.0) as usize;
    if (1e-3..1e6).contains(&value.abs()) {
        #[expect(clippy::cast_possible_truncation, reason = "between -3 and 5")]
        let whole = libm::floor(libm::log10(value.abs())) as i32 + 1;
        let places = usize::try_from(i32::try_from(digits).unwrap_or(12) - whole).unwrap_or(0);
        format!("{value:.places$}")
    } else {
        format!("{value:.*e}", digits - 1)
    }
}
