//! The arguments that name a log and a part of it, the same for every command.

use std::collections::BTreeSet;
use std::path::PathBuf;

use clap::Args;
use isotherm_cli::Window;
use isotherm_log::mapping::Mapping;
use isotherm_log::part::{LogFiles, Messages, Part, are_recordings};
use isotherm_log::replica::check_units;
use isotherm_log::text::LogReader;
use isotherm_protocol::key::UnitId;

use crate::error::Error;

/// Which log, and which part of it.
#[derive(Debug, Clone, Args)]
pub(crate) struct LogArgs {
    /// Recordings, read in sequence; or the files of one text log in the mapping's order, or their folder
    #[arg(required = true, value_name = "LOG")]
    pub(crate) log: Vec<PathBuf>,
    /// Column mapping of a text log (default: LOG with .mapping.toml, as `isotherm-replay import` writes it)
    #[arg(long, short, value_name = "FILE")]
    pub(crate) mapping: Option<PathBuf>,
    /// Unit serial, repeatable (default: all). Text log: the serial to assign
    #[arg(long, short, value_name = "SERIAL", value_parser = UnitId::new)]
    pub(crate) unit: Vec<UnitId>,
    #[command(flatten)]
    pub(crate) window: Window,
}

/// What a text log's unit is called where nobody says, and nothing depends on it.
pub(crate) fn unnamed() -> Option<UnitId> {
    UnitId::new("log").ok()
}

impl LogArgs {
    /// Whether the log is recordings.
    ///
    /// # Errors
    /// Where recordings and other files are mixed, or a mapping is given for recordings.
    pub(crate) fn is_recording(&self) -> Result<bool, Error> {
        let recordings = are_recordings(&self.log)?;
        match &self.mapping {
            Some(mapping) if recordings => Err(Error::Usage(format!(
                "--mapping {} is for text logs, the log is recordings: leave it out",
                mapping.display()
            ))),
            _ => Ok(recordings),
        }
    }

    /// The units given.
    pub(crate) fn units(&self) -> BTreeSet<UnitId> {
        self.unit.iter().cloned().collect()
    }

    /// Refuses to correct a text log of one unit by the document of another.
    ///
    /// # Errors
    /// Where `--unit` is another unit than the document's.
    pub(crate) fn refuse_document_of_another(&self, document: &str) -> Result<(), Error> {
        match self.unit.iter().find(|given| given.as_str() != document) {
            Some(given) if !self.is_recording()? => Err(Error::Usage(format!(
                "--unit is {given}, --calibration is for unit {document}: give the document of {given}, or leave --unit out to correct the \
                 log as one of {document}"
            ))),
            _ => Ok(()),
        }
    }

    /// The part of the log's time and units.
    ///
    /// # Errors
    /// Where the part ends before it begins.
    pub(crate) fn part(&self) -> Result<Part, Error> {
        let (start, end) = self.window.limits().map_err(Error::Usage)?;
        Ok(Part { units: self.units(), start, end })
    }

    /// Which files to open, and how. A text log is of the one unit that is given, else of `unit`; it is put into gyro
    /// batches of so many ticks.
    ///
    /// # Errors
    /// As [`LogArgs::is_recording`] and [`Mapping::load`]; where a text log has no unit or several.
    pub(crate) fn files(&self, batch_ticks: usize, unit: Option<&UnitId>) -> Result<LogFiles, Error> {
        let given = self.units();
        if self.is_recording()? {
            check_units(&self.log, &given)?;
            return Ok(LogFiles::Recordings(self.log.clone()));
        }
        let mut units = given.iter().chain(unit.filter(|_| given.is_empty()));
        let unit = match (units.next(), units.next()) {
            (Some(unit), None) => unit.clone(),
            (None, _) => {
                let words = "a text log does not say which unit it is of: give --unit SERIAL";
                return Err(Error::Usage(words.to_owned()));
            }
            (Some(_), Some(_)) => {
                let words = "a text log is of one unit: give --unit once";
                return Err(Error::Usage(words.to_owned()));
            }
        };
        let mapping = Box::new(self.text_mapping()?);
        Ok(LogFiles::Text { paths: self.log.clone(), mapping, unit, batch_ticks })
    }

    /// Opens the log's part as messages, those of a text log of one tick each: [`LogArgs::files`] and [`LogArgs::part`] in one.
    ///
    /// # Errors
    /// As these.
    pub(crate) fn messages(&self) -> Result<Messages, Error> {
        Ok(self.files(1, unnamed().as_ref())?.open(&self.part()?)?)
    }

    /// The files that the log is read from: those of a folder are the mapping's.
    ///
    /// # Errors
    /// As [`LogArgs::files`].
    pub(crate) fn log_files(&self) -> Result<Vec<PathBuf>, Error> {
        if self.is_recording()? {
            return Ok(self.log.clone());
        }
        Ok(self.text_log()?.paths().to_vec())
    }

    /// Opens a text log.
    ///
    /// # Errors
    /// As [`LogArgs::files`].
    pub(crate) fn text_log(&self) -> Result<LogReader, Error> {
        Ok(LogReader::open(&self.text_mapping()?, &self.log)?)
    }

    /// The file of a text log's mapping: the one given, else the one beside the log.
    pub(crate) fn mapping_file(&self) -> Option<PathBuf> {
        if are_recordings(&self.log).unwrap_or_default() {
            return None;
        }
        Mapping::path_of(self.mapping.as_deref(), &self.log)
    }

    /// The mapping of a text log.
    fn text_mapping(&self) -> Result<Mapping, Error> {
        if let Some(mapping) = self.mapping_file() {
            return Ok(Mapping::load(&mapping)?);
        }
        for path in &self.log {
            std::fs::metadata(path).map_err(|source| Error::file(path, "open the log", source))?;
        }
        let first = self.log.first().cloned().unwrap_or_default();
        let (log, beside) = (first.display(), Mapping::path_beside(&first));
        let beside = beside.display();
        Err(Error::Usage(format!(
            "{log} is not a recording, and a text log needs --mapping FILE or {beside}: make one with \
             `isotherm-replay import {log}`, or use one of config/mappings"
        )))
    }

    /// Every file that is read, for outputs that must not fall on one; what cannot be opened is said where it is read.
    pub(crate) fn inputs(&self) -> Vec<PathBuf> {
        let files = self.log_files().unwrap_or_else(|_| self.log.clone());
        files.into_iter().chain(self.mapping_file()).collect()
    }
}
