//! The arguments that say where a fit's document and report go.

use std::path::{Path, PathBuf};
use std::time::SystemTime;

use clap::Args;
use isotherm_protocol::document::{Created, Document};
use isotherm_protocol::history::WallTime;
use serde_json::json;
use toml::Table;

use super::batch::{Names, Work};
use super::page::{keep, writable};
use crate::error::Error;
use crate::provenance::{command_line, origin};
use crate::report::{FitReport, Sigmas, of_unit, residuals};
use crate::written::{Written, write_file};

/// What a fit writes.
#[derive(Debug, Clone, Args)]
pub(crate) struct OutputArgs {
    /// New document to write; several units: NEW-UNIT.toml each
    #[arg(long, short, value_name = "NEW")]
    out: Option<PathBuf>,
    /// Replace existing documents and reports
    #[arg(long)]
    overwrite: bool,
    /// Date of the new document (YYYY-MM-DD; default: today, UTC)
    #[arg(long, value_name = "DATE", requires = "out")]
    created: Option<String>,
    /// HTML report to write, one file; several units: FILE-UNIT.html each, and a table in FILE
    #[arg(long, value_name = "FILE")]
    html: Option<PathBuf>,
    /// Print everything as one JSON object
    #[arg(long)]
    pub(super) json: bool,
}

/// A fit on its way into files.
pub(crate) struct Fitted {
    /// The document without what is to be said of its origin.
    pub(crate) written: Written,
    /// What is said of the fit.
    pub(crate) report: FitReport,
    /// What the document says of it beside its coefficients.
    pub(crate) about: About,
}

/// What the document says of a fit beside its coefficients.
pub(crate) struct About {
    /// Method.
    pub(crate) method: &'static str,
    /// Name of its table in `origin.details`.
    pub(crate) key: &'static str,
    /// That table.
    pub(crate) details: Table,
    /// Standard errors, as what compares documents reads them.
    pub(crate) sigmas: Sigmas,
    /// Range of temperature (°C).
    pub(crate) range_deg_c: Option<[f64; 2]>,
    /// Logs that it was fitted to.
    pub(crate) logs: Vec<PathBuf>,
}

impl OutputArgs {
    /// Checks before anything is read; `inputs` may not be overwritten.
    pub(crate) fn check(&self, inputs: &[&Path]) -> Result<(), Error> {
        if let Some(out) = &self.out {
            let page = self.html.as_deref();
            writable(out, &inputs.iter().copied().chain(page).collect::<Vec<_>>(), self.overwrite)?;
        }
        if let Some(html) = &self.html {
            writable(html, inputs, self.overwrite)?;
        }
        self.date().map(|_| ())
    }

    /// Checks the files of one unit of a batch, before any unit is fitted.
    pub(super) fn check_unit(&self, unit: &str) -> Result<(), Error> {
        let mut outputs = self.out.iter().chain(&self.html);
        outputs.try_for_each(|out| keep(&of_unit(out, unit), self.overwrite))
    }

    /// Writes document and page of a unit, each under the name that it has for it; no document where there is nothing new to say.
    pub(super) fn write(
        &self,
        document: impl FnOnce() -> Result<Option<Written>, Error>,
        page: impl FnOnce() -> String,
        names: &Names<'_>,
    ) -> Result<(), Error> {
        if let Some(out) = &self.out
            && let Some(document) = document()?
        {
            document.save(&names.of(out), self.overwrite)?;
        }
        if let Some(html) = &self.html {
            write_file(&names.of(html), page().as_bytes(), self.overwrite)?;
        }
        Ok(())
    }

    /// Writes what a fit came to; its report is left.
    pub(super) fn keep(&self, fitted: Fitted, work: &Work, names: &Names<'_>) -> Result<FitReport, Error> {
        let Fitted { written, report, about } = fitted;
        let any_accepted = report.verdicts.iter().any(|verdict| verdict.accepted);
        let document = |report: &FitReport| self.document(written.document, &about, report);
        self.put(any_accepted, document, report, work, names)
    }

    /// Completes a report with what is to be said of the logs, and writes document and page; where everything is refused there is no
    /// new document, and the report says so.
    pub(super) fn put(
        &self,
        any_accepted: bool,
        document: impl FnOnce(&FitReport) -> Result<Written, Error>,
        mut report: FitReport,
        work: &Work,
        names: &Names<'_>,
    ) -> Result<FitReport, Error> {
        report.warnings.extend(work.told());
        if let Some(out) = self.out.as_ref().filter(|_| !any_accepted) {
            let out = names.of(out);
            report.warnings.push(format!("every sensor is refused: {} is not written", out.display()));
        }
        self.write(|| any_accepted.then(|| document(&report)).transpose(), || report.to_html(), names)?;
        Ok(report)
    }

    /// The page of a batch's table, and whether it may replace another.
    pub(super) fn page(&self) -> (Option<&Path>, bool) {
        (self.html.as_deref(), self.overwrite)
    }

    /// Whether a document is to be written.
    pub(super) fn writes(&self) -> bool {
        self.out.is_some()
    }

    fn document(&self, mut document: Document, about: &About, report: &FitReport) -> Result<Written, Error> {
        let mut origin = origin(&about.logs, &command_line())?;
        origin.method = Some(about.method.to_owned());
        origin.range_deg_c = about.range_deg_c;
        origin.residual = residuals(&report.verdicts);
        let before = document.origin.take();
        let mut details = before.as_ref().and_then(|before| before.details.clone()).unwrap_or_default();
        if let Some(before) = before.filter(|before| before.tool.is_some() || before.method.is_some()) {
            // What the rest of the document rests on.
            let [tool, method] = [before.tool, before.method].map(Option::unwrap_or_default);
            let earlier = json!({ "tool": tool, "method": method, "log": before.log });
            let earlier =
                toml::Value::try_from(earlier).map_err(|error| Error::Document(vec![error.to_string()]))?;
            details.insert("before".to_owned(), earlier);
        }
        details.insert(about.key.to_owned(), toml::Value::Table(about.details.clone()));
        about.sigmas.write(&mut details);
        origin.details = Some(details);
        document.origin = Some(origin);
        self.put_date(&mut document)?;
        Written::of(&document)
    }

    /// Gives a new document its date.
    pub(super) fn put_date(&self, document: &mut Document) -> Result<(), Error> {
        document.created = Some(self.date()?);
        Ok(())
    }

    /// The date that the new document is to state.
    pub(super) fn date(&self) -> Result<Created, Error> {
        date(self.created.as_deref())
    }
}

/// The date that a document is to state; without one that of today (UTC).
pub(super) fn date(stated: Option<&str>) -> Result<Created, Error> {
    let today = WallTime::from(SystemTime::now()).to_string();
    let text = stated.or_else(|| today.get(..10)).unwrap_or_default();
    let date = text.parse().ok().and_then(Created::new);
    date.ok_or_else(|| Error::Usage(format!("--created is {text:?}, must be a date such as 2026-11-22")))
}
