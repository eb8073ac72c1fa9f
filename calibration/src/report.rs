//! The report of a fit, the same for all of them: verdict, before and after, coefficients, cross-validation, warnings.
//!
//! A fit fills a [`FitReport`]; what is said of it as text, as JSON and as a page is written here once. Its verdicts are
//! also what the document states as its residuals ([`residuals`]), so that no two places can say different things.
//!
//! | module | holds |
//! |---|---|
//! | [`verdict`] | what came of one sensor, and its sentence |
//! | [`curve`] | before and after over time and temperature, taken from a corrected run |
//! | [`batch`] | several units at once, and the table that closes them |
//! | [`sheet`] | a line, tables and charts where nothing was fitted |
//! | `figures` | digits, tables |
//! | [`sigma`] | standard errors as documents keep them |
//! | `words` | the lines of a terminal; one sentence for all gyros, or logs, that it holds of |
//! | `page`, `json` | the report as a page and as JSON |

pub mod batch;
pub mod curve;
mod figures;
mod json;
mod page;
pub mod sheet;
pub mod sigma;
#[cfg(test)]
mod tests;
pub mod verdict;
mod words;

use isotherm_pages::{Chart, Table};
use serde_json::{Value, json};

pub use batch::{BatchRow, BatchTable, UnitReport, in_parallel, of_unit};
pub use curve::{Curve, Judged, Rest, judge, output_unit};
pub use figures::{alike, counted, fixed, per_deg_c, short, six, superscript, table, within};
pub(crate) use page::bars;
pub use sheet::Sheet;
pub use sigma::Sigmas;
pub use verdict::{FLAT, Figure, SAME_SHARE, Verdict, residuals};

pub(crate) use words::{dozen, grouped, gyros, of_logs, together};

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

impl Coefficient {
    /// A coefficient with its standard error.
    pub fn new(name: impl Into<String>, unit: impl Into<String>, value: f64, sigma: Option<f64>) -> Self {
        Self { name: name.into(), unit: unit.into(), value, sigma }
    }
}

/// What a fit has to say; lists that do not apply stay empty.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct FitReport {
    /// What was done, such as "Thermal calibration, method joint".
    pub title: String,
    /// Serial of the unit.
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
}

impl FitReport {
    /// A report with nothing in it but what was done to which unit.
    pub fn new(title: impl Into<String>, unit: impl Into<String>) -> Self {
        Self { title: title.into(), unit: unit.into(), ..Self::default() }
    }

    /// With the name of what its sizes are over.
    pub fn counting(mut self, what: &'static str) -> Self {
        self.counted = Some(what);
        self
    }

    /// All sizes as a table.
    fn size_rows(&self) -> Table {
        verdict::rows(&self.verdicts, self.counted.unwrap_or("windows"))
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

    /// The refusals, for the end of a command.
    pub fn refusals(&self) -> Vec<String> {
        let refused = self.verdicts.iter().filter(|verdict| !verdict.accepted);
        refused.map(|verdict| format!("{}: {}: {}", self.unit, verdict.of, verdict.reason)).collect()
    }

    /// What a terminal shows: the verdicts in the first lines, and what is to be looked at.
    pub fn to_text(&self) -> String {
        let warnings: Vec<String> = self.warnings.iter().map(|words| format!("warning: {words}")).collect();
        let rest = format!(
            "{}, unit {}: what was done, {} and all tables",
            self.title,
            self.unit,
            counted(self.coefficients.len(), "coefficient", "coefficients")
        );
        dozen(&verdict::sentences(&self.verdicts), &warnings, &rest)
    }

    /// Coefficients as a table; the first column numbers them as the chart does.
    fn coefficient_rows(&self) -> Table {
        let row = |(index, coefficient): (usize, &Coefficient)| {
            let Coefficient { name, unit, value, sigma } = coefficient;
            let known = sigma.filter(|sigma| sigma.is_finite());
            let ratio = known.filter(|sigma| *sigma > 0.0).map(|sigma| value.abs() / sigma);
            let or_dash = |value: Option<f64>| value.map_or_else(|| "–".to_owned(), short);
            vec![
                (index + 1).to_string(),
                name.clone(),
                stated(*value, known),
                or_dash(known),
                or_dash(ratio),
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
