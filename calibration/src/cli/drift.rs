//! `isotherm-calibrate drift`.

use std::path::PathBuf;

use clap::Args;
use isotherm_log::diff::is_csv;
use serde_json::json;

use super::driver::{Done, Job, Task};
use super::output::OutputArgs;
use super::runs::{BaseArgs, LogArgs};
use super::units::{Logs, Unit, Work};
use crate::document::{BASE, TOOL, Written, base_of, command_line, origin};
use crate::error::Error;
use crate::fits::drift::columns::{Columns, Kind, unnamed};
use crate::fits::drift::document::{Parameters, put};
use crate::fits::drift::fit::analyse;
use crate::fits::drift::pieces::Grid;
use crate::fits::drift::report::Found;
use crate::fits::drift::trend::FIT_H;
use crate::limits::{above_0, not_0};
use crate::report::Report;

/// Noise and drift of a log at rest: Allan deviation, Markov drift, trend, spectrum, estimator parameters
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    isotherm-calibrate drift static.mcap --html drift.html\n  \
    isotherm-calibrate drift rlg-static.imu.gz --mapping config/mappings/rlg-static.toml --increment-weight 0.1\n  \
    isotherm-calibrate drift static.mcap --calibration unit.toml --out unit-drift.toml\n\n\
    With --calibration the log is first corrected by the service's own code, and the remainder is analysed. \
    Rates are in °/h, N in °/√h, K in °/h/√h, R in °/h², Q in ″.")]
pub(super) struct DriftArgs {
    #[command(flatten)]
    log: LogArgs,
    /// Analyse the accelerometers instead of the gyros
    #[arg(long)]
    accelerometers: bool,
    /// The recording has corrected ticks (a CSV of isotherm-replay correct is recognised)
    #[arg(long, conflicts_with_all = ["document", "increment_weight"])]
    corrected: bool,
    /// Gyro angle per count (″), for counts without a document
    #[arg(long, value_name = "ARCSEC", conflicts_with = "document", value_parser = not_0)]
    increment_weight: Option<f64>,
    #[command(flatten)]
    base: BaseArgs,
    /// Sigma of the constant part at start (°/h), if known from several starts
    #[arg(long, hide_short_help = true, value_name = "DEG_PER_H", value_parser = above_0)]
    initial_sigma: Option<f64>,
    /// Length of the trend fit before extrapolation (h)
    #[arg(long, hide_short_help = true, value_name = "HOURS", default_value_t = FIT_H, value_parser = above_0)]
    fit_hours: f64,
    #[command(flatten)]
    output: OutputArgs,
}

impl DriftArgs {
    pub(super) fn run(&self) -> Result<(), Error> {
        let files = self.output.files();
        if files.out.is_some() && (self.base.document.is_none() || self.accelerometers) {
            return Err(Error::Usage(
                "--out is the document with what the estimator is to expect of its gyros: give it with --calibration, and leave \
                 --accelerometers out"
                    .to_owned(),
            ));
        }
        let corrected = self.are_corrected()?;
        let logs = Logs { unnamed: Some(unnamed()?), ..Logs::together(&self.log, &self.base) };
        let task = Task::new("Noise and drift of several units", files, logs);
        task.run_on(|| self.units(&task.logs, corrected), |job| self.analyse(job, corrected))
    }

    /// The units of the logs; corrected ticks are read where they are analysed.
    fn units(&self, logs: &Logs<'_>, corrected: bool) -> Result<Vec<Unit>, Error> {
        if !corrected {
            return logs.units();
        }
        let unit = self.log.reading.serial()?.map_or_else(unnamed, Ok)?;
        Ok(vec![(unit, Ok(Work::new(None, Vec::new(), Vec::new())))])
    }

    fn analyse(&self, job: &Job<'_>, corrected: bool) -> Result<Done, Error> {
        let columns = self.columns(job, corrected)?;
        let (unit, kind, corrected) = (columns.unit.to_string(), columns.kind, columns.corrected);
        let grid = Grid::of(columns)?;
        let working = job.at_work("Allan deviations, drift, spectrum");
        let sensors = analyse(&grid, self.fit_hours);
        working.finish();
        let rates = sensors.iter().filter(|_| kind == Kind::Rate);
        let parameters =
            rates.map(|sensor| (sensor.name.clone(), Parameters::of(sensor, self.initial_sigma)));
        let found = Found { kind, length_h: grid.length_h(), parameters: parameters.collect(), sensors };
        let mut report = found.report(&unit, corrected, grid);
        report.warnings.splice(0..0, job.work.told());
        // Where every gyro is refused there is nothing new to say.
        let stated = self.output.files().out.is_some() && found.stated().next().is_some();
        let base = job.work.base.as_ref().filter(|_| stated);
        let document = base.map(|base| self.document(base, job.work, (&found, &report))).transpose()?;
        Ok(Done { report, document })
    }

    /// Whether the logs have corrected ticks. What is for raw ones, and raw ticks beside them, would be left out without a word.
    fn are_corrected(&self) -> Result<bool, Error> {
        if self.corrected {
            return Ok(true);
        }
        let (corrected, raw): (Vec<&PathBuf>, Vec<_>) = self.log.log.iter().partition(|path| is_csv(path));
        let Some(corrected) = corrected.first() else { return Ok(false) };
        let why = if let Some(raw) = raw.first() {
            format!(
                ", {} is not: give logs of one kind, or --corrected for the corrected ticks of recordings",
                raw.display()
            )
        } else if self.base.document.is_some() {
            ": --calibration is for raw readings; give the log that it was made from, or leave --calibration out"
                .to_owned()
        } else if self.increment_weight.is_some() {
            ": --increment-weight is for raw counts; leave it out".to_owned()
        } else {
            return Ok(true);
        };
        Err(Error::Usage(format!("{} is a CSV of corrected ticks{why}", corrected.display())))
    }

    fn columns(&self, job: &Job<'_>, corrected: bool) -> Result<Columns, Error> {
        let work = job.work;
        let kind = if self.accelerometers { Kind::Force } else { Kind::Rate };
        if corrected {
            let part = self.log.reading.part()?;
            return Columns::of_corrected(&self.log.log, &part, kind, &work.cut);
        }
        let run = work.run()?;
        if let Some(document) = &work.base {
            return Columns::corrected_by(run, &document.loaded, kind);
        }
        Columns::raw(run.series()?, kind, self.increment_weight)
    }

    /// The unit's document with the parameters in it.
    fn document(
        &self,
        base: &Written,
        work: &Work,
        (found, report): (&Found, &Report),
    ) -> Result<Written, Error> {
        let mut document = base.document.clone();
        // What the document says of the constant part holds, unless something else was stated.
        put(&mut document, found, self.initial_sigma.is_none())?;
        document.created = Some(self.output.date()?);
        let of_log = origin(&work.logs(), &command_line())?;
        let mut whole = document.origin.take().unwrap_or_default();
        let mut details = whole.details.take().unwrap_or_default();
        let notes: Vec<String> = found
            .stated()
            .flat_map(|(name, found)| found.notes.iter().map(move |note| format!("gyro {name}: {note}")))
            .collect();
        let about = json!({
            "tool": TOOL,
            "command": of_log.command,
            "method": "restricted maximum likelihood of a first-order Markov drift; N from the overlapping Allan variance",
            "length_h": found.length_h,
            "verdict": report.headline(),
            "notes": notes,
            "log": of_log.log,
        });
        let about = toml::Value::try_from(about).map_err(|error| Error::document(&error))?;
        details.insert("drift".to_owned(), about);
        details.insert(BASE.to_owned(), base_of(Some(base)));
        whole.details = Some(details);
        document.origin = Some(whole);
        Written::of(&document)
    }
}
