//! `isotherm-calibrate validate`.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use clap::Args;
use isotherm_cli::Bar;
use isotherm_protocol::key::UnitId;

use super::bar;
use super::batch::{Outcome, close};
use super::page::PageArgs;
use super::place::PlaceArgs;
use super::print;
use super::runs::Reading;
use crate::error::Error;
use crate::report::{FitReport, in_parallel};
use crate::runs::{Run, Watch};
use crate::validate::{JudgedLog, Wanted, validate};
use crate::written::Written;

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
    /// Recordings (.mcap), or text logs with --mapping; each is a run
    #[arg(required = true, value_name = "LOG")]
    log: Vec<PathBuf>,
    #[command(flatten)]
    reading: Reading,
    /// Averaging windows (s) (default: 10, up to 100 in logs of an hour and more)
    #[arg(long, value_name = "SECONDS")]
    window: Option<f64>,
    #[command(flatten)]
    place: PlaceArgs,
    #[command(flatten)]
    page: PageArgs,
    /// Print everything as one JSON object
    #[arg(long)]
    json: bool,
}

/// Documents with their names, by serial.
type Documents = BTreeMap<String, (String, Written)>;

/// One unit of a batch.
struct Work {
    name: String,
    unit: UnitId,
    written: Option<Written>,
    logs: Vec<JudgedLog>,
}

impl ValidateArgs {
    /// Does what the command says.
    pub(super) fn run(&self) -> Result<(), Error> {
        let wanted = self.wanted()?;
        let mut inputs: Vec<&Path> = self.log.iter().map(PathBuf::as_path).collect();
        inputs.push(&self.document);
        self.page.check(&inputs)?;
        let (documents, folder) = self.documents()?;
        let fallback =
            if folder { None } else { documents.values().next().map(|(_, d)| d.loaded.unit.clone()) };
        let work = self.work(documents, folder, fallback.as_ref())?;
        let reports = if let [only] = work.as_slice() {
            vec![only.judged(wanted, bar::reading())]
        } else {
            work.iter().try_for_each(|work| self.page.check_unit(work.unit.as_str()))?;
            let bar = Bar::counting("units judged", work.len());
            let reports = in_parallel(&work, |ready| bar.at(ready as u64), |work| work.judged(wanted, ()));
            bar.finish();
            reports
        };
        if reports.len() > 1 {
            let names = work.iter().map(|work| work.unit.to_string());
            return Error::end(self.several(&names.zip(reports).collect::<Vec<_>>())?, cuts(&work));
        }
        let report = reports.into_iter().next().unwrap_or_else(|| Err(nothing()))?;
        self.one(&report)?;
        Error::end(report.refusals(), cuts(&work))
    }

    fn wanted(&self) -> Result<Wanted, Error> {
        if let Some(window) = self.window.filter(|window| !(window.is_finite() && *window > 0.0)) {
            return Err(Error::Usage(format!("--window is {window}, must be a number of seconds above 0")));
        }
        Ok(Wanted { window_s: self.window, place: self.place.known()? })
    }

    /// Documents by serial, and whether they are of a folder.
    fn documents(&self) -> Result<(Documents, bool), Error> {
        let name = |path: &Path| path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        if !self.document.is_dir() {
            let written = Written::read(&self.document)?;
            return Ok(([(written.document.unit.clone(), (name(&self.document), written))].into(), false));
        }
        let read = |source| Error::file(&self.document, "read the folder", source);
        let mut paths = Vec::new();
        for entry in std::fs::read_dir(&self.document).map_err(read)? {
            let path = entry.map_err(read)?.path();
            if path.extension().is_some_and(|extension| extension == "toml") {
                paths.push(path);
            }
        }
        paths.sort();
        let mut documents = Documents::new();
        for path in paths {
            let written = Written::read(&path)?;
            let unit = written.document.unit.clone();
            if let Some((other, _)) = documents.get(&unit) {
                return Err(Error::Refused(vec![format!(
                    "{other} and {} are both for unit {unit}: choose the one to judge",
                    name(&path)
                )]));
            }
            documents.insert(unit, (name(&path), written));
        }
        Ok((documents, true))
    }

    fn work(
        &self,
        mut documents: Documents,
        folder: bool,
        fallback: Option<&UnitId>,
    ) -> Result<Vec<Work>, Error> {
        let runs = self.reading.runs(&self.log, fallback)?;
        if runs.is_empty() {
            return Err(nothing());
        }
        if !folder && runs.len() > 1 {
            let units: Vec<String> = runs.keys().map(ToString::to_string).collect();
            return Err(Error::Refused(vec![format!(
                "the logs are of several units ({}): choose one with --unit, or give a folder with a document for each",
                units.join(", ")
            )]));
        }
        let mut work = Vec::new();
        for (unit, runs) in runs {
            let found = documents.remove(unit.as_str()).or_else(|| {
                let only = if folder { None } else { documents.keys().next().cloned() };
                only.and_then(|only| documents.remove(&only))
            });
            let (name, written) =
                found.map_or((String::new(), None), |(name, written)| (name, Some(written)));
            let mut logs = Vec::new();
            for run in runs {
                logs.push(match &written {
                    Some(written) => JudgedLog::new(run, &written.document)?,
                    None => JudgedLog { run, known: false },
                });
            }
            work.push(Work { name, unit, written, logs });
        }
        Ok(work)
    }

    fn one(&self, report: &FitReport) -> Result<(), Error> {
        self.page.write(|| report.to_html())?;
        let text = if self.json { format!("{}\n", report.to_json()) } else { report.to_text() };
        print(text.as_bytes())
    }

    fn several(&self, reports: &[Outcome<FitReport>]) -> Result<Vec<String>, Error> {
        for (unit, report) in reports.iter().filter_map(|(unit, came)| Some((unit, came.as_ref().ok()?))) {
            self.page.write_unit(unit, || report.to_html())?;
        }
        close("Judgement of several units", reports, (self.page.table(), self.json), false)
    }
}

impl Work {
    fn judged(&self, wanted: Wanted, watch: impl Watch) -> Result<FitReport, Error> {
        let Some(written) = &self.written else {
            return Err(Error::Refused(vec![format!(
                "no document of the folder is for unit {}: put one there, or leave the unit out with --unit",
                self.unit
            )]));
        };
        let judged = validate(&self.name, written, &self.logs, wanted, watch);
        let cuts = cuts(std::slice::from_ref(self));
        let mut report = judged.map_err(|error| error.beside(&cuts))?;
        report.warnings.extend(cuts);
        Ok(report)
    }
}

/// Where logs are cut short, each once.
fn cuts(work: &[Work]) -> Vec<String> {
    let runs = work.iter().flat_map(|work| &work.logs).map(|log| &log.run);
    let mut cuts: Vec<String> = runs.filter_map(Run::cut_short).map(str::to_owned).collect();
    cuts.sort();
    cuts.dedup();
    cuts
}

fn nothing() -> Error {
    Error::Refused(vec!["the logs have no raw readings".to_owned()])
}
