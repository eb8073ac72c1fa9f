//! One driver for all commands that work on logs: outputs are checked before anything is read, each unit is worked on, what came of it is
//! written and printed, several units are closed with one table, and the exit code says how it ended. A command supplies the rest.

use std::path::{Path, PathBuf};

use isotherm_cli::{Bar, to_stdout};
use serde_json::{Value, json};

use super::files::Files;
use super::units::{Logs, Unit, Work};
use crate::document::Written;
use crate::error::Error;
use crate::report::{Batch, Report, in_parallel, of_unit};

/// What a command that works on logs has to say of itself before it is carried out.
pub(super) struct Task<'a> {
    /// Heading of the page that has the table of several units.
    pub(super) title: &'static str,
    /// Where its outputs go.
    pub(super) files: Files<'a>,
    /// Its logs and documents.
    pub(super) logs: Logs<'a>,
    /// What else it reads, which no output may replace.
    pub(super) beside: Option<&'a Path>,
    /// Whether a refused sensor is no failure where another one was accepted.
    pub(super) accept_partial: bool,
}

/// What came of a unit: what is said of it, and its new document where there is something new to say and it was asked for.
pub(super) struct Done {
    pub(super) report: Report,
    pub(super) document: Option<Written>,
}

/// One unit that is worked on.
pub(super) struct Job<'a> {
    /// Its runs and its document.
    pub(super) work: &'a Work,
    /// Its serial, where it is one of several: its files are called by it, and its progress is not shown.
    among: Option<&'a str>,
}

impl Job<'_> {
    /// A bar over what is done without an end in sight.
    pub(super) fn at_work(&self, message: &'static str) -> Bar {
        if self.among.is_none() { Bar::at_work(message) } else { Bar::hidden() }
    }

    /// What one of its files is called: as it was given, or with the serial.
    pub(super) fn name(&self, given: &Path) -> PathBuf {
        self.among.map_or_else(|| given.to_path_buf(), |unit| of_unit(given, unit))
    }
}

impl<'a> Task<'a> {
    /// One that reads nothing beside its logs and documents, and for which a refused sensor is a failure.
    pub(super) fn new(title: &'static str, files: Files<'a>, logs: Logs<'a>) -> Self {
        Self { title, files, logs, beside: None, accept_partial: false }
    }

    /// Carries it out on the units that its logs have.
    pub(super) fn run(&self, of_unit: impl Fn(&Job<'_>) -> Result<Done, Error> + Sync) -> Result<(), Error> {
        self.run_on(|| self.logs.units(), of_unit)
    }

    /// Carries it out: as many units at a time as there are processors, and one that comes to nothing does not stop the others.
    pub(super) fn run_on(
        &self,
        units: impl FnOnce() -> Result<Vec<Unit>, Error>,
        of_unit: impl Fn(&Job<'_>) -> Result<Done, Error> + Sync,
    ) -> Result<(), Error> {
        let files = self.files;
        let mut inputs: Vec<&Path> = self.logs.inputs().into_iter().chain(self.beside).collect();
        files.check(&inputs)?;
        let mut units = units()?;
        let written = |job: &Job<'_>| {
            let done = of_unit(job).map_err(|error| error.beside(&job.work.cuts()))?;
            if let (Some(out), Some(document)) = (files.out, &done.document) {
                document.save(&job.name(out), files.overwrite)?;
            }
            files.page(|html| job.name(html), || done.report.to_html())?;
            Ok::<_, Error>(done)
        };
        if units.len() == 1
            && let Some((_, work)) = units.pop()
        {
            let mut work = work?;
            work.show();
            let Done { report, document } = written(&Job { work: &work, among: None })?;
            emit(files.json, || report.to_json(), || report.to_text())?;
            files.say_written(document.is_some());
            let refused = refusals(&report, self.accept_partial);
            return Error::end(refused.into_iter().collect(), work.cuts());
        }
        let documents = self.logs.documents(&units);
        inputs.extend(documents.iter().map(PathBuf::as_path));
        units.iter().try_for_each(|(unit, _)| files.check_unit(unit.as_str(), &inputs))?;
        let bar = Bar::counting("units done", units.len());
        let came = in_parallel(&units, |(unit, work)| {
            let came = match work {
                Ok(work) => written(&Job { work, among: Some(unit.as_str()) }).map(|done| done.report),
                Err(error) => Err(Error::refused(error.to_string())),
            };
            bar.done_one();
            came
        });
        bar.finish();
        let mut cuts: Vec<String> =
            units.iter().filter_map(|(_, work)| work.as_ref().ok()).flat_map(Work::cuts).collect();
        cuts.sort();
        cuts.dedup();
        let names = units.into_iter().map(|(unit, _)| unit.to_string());
        Error::end(self.close(&names.zip(came).collect::<Vec<_>>())?, cuts)
    }

    /// Prints what came of several units, the table that closes them last. What was refused comes back, and after that the units that
    /// came to nothing.
    fn close(&self, units: &[(String, Result<Report, Error>)]) -> Result<Vec<String>, Error> {
        let batch = Batch(units);
        let (mut refused, mut failed, mut reports) = (Vec::new(), Vec::new(), Vec::new());
        for (unit, came) in units {
            match came {
                Ok(report) => {
                    if self.files.json {
                        reports.push(report.to_json());
                    } else {
                        print(format!("{}\n", report.to_text()).as_bytes())?;
                    }
                    refused.extend(refusals(report, self.accept_partial));
                }
                Err(error) => failed.push(format!("{unit}: {error}")),
            }
        }
        self.files.page(Path::to_path_buf, || batch.to_html(self.title))?;
        let json = || json!({ "batch": batch.to_json(), "reports": reports });
        emit(self.files.json, json, || batch.to_text())?;
        Ok([refused, failed].concat())
    }
}

/// What was refused of a unit. A part of the sensors is no failure where that is accepted; all of them are.
fn refusals(report: &Report, accept_partial: bool) -> Option<String> {
    let partial = accept_partial && report.verdicts.iter().any(|verdict| verdict.accepted);
    report.refusals().filter(|_| !partial)
}

/// Prints what a command came to, as text or as one JSON object.
pub(super) fn emit(
    as_json: bool,
    json: impl FnOnce() -> Value,
    text: impl FnOnce() -> String,
) -> Result<(), Error> {
    print(if as_json { format!("{}\n", json()) } else { text() }.as_bytes())
}

/// What is said of documents: page, and text or JSON.
pub(super) fn close(
    files: &Files<'_>,
    report: &Report,
    text: impl FnOnce(&Report) -> String,
) -> Result<(), Error> {
    files.page(Path::to_path_buf, || report.to_html())?;
    emit(files.json, || report.to_json(), || text(report))
}

/// Writes to standard output; a reader that has gone away is no error.
fn print(text: &[u8]) -> Result<(), Error> {
    to_stdout(text).map_err(|source| Error::Stdout { source })
}
