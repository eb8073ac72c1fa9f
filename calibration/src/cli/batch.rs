//! One unit or several: what each has to work on, and how a command does the same to all of them.

use std::path::{Path, PathBuf};

use isotherm_protocol::key::UnitId;
use serde_json::json;

use super::bar::Bar;
use super::output::{Fitted, OutputArgs};
use super::print;
use super::runs::Reading;
use crate::error::Error;
use crate::report::{BatchTable, FitReport, in_parallel, of_unit};
use crate::run::Run;
use crate::written::{Written, write_file};

/// What a fit of one unit has to work on.
pub(super) struct Work {
    /// Document that it starts from.
    pub(super) base: Option<Written>,
    /// Runs that it sees.
    pub(super) runs: Vec<Run>,
    /// Runs that it is judged on.
    pub(super) judges: Vec<Run>,
}

/// Logs and documents as a command line names them.
pub(super) struct Named<'a> {
    /// How logs are read.
    pub(super) reading: &'a Reading,
    /// Logs.
    pub(super) logs: &'a [PathBuf],
    /// Logs to judge on.
    pub(super) judge: &'a [PathBuf],
    /// A document, or the folder that has UNIT.toml of each unit.
    pub(super) document: Option<&'a Path>,
}

/// A unit with its work, or with why there is none.
type Unit = (UnitId, Result<Work, Error>);

/// What came of a unit.
pub(super) type Outcome = (String, Result<FitReport, Error>);

impl Work {
    /// Files of its runs, each once.
    pub(super) fn logs(&self) -> Vec<PathBuf> {
        let mut files: Vec<PathBuf> = Vec::new();
        for file in self.runs.iter().flat_map(Run::files) {
            if !files.contains(file) {
                files.push(file.clone());
            }
        }
        files
    }
}

impl Named<'_> {
    /// The units that there is something to fit of: that of the document, else all that the logs have.
    pub(super) fn units(&self) -> Result<Vec<Unit>, Error> {
        let folder = self.document.filter(|path| path.is_dir());
        if let Some(document) = self.document.filter(|_| folder.is_none()) {
            let base = Written::read(document)?;
            let unit = base.loaded.unit.clone();
            let runs = of_document(self.reading, self.logs, &unit)?;
            let judges = if self.judge.is_empty() {
                Vec::new()
            } else {
                of_document(self.reading, self.judge, &unit)?
            };
            return Ok(vec![(unit, Ok(Work { base: Some(base), runs, judges }))]);
        }
        let of_units = self.reading.runs(self.logs, None)?;
        if of_units.is_empty() {
            return Err(Error::Refused(vec!["the logs have no raw readings".to_owned()]));
        }
        let mut judging = match of_units.keys().next() {
            Some(first) if !self.judge.is_empty() => self.reading.runs(self.judge, Some(first))?,
            _ => std::collections::BTreeMap::new(),
        };
        let mut work = |unit: &UnitId, runs| {
            let base = folder.map(|folder| of_folder(folder, unit)).transpose()?;
            let judges = judging.remove(unit).unwrap_or_default();
            if judges.is_empty() && !self.judge.is_empty() {
                return Err(Error::Refused(vec![format!("--judge: the logs have nothing of unit {unit}")]));
            }
            Ok(Work { base, runs, judges })
        };
        let units = of_units.into_iter().map(|(unit, runs)| {
            let work = work(&unit, runs);
            (unit, work)
        });
        Ok(units.collect())
    }
}

/// The runs of the unit that a document is of, or that --unit names; what the logs have of other units is left alone.
fn of_document(reading: &Reading, logs: &[PathBuf], unit: &UnitId) -> Result<Vec<Run>, Error> {
    let mut runs = reading.runs(logs, Some(unit))?;
    let wanted = reading.serial()?.unwrap_or_else(|| unit.clone());
    runs.remove(&wanted).ok_or_else(|| {
        let there: Vec<String> = runs.keys().map(ToString::to_string).collect();
        Error::Refused(vec![format!(
            "the logs are of unit {}, the document is of {unit}: give the document of that unit, or --unit where the serial has changed",
            if there.is_empty() { "none".to_owned() } else { there.join(", ") }
        )])
    })
}

/// The document of a unit in a folder, which must be of that unit.
fn of_folder(folder: &Path, unit: &UnitId) -> Result<Written, Error> {
    let path = folder.join(format!("{unit}.toml"));
    if !path.exists() {
        return Err(Error::Refused(vec![format!(
            "{} is not there: the folder that --document names needs a document of each unit; leave the unit out with --unit",
            path.display()
        )]));
    }
    let written = Written::read(&path)?;
    if written.loaded.unit != *unit {
        return Err(Error::Refused(vec![format!(
            "{} is of unit {}: correct its name, or its unit",
            path.display(),
            written.loaded.unit
        )]));
    }
    Ok(written)
}

/// Fits all units, as many at a time as there are processors, writes what comes of each, and closes several with one table.
/// A unit that cannot be fitted does not stop the others. `fit` is told which bars to show: those of several units would fall over
/// each other.
pub(super) fn carry_out(
    output: &OutputArgs,
    title: &str,
    mut units: Vec<Unit>,
    fit: impl Fn(&Work, fn() -> Bar) -> Result<Fitted, Error> + Sync,
) -> Result<(), Error> {
    if units.len() == 1
        && let Some((_, work)) = units.pop()
    {
        return output.finish(&fit(&work?, Bar::reading)?);
    }
    units.iter().try_for_each(|(unit, _)| output.check_unit(unit.as_str()))?;
    let bar = Bar::counting("units fitted", units.len());
    let reports = in_parallel(
        &units,
        |ready| bar.at(ready),
        |(unit, work)| {
            let work = work.as_ref().map_err(|error| Error::Refused(vec![error.to_string()]))?;
            let fitted = fit(work, Bar::hidden)?;
            output.save(&fitted, |path| of_unit(path, unit.as_str()))?;
            Ok(fitted.report)
        },
    );
    bar.finish();
    let names = units.into_iter().map(|(unit, _)| unit.to_string());
    output.finish_batch(title, &names.zip(reports).collect::<Vec<_>>())
}

/// Prints what came of several units, the table that closes them last; `html` is a page of that table, and whether it may replace
/// another.
pub(super) fn close_batch(
    title: &str,
    units: &[Outcome],
    html: (Option<&Path>, bool),
    as_json: bool,
) -> Result<(), Error> {
    let mut batch = BatchTable::default();
    let (mut refusals, mut reports) = (Vec::new(), Vec::new());
    for (unit, came) in units {
        match came {
            Ok(report) => {
                if as_json {
                    reports.push(report.to_json());
                } else {
                    print(format!("{}\n", report.to_text()).as_bytes())?;
                }
                batch.add(unit, Ok(report.verdicts.clone()));
                refusals.extend(report.refusals());
            }
            Err(error) => {
                batch.add(unit, Err(error.to_string()));
                refusals.push(format!("{unit}: {error}"));
            }
        }
    }
    if let (Some(html), overwrite) = html {
        write_file(html, batch.to_html(title).as_bytes(), overwrite)?;
    }
    if as_json {
        print(format!("{}\n", json!({ "batch": batch.to_json(), "reports": reports })).as_bytes())?;
    } else {
        print(batch.to_text().as_bytes())?;
    }
    if refusals.is_empty() { Ok(()) } else { Err(Error::Refused(refusals)) }
}
