//! The arguments that say where a fit's document and report go, and what the document says of the fit.

use std::path::{Path, PathBuf};
use std::time::SystemTime;

use clap::Args;
use isotherm_protocol::document::Created;
use isotherm_protocol::history::WallTime;

use super::driver::{Done, Job, Task};
use super::files::Files;
use super::runs::{BaseArgs, LogArgs};
use super::units::Logs;
use crate::document::Fitted;
use crate::error::Error;

/// What the fits have in common: logs, of which each is a run, those that judge, the document at the beginning, and what is written.
#[derive(Debug, Clone, Args)]
pub(super) struct FitArgs {
    #[command(flatten)]
    pub(super) log: LogArgs,
    /// Log to judge the new document by, not used in the fit; repeatable
    #[arg(long, value_name = "LOG")]
    judge: Vec<PathBuf>,
    #[command(flatten)]
    pub(super) base: BaseArgs,
    #[command(flatten)]
    pub(super) output: OutputArgs,
}

impl FitArgs {
    /// Its logs and its document.
    pub(super) fn logs(&self) -> Logs<'_> {
        Logs { judge: &self.judge, document: self.base.document.as_deref(), ..Logs::of(&self.log) }
    }

    /// Fits every unit; `beside` is what else is read.
    pub(super) fn run(
        &self,
        title: &'static str,
        beside: Option<&Path>,
        fit: impl Fn(&Job<'_>) -> Result<Fitted, Error> + Sync,
    ) -> Result<(), Error> {
        let task = Task { beside, ..Task::new(title, self.output.files(), self.logs()) };
        task.run(|job| self.output.done(fit(job)?, job))
    }
}

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

    /// What comes of a fit: its report with what is to be said of the logs, its document with what is to be said of the fit. Where everything
    /// is refused there is no new document, and the report says so.
    pub(super) fn done(&self, fitted: Fitted, job: &Job<'_>) -> Result<Done, Error> {
        let Fitted { written, mut report, about } = fitted;
        report.warnings.extend(job.work.told());
        let Some(out) = &self.out else { return Ok(Done { report, document: None }) };
        if !report.verdicts.iter().any(|verdict| verdict.accepted) {
            let out = job.name(out);
            report.warnings.push(format!("every sensor is refused: nothing is written to {}", out.display()));
            return Ok(Done { report, document: None });
        }
        let logs = job.work.logs();
        let made_from = (job.work.base.as_ref(), &*logs);
        let document = about.complete(written.document, made_from, &report, self.date()?)?;
        Ok(Done { report, document: Some(document) })
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
