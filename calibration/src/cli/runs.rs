//! The arguments that name logs, the same for every command.

use std::collections::BTreeMap;
use std::path::PathBuf;

use clap::Args;
use isotherm_cli::Window;
use isotherm_log::mapping::Mapping;
use isotherm_log::offline::unit_id;
use isotherm_log::part::{LogFiles, Part, are_recordings};
use isotherm_protocol::key::UnitId;

use crate::document::{name_of, recordings_in};
use crate::error::Error;
use crate::runs::{Run, units_of};

/// Gyro ticks in a batch of a text log.
const BATCH_TICKS: usize = 512;

/// Logs, of one unit or of several.
#[derive(Debug, Clone, Args)]
pub(super) struct LogArgs {
    /// Recordings (.mcap), or the files of a text log in the mapping's order, or a folder of them
    #[arg(required = true, value_name = "LOG")]
    pub(super) log: Vec<PathBuf>,
    #[command(flatten)]
    pub(super) reading: Reading,
}

/// The document that a fit starts from.
#[derive(Debug, Clone, Args)]
pub(super) struct BaseArgs {
    /// Calibration document (TOML) that the fit starts from; several units: the folder with the document of each
    #[arg(long = "calibration", short = 'c', alias = "document", short_alias = 'd', value_name = "FILE")]
    pub(super) document: Option<PathBuf>,
}

/// How logs are read.
#[derive(Debug, Clone, Args)]
pub(super) struct Reading {
    /// Column mapping of a text log (TOML) (default: LOG with .mapping.toml); examples: config/mappings
    #[arg(long, short, value_name = "FILE")]
    pub(super) mapping: Option<PathBuf>,
    /// Unit serial, if the recordings have several; text log: the serial to assign (default: the document's)
    #[arg(long, short, value_name = "SERIAL")]
    pub(super) unit: Option<String>,
    #[command(flatten)]
    pub(super) window: Window,
}

impl Reading {
    /// The serial that was given.
    pub(super) fn serial(&self) -> Result<Option<UnitId>, Error> {
        Ok(self.unit.as_deref().map(unit_id).transpose()?)
    }

    /// The part of each log's time, and the unit that was given.
    pub(super) fn part(&self) -> Result<Part, Error> {
        let (start, end) = self.window.limits().map_err(Error::Usage)?;
        Ok(Part { units: self.serial()?.into_iter().collect(), start, end })
    }

    /// Runs by unit, each log for itself: every recording is a run, and of text logs as many files as the mapping has.
    pub(super) fn runs(
        &self,
        logs: &[PathBuf],
        fallback: Option<&UnitId>,
    ) -> Result<BTreeMap<UnitId, Vec<Run>>, Error> {
        let together =
            if are_recordings(&unfolded(logs)?)? { 1 } else { self.text_mapping(logs)?.files.len().max(1) };
        let folders = logs.iter().all(|path| path.is_dir());
        let mut of_unit: BTreeMap<UnitId, Vec<Run>> = BTreeMap::new();
        for log in logs.chunks(if folders { 1 } else { together }) {
            for (unit, run) in self.runs_in(log, fallback)? {
                of_unit.entry(unit).or_default().push(run);
            }
        }
        Ok(of_unit)
    }

    /// The run of every unit in files that are one log; of recordings, those that have the unit.
    pub(super) fn runs_in(
        &self,
        log: &[PathBuf],
        fallback: Option<&UnitId>,
    ) -> Result<BTreeMap<UnitId, Run>, Error> {
        let part = self.part()?;
        let given = self.serial()?;
        let name = names(log);
        let files = &unfolded(log)?;
        if !are_recordings(files)? {
            let unit = given.as_ref().or(fallback).cloned().ok_or_else(|| {
                Error::Usage(format!(
                    "{name} is a text log, which does not state its unit: give --unit SERIAL, or --calibration"
                ))
            })?;
            let mapping = Box::new(self.text_mapping(files)?);
            let text = LogFiles::Text {
                paths: files.clone(),
                mapping,
                unit: unit.clone(),
                batch_ticks: BATCH_TICKS,
            };
            let run = Run::new(name, unit.clone(), text, &part).given_as(log.to_vec());
            return Ok([(unit, run)].into());
        }
        if let Some(mapping) = &self.mapping {
            let words = format!(
                "--mapping {} is for text logs, {name} is a recording: leave it out",
                mapping.display()
            );
            return Err(Error::Usage(words));
        }
        let mut of_units: BTreeMap<UnitId, Vec<PathBuf>> = BTreeMap::new();
        for file in files {
            let mut log = LogFiles::Recordings(vec![file.clone()]).open(&Part::default())?;
            let (units, cut) = units_of(&mut log)?;
            if let (true, Some(cut)) = (units.is_empty(), cut.words()) {
                return Err(Error::refused(format!("no raw readings can be read: {cut}")));
            }
            for unit in units.into_iter().filter(|unit| given.as_ref().is_none_or(|given| given == unit)) {
                of_units.entry(unit).or_default().push(file.clone());
            }
        }
        let of_unit = |(unit, own): (UnitId, Vec<PathBuf>)| {
            let has =
                |given: &&PathBuf| own.iter().any(|file| file == *given || file.parent() == Some(given));
            let given: Vec<PathBuf> = log.iter().filter(has).cloned().collect();
            let run = Run::new(names(&given), unit.clone(), LogFiles::Recordings(own), &part);
            (unit, run.given_as(given))
        };
        Ok(of_units.into_iter().map(of_unit).collect())
    }

    fn text_mapping(&self, logs: &[PathBuf]) -> Result<Mapping, Error> {
        if let Some(mapping) = Mapping::path_of(self.mapping.as_deref(), logs) {
            return Ok(Mapping::load(&mapping)?);
        }
        for path in logs {
            let about =
                std::fs::metadata(path).map_err(|source| Error::file(path, "open the log", source))?;
            if about.is_file() && about.len() == 0 {
                return Err(Error::refused(format!(
                    "{} is empty: was it recorded and copied completely?",
                    path.display()
                )));
            }
        }
        let folder = logs.iter().find(|path| path.is_dir());
        Err(Error::Usage(match folder {
            Some(folder) => format!(
                "the folder {} has no recording (.mcap) in it; a folder with the files of a text log needs --mapping \
                 FILE that names them: examples are in config/mappings",
                folder.display()
            ),
            None => format!(
                "{} is not a recording, and a text log needs --mapping FILE: make one with `isotherm-replay import {}`",
                names(logs),
                names(logs)
            ),
        }))
    }
}

/// The logs with the recordings of each folder in its place; a folder without any stays.
fn unfolded(logs: &[PathBuf]) -> Result<Vec<PathBuf>, Error> {
    let mut all = Vec::new();
    for log in logs {
        let inside = if log.is_dir() { recordings_in(log)? } else { Vec::new() };
        if inside.is_empty() {
            all.push(log.clone());
        }
        all.extend(inside);
    }
    Ok(all)
}

/// Names of files, as a run is called.
fn names(paths: &[PathBuf]) -> String {
    paths.iter().map(|path| name_of(path)).collect::<Vec<_>>().join(" + ")
}
