//! The arguments that say where a fit's document and report go, and what the document says of the fit.

use std::path::PathBuf;
use std::time::SystemTime;

use clap::Args;
use isotherm_protocol::document::{Created, Document};
use isotherm_protocol::history::WallTime;
use serde_json::json;
use toml::Table;

use super::driver::{Done, Job};
use super::files::Files;
use crate::document::{Written, command_line, origin};
use crate::error::Error;
use crate::report::{FitReport, Sigmas, residuals};

/// What a fit writes.
#[derive(Debug, Clone, Args)]
pub(super) struct OutputArgs {
    /// New document to write; several units: NEW-UNIT.toml of each
    #[arg(long, short, value_name = "NEW")]
    out: Option<PathBuf>,
    /// Replace existing documents and reports
    #[arg(long)]
    overwrite: bool,
    /// Date of the new document (YYYY-MM-DD; default: today, UTC)
    #[arg(long, hide_short_help = true, value_name = "DATE", requires = "out", value_parser = a_date)]
    created: Option<Created>,
    /// HTML report to write, one file; several units: FILE-UNIT.html each, and a table in FILE
    #[arg(long, value_name = "FILE")]
    html: Option<PathBuf>,
    /// Print everything as one JSON object
    #[arg(long)]
    json: bool,
}

/// A fit on its way into files.
pub(super) struct Fitted {
    /// The document without what is to be said of its origin.
    pub(super) written: Written,
    /// What is said of the fit.
    pub(super) report: FitReport,
    /// What the document says of it beside its coefficients.
    pub(super) about: About,
}

/// What the document says of a fit beside its coefficients.
pub(super) struct About {
    /// Method.
    pub(super) method: &'static str,
    /// Name of its table in `origin.details`.
    pub(super) key: &'static str,
    /// That table.
    pub(super) details: Table,
    /// Standard errors, as what compares documents reads them.
    pub(super) sigmas: Sigmas,
    /// Range of temperature (°C).
    pub(super) range_deg_c: Option<[f64; 2]>,
}

impl Fitted {
    /// What comes of it: its report with what is to be said of the logs, its document with what is to be said of the fit. Where everything
    /// is refused there is no new document, and the report says so.
    pub(super) fn done(self, output: &OutputArgs, job: &Job<'_>) -> Result<Done<FitReport>, Error> {
        let Self { written, report, about } = self;
        let any_accepted = report.verdicts.iter().any(|verdict| verdict.accepted);
        output.done(any_accepted, report, job, |report| {
            about.complete(written.document, &job.work.logs(), report, output.date()?)
        })
    }
}

impl About {
    /// A document with its origin.
    fn complete(
        &self,
        mut document: Document,
        logs: &[PathBuf],
        report: &FitReport,
        created: Created,
    ) -> Result<Written, Error> {
        let mut origin = origin(logs, &command_line())?;
        origin.method = Some(self.method.to_owned());
        origin.range_deg_c = self.range_deg_c;
        origin.residual = residuals(&report.verdicts);
        let before = document.origin.take();
        let mut details = before.as_ref().and_then(|before| before.details.clone()).unwrap_or_default();
        if let Some(before) = before.filter(|before| before.tool.is_some() || before.method.is_some()) {
            // What the rest of the document rests on.
            let [tool, method] = [before.tool, before.method].map(Option::unwrap_or_default);
            let earlier = json!({ "tool": tool, "method": method, "log": before.log });
            let earlier = toml::Value::try_from(earlier).map_err(|error| Error::document(&error))?;
            details.insert("before".to_owned(), earlier);
        }
        details.insert(self.key.to_owned(), toml::Value::Table(self.details.clone()));
        self.sigmas.write(&mut details);
        origin.details = Some(details);
        document.origin = Some(origin);
        document.created = Some(created);
        Written::of(&document)
    }
}

impl OutputArgs {
    /// As files.
    pub(super) fn files(&self) -> Files<'_> {
        Files {
            out: self.out.as_deref(),
            html: self.html.as_deref(),
            overwrite: self.overwrite,
            json: self.json,
        }
    }

    /// What comes of a fit: its report with what is to be said of the logs, and its document, where one is wanted and something was
    /// accepted.
    pub(super) fn done(
        &self,
        any_accepted: bool,
        mut report: FitReport,
        job: &Job<'_>,
        document: impl FnOnce(&FitReport) -> Result<Written, Error>,
    ) -> Result<Done<FitReport>, Error> {
        report.warnings.extend(job.work.told());
        let Some(out) = &self.out else { return Ok(Done { report, document: None }) };
        if !any_accepted {
            let out = job.name(out);
            report.warnings.push(format!("every sensor is refused: nothing is written to {}", out.display()));
            return Ok(Done { report, document: None });
        }
        let document = Some(document(&report)?);
        Ok(Done { report, document })
    }

    /// The date that the new document is to state.
    pub(super) fn date(&self) -> Result<Created, Error> {
        date(self.created)
    }
}

/// The date that a document is to state; without one that of today (UTC).
pub(super) fn date(stated: Option<Created>) -> Result<Created, Error> {
    let today = || a_date(WallTime::from(SystemTime::now()).to_string().get(..10).unwrap_or_default());
    stated.map_or_else(|| today().map_err(Error::Usage), Ok)
}

/// Reads a date.
pub(super) fn a_date(text: &str) -> Result<Created, String> {
    text.parse().ok().and_then(Created::new).ok_or_else(|| "must be a date such as 2026-11-22".to_owned())
}
