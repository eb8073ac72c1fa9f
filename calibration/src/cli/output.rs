//! The arguments that say where a fit's document and report go.

use std::path::{Path, PathBuf};

use clap::Args;
use isotherm_log::file::refuse_overwriting;
use isotherm_protocol::document::{Created, Document};
use serde_json::json;
use toml::Table;

use super::batch::{Outcome, close_batch};
use super::print;
use crate::error::Error;
use crate::provenance::{command_line, origin};
use crate::report::{FitReport, Sigmas, of_unit, residuals};
use crate::written::{Written, write_file};

/// What a fit writes.
#[derive(Debug, Clone, Args)]
pub(crate) struct OutputArgs {
    /// Write the new document; of several units each to NEW-UNIT.toml
    #[arg(long, short, value_name = "NEW")]
    out: Option<PathBuf>,
    /// Replace documents and reports that are there already
    #[arg(long)]
    overwrite: bool,
    /// Date that the new document states (YYYY-MM-DD); that of the old one without it
    #[arg(long, value_name = "DATE", requires = "out")]
    created: Option<String>,
    /// Write the report with its diagrams as one HTML file; of several units each to FILE-UNIT.html, and the table to FILE
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
        for out in self.out.iter().chain(&self.html) {
            refuse_overwriting(out, inputs)?;
            keep(out, self.overwrite)?;
        }
        self.date().map(|_| ())
    }

    /// Checks the files of one unit of a batch, before any unit is fitted.
    pub(super) fn check_unit(&self, unit: &str) -> Result<(), Error> {
        let mut outputs = self.out.iter().chain(&self.html);
        outputs.try_for_each(|out| keep(&of_unit(out, unit), self.overwrite))
    }

    /// Writes document and page of a fit, each under the name that `name` makes of what was given.
    pub(super) fn save(&self, fitted: &Fitted, name: impl Fn(&Path) -> PathBuf) -> Result<(), Error> {
        let Fitted { written, report, about } = fitted;
        if let Some(out) = &self.out {
            self.document(written.document.clone(), about, report)?.save(&name(out), self.overwrite)?;
        }
        if let Some(html) = &self.html {
            write_file(&name(html), report.to_html().as_bytes(), self.overwrite)?;
        }
        Ok(())
    }

    /// Writes and prints the only fit of a command, and ends with the reasons of what was refused.
    pub(super) fn finish(&self, fitted: &Fitted) -> Result<(), Error> {
        self.save(fitted, Path::to_path_buf)?;
        let report = &fitted.report;
        print(if self.json { format!("{}\n", report.to_json()) } else { report.to_text() }.as_bytes())?;
        let refusals = report.refusals();
        if refusals.is_empty() { Ok(()) } else { Err(Error::Refused(refusals)) }
    }

    /// Prints the fits of several units, the table that closes them last, and ends with the reasons of what was refused.
    pub(super) fn finish_batch(&self, title: &str, units: &[Outcome]) -> Result<(), Error> {
        close_batch(title, units, (self.html.as_deref(), self.overwrite), self.json)
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
            let log: Vec<_> =
                before.log.iter().map(|log| json!({ "name": log.name, "sha256": log.sha256 })).collect();
            let earlier = json!({ "tool": before.tool.unwrap_or_default(), "method": before.method.unwrap_or_default(), "log": log });
            let earlier =
                toml::Value::try_from(earlier).map_err(|error| Error::Document(vec![error.to_string()]))?;
            details.insert("before".to_owned(), earlier);
        }
        details.insert(about.key.to_owned(), toml::Value::Table(about.details.clone()));
        about.sigmas.write(&mut details);
        origin.details = Some(details);
        document.origin = Some(origin);
        if let Some(date) = self.date()? {
            document.created = Some(date);
        }
        Written::of(&document)
    }

    /// The date that the new document is to state.
    pub(super) fn date(&self) -> Result<Option<Created>, Error> {
        self.created.as_deref().map(date).transpose()
    }
}

/// Checks before anything is read: no output may fall on an input, and a document that is there stays without `overwrite`.
pub(super) fn check_outputs(
    out: Option<&Path>,
    html: Option<&Path>,
    inputs: &[&Path],
    overwrite: bool,
) -> Result<(), Error> {
    for output in out.into_iter().chain(html) {
        refuse_overwriting(output, inputs)?;
    }
    out.map_or(Ok(()), |out| keep(out, overwrite))
}

/// Leaves a file alone that is there, unless it may be written over.
fn keep(out: &Path, overwrite: bool) -> Result<(), Error> {
    if out.exists() && !overwrite {
        return Err(Error::Usage(format!(
            "{} is there already: give another name, or --overwrite",
            out.display()
        )));
    }
    Ok(())
}

/// The date that a document is to state.
pub(super) fn date(text: &str) -> Result<Created, Error> {
    let date = text.parse().ok().and_then(Created::new);
    date.ok_or_else(|| Error::Usage(format!("--created is {text:?}, must be a date such as 2026-11-22")))
}
