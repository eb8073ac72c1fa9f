//! `isotherm-calibrate validate`.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use clap::Args;
use isotherm_correction::earth::Place;
use isotherm_log::file::refuse_overwriting;
use isotherm_protocol::key::UnitId;
use serde_json::json;

use super::bar::Bar;
use super::print;
use super::runs::Reading;
use crate::error::Error;
use crate::provenance::origin;
use crate::report::{BatchTable, FitReport, in_parallel, of_unit};
use crate::run::{Run, Watch};
use crate::validate::{JudgedLog, Wanted, digests, validate};
use crate::written::{Written, write_file};

/// Judge a calibration document on logs that it was not made from
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    isotherm-calibrate validate FOG-0001.toml judging.mcap --html judgement.html\n  \
    isotherm-calibrate validate chamber-mems.toml chamber.tsv --mapping config/mappings/chamber-mems.toml\n  \
    isotherm-calibrate validate config/calibration fleet-1.mcap fleet-2.mcap --json\n\n\
    The unit is at rest in the logs. Before is nominal: the document without what knows of temperature, bias or mode. \
    Exit code 1 where the document makes an axis worse than nominal. With a folder of documents every unit of the logs is judged \
    by the document of its serial, several at a time; each has an HTML file of its own, FILE-SERIAL.html.")]
pub(super) struct ValidateArgs {
    /// The document, or a folder with the documents of several units
    #[arg(value_name = "DOC")]
    document: PathBuf,
    /// Recordings (.mcap), or text logs with --mapping; every one is a run for itself
    #[arg(required = true, value_name = "LOG")]
    log: Vec<PathBuf>,
    #[command(flatten)]
    reading: Reading,
    /// Length of the windows that are averaged over
    #[arg(long, value_name = "SECONDS", default_value_t = 10.0)]
    window: f64,
    /// Latitude of the unit at rest (°): with it and --heading Earth rate is taken off instead of the mean
    #[arg(long, value_name = "DEG", requires = "heading", allow_negative_numbers = true)]
    latitude: Option<f64>,
    /// Heading of the case's x axis from north towards east (°)
    #[arg(long, value_name = "DEG", requires = "latitude", allow_negative_numbers = true)]
    heading: Option<f64>,
    /// Roll about the case's x axis (°); without it the unit is levelled by its accelerometers
    #[arg(
        long,
        value_name = "DEG",
        requires = "pitch",
        requires = "latitude",
        allow_negative_numbers = true
    )]
    roll: Option<f64>,
    /// Pitch of the case's x axis above the horizon (°)
    #[arg(long, value_name = "DEG", requires = "roll", allow_negative_numbers = true)]
    pitch: Option<f64>,
    /// Write the report with its diagrams as one HTML file
    #[arg(long, value_name = "FILE")]
    html: Option<PathBuf>,
    /// Print everything as one JSON object
    #[arg(long)]
    json: bool,
}

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
        let (documents, folder) = self.documents()?;
        let fallback =
            if folder { None } else { documents.values().next().map(|(_, d)| d.loaded.unit.clone()) };
        if let Some(html) = &self.html {
            let mut inputs: Vec<&Path> = self.log.iter().map(PathBuf::as_path).collect();
            inputs.push(&self.document);
            refuse_overwriting(html, &inputs)?;
        }
        let work = self.work(documents, folder, fallback.as_ref())?;
        let reports = if let [only] = work.as_slice() {
            vec![judged(only, wanted, Bar::reading())]
        } else {
            let bar = Bar::counting("units judged", work.len());
            let reports = in_parallel(&work, |ready| bar.at(ready), |work| judged(work, wanted, ()));
            bar.finish();
            reports
        };
        match reports.len() {
            1 => self.one(reports.into_iter().next().unwrap_or_else(|| Err(nothing()))?),
            _ => self.several(&work, reports),
        }
    }

    fn wanted(&self) -> Result<Wanted, Error> {
        if !(self.window.is_finite() && self.window > 0.0) {
            return Err(Error::Usage(format!(
                "--window is {}, must be a number of seconds above 0",
                self.window
            )));
        }
        let place = match (self.latitude, self.heading) {
            (Some(latitude), Some(heading)) => {
                let place = Place::new(latitude, heading, self.pitch.zip(self.roll).map(|(p, r)| [p, r]));
                let words = |errors: Vec<isotherm_correction::earth::PlaceError>| {
                    errors.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n")
                };
                Some(place.map_err(|errors| Error::Usage(words(errors)))?)
            }
            _ => None,
        };
        Ok(Wanted { window_s: self.window, place })
    }

    /// Documents by serial, and whether they are of a folder.
    fn documents(&self) -> Result<(BTreeMap<String, (String, Written)>, bool), Error> {
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
        let mut documents: BTreeMap<String, (String, Written)> = BTreeMap::new();
        for path in paths {
            let written = Written::read(&path)?;
            let unit = written.document.unit.clone();
            if let Some((other, _)) = documents.get(&unit) {
                return Err(Error::Refused(vec![format!(
                    "{other} and {} are both for unit {unit}: name the one to judge",
                    name(&path)
                )]));
            }
            documents.insert(unit, (name(&path), written));
        }
        Ok((documents, true))
    }

    fn work(
        &self,
        mut documents: BTreeMap<String, (String, Written)>,
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
            let known = written.as_ref().map(|written| digests(&written.document)).unwrap_or_default();
            let mut logs = Vec::new();
            for run in runs {
                let files = self.files_of(&run);
                let known = !known.is_empty()
                    && origin(&files, "")?.log.iter().any(|log| known.contains(&log.sha256));
                logs.push(JudgedLog { run, known });
            }
            work.push(Work { name, unit, written, logs });
        }
        Ok(work)
    }

    /// The files of a run, by its name.
    fn files_of(&self, run: &Run) -> Vec<PathBuf> {
        let parts: Vec<&str> = run.name.split(" + ").collect();
        let name = |path: &Path| path.file_name().map(|name| name.to_string_lossy().into_owned());
        let of_run = |path: &&PathBuf| name(path).is_some_and(|name| parts.contains(&name.as_str()));
        self.log.iter().filter(of_run).filter(|path| path.is_file()).cloned().collect()
    }

    fn one(&self, report: FitReport) -> Result<(), Error> {
        if let Some(html) = &self.html {
            write_file(html, report.to_html().as_bytes(), true)?;
        }
        let text = if self.json { format!("{}\n", report.to_json()) } else { report.to_text() };
        print(text.as_bytes())?;
        end(report.refusals())
    }

    fn several(&self, work: &[Work], reports: Vec<Result<FitReport, Error>>) -> Result<(), Error> {
        let mut batch = BatchTable::default();
        let (mut refusals, mut all) = (Vec::new(), Vec::new());
        for (work, report) in work.iter().zip(&reports) {
            match report {
                Ok(report) => {
                    if let Some(html) = &self.html {
                        let path = of_unit(html, work.unit.as_str());
                        write_file(&path, report.to_html().as_bytes(), true)?;
                    }
                    if !self.json {
                        print(format!("{}\n", report.to_text()).as_bytes())?;
                    }
                    batch.add(work.unit.to_string(), Ok(report.verdicts.clone()));
                    refusals.extend(report.refusals());
                    all.push(report.to_json());
                }
                Err(error) => {
                    batch.add(work.unit.to_string(), Err(error.to_string()));
                    refusals.push(format!("{}: {error}", work.unit));
                }
            }
        }
        if let Some(html) = &self.html {
            write_file(html, batch.to_html("Judgement of several units").as_bytes(), true)?;
        }
        if self.json {
            print(format!("{}\n", json!({ "batch": batch.to_json(), "reports": all })).as_bytes())?;
        } else {
            print(batch.to_text().as_bytes())?;
        }
        end(refusals)
    }
}

fn judged(work: &Work, wanted: Wanted, watch: impl Watch) -> Result<FitReport, Error> {
    match &work.written {
        Some(written) => validate(&work.name, written, &work.logs, wanted, watch),
        None => Err(Error::Refused(vec![format!(
            "no document of the folder is for unit {}: put one there, or leave the unit out with --unit",
            work.unit
        )])),
    }
}

fn end(refusals: Vec<String>) -> Result<(), Error> {
    if refusals.is_empty() { Ok(()) } else { Err(Error::Refused(refusals)) }
}

fn nothing() -> Error {
    Error::Refused(vec!["the logs have no raw readings".to_owned()])
}
