//! `isotherm-calibrate validate`.

use std::collections::BTreeMap;
use std::path::PathBuf;

use clap::Args;

use super::driver::{Done, Job, Task};
use super::files::PageArgs;
use super::limits::above_0;
use super::place::PlaceArgs;
use super::runs::LogArgs;
use super::units::{Logs, Unit, Work};
use crate::document::provenance::files_of;
use crate::document::written::Written;
use crate::error::Error;
use crate::report::FitReport;
use crate::validate::{JudgedLog, Wanted, validate};

/// Judge a calibration document on logs that it was not made from
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    isotherm-calibrate validate FOG-0001.toml judging.mcap --html judgement.html\n  \
    isotherm-calibrate validate chamber-mems.toml chamber.tsv --mapping config/mappings/chamber-mems.toml\n  \
    isotherm-calibrate validate config/calibration fleet-1.mcap fleet-2.mcap --json\n\n\
    The unit is at rest in the logs. Before is nominal: the document without its temperature, bias and mode terms. Exit code 1 if the document makes an axis worse than nominal. With a folder of documents every unit of the logs is judged by its own document, with its own HTML file, FILE-SERIAL.html.")]
pub(super) struct ValidateArgs {
    /// The document, or a folder with the documents of several units
    #[arg(value_name = "DOC")]
    document: PathBuf,
    #[command(flatten)]
    log: LogArgs,
    /// Averaging windows (s) (default: 10, up to 100 in logs of an hour and more)
    #[arg(long, hide_short_help = true, value_name = "SECONDS")]
    window: Option<f64>,
    #[command(flatten)]
    place: PlaceArgs,
    #[command(flatten)]
    page: PageArgs,
}

impl ValidateArgs {
    /// Does what the command says.
    pub(super) fn run(&self) -> Result<(), Error> {
        above_0([("--window", self.window)])?;
        let wanted = Wanted { window_s: self.window, place: self.place.known()? };
        let logs = Logs::judging(&self.log, &self.document);
        let task = Task::new("Judgement of several units", self.page.files(), logs);
        task.run_on(|| self.units(), |job| judged(job, wanted))
    }

    /// Every unit of the logs with the document of its serial, or the one unit with the document that is given.
    fn units(&self) -> Result<Vec<Unit>, Error> {
        let folder = self.document.is_dir();
        let (mut documents, only) = if folder {
            (self.folder()?, None)
        } else {
            (BTreeMap::new(), Some(Written::read(&self.document)?))
        };
        let fallback = only.as_ref().map(|only| &only.loaded.unit);
        let runs = self.log.reading.runs(&self.log.log, fallback)?;
        if runs.is_empty() {
            return Err(Error::refused("the logs have no raw readings"));
        }
        if only.is_some() && runs.len() > 1 {
            let units: Vec<String> = runs.keys().map(ToString::to_string).collect();
            return Err(Error::refused(format!(
                "the logs are of several units ({}): choose one with --unit, or give a folder with a document for each",
                units.join(", ")
            )));
        }
        let mut only = only;
        let units = runs.into_iter().map(|(unit, runs)| {
            let document = only.take().or_else(|| documents.remove(unit.as_str())).ok_or_else(|| {
                Error::refused(format!(
                    "no document of the folder is for unit {unit}: put one there, or leave the unit out with --unit"
                ))
            });
            let work = document.map(|document| Work::new(Some(document), runs, Vec::new()));
            (unit, work)
        });
        Ok(units.collect())
    }

    /// The documents of the folder, by serial.
    fn folder(&self) -> Result<BTreeMap<String, Written>, Error> {
        let mut paths = files_of(&self.document)?;
        paths.retain(|path| path.extension().is_some_and(|extension| extension == "toml"));
        paths.sort();
        let mut documents: BTreeMap<String, Written> = BTreeMap::new();
        for path in &paths {
            let written = Written::read(path)?;
            let unit = written.document.unit.clone();
            if let Some(other) = documents.get(&unit) {
                return Err(Error::refused(format!(
                    "{} and {} are both for unit {unit}: choose the one to judge",
                    other.name, written.name
                )));
            }
            documents.insert(unit, written);
        }
        Ok(documents)
    }
}

/// A unit's runs with its document.
fn judged(job: &Job<'_>, wanted: Wanted) -> Result<Done<FitReport>, Error> {
    let work = job.work;
    let base = work.base()?;
    let logs = work.runs.iter().map(|run| JudgedLog::new(run.clone(), &base.document));
    let logs = logs.collect::<Result<Vec<_>, _>>()?;
    let mut report = validate(base, &logs, wanted, job.bar())?;
    report.warnings.extend(work.told());
    Ok(Done { report, document: None })
}
