//! `isotherm-calibrate drift`.

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use isotherm_cli::Bar;
use isotherm_log::diff::is_csv;
use serde_json::json;

use super::above_0;
use super::batch::{Batch, Named, Names, Unit, Work};
use super::output::OutputArgs;
use super::runs::LogArgs;
use crate::drift::analysis::{Wanted, analyse};
use crate::drift::columns::{Columns, Kind, unnamed};
use crate::drift::page::page;
use crate::drift::parameters::{Parameters, put};
use crate::drift::pieces::Grid;
use crate::drift::report::Report;
use crate::drift::trend::FIT_H;
use crate::error::Error;
use crate::provenance::{TOOL, command_line, origin};
use crate::written::Written;

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
    #[arg(long, value_name = "ARCSEC", conflicts_with = "document")]
    increment_weight: Option<f64>,
    /// Calibration document (TOML) that corrects the log first; --out adds drift parameters to it; several units: a folder with UNIT.toml of each
    #[arg(long = "calibration", short = 'c', alias = "document", short_alias = 'd', value_name = "FILE")]
    document: Option<PathBuf>,
    /// Sigma of the constant part at start (°/h), if known from several starts
    #[arg(long, value_name = "DEG_PER_H")]
    initial_sigma: Option<f64>,
    /// Spacing of the averaging times
    #[arg(long, value_enum, default_value_t = Taus::Octave)]
    taus: Taus,
    /// Length of the trend fit before extrapolation (h)
    #[arg(long, value_name = "HOURS", default_value_t = FIT_H)]
    fit_hours: f64,
    #[command(flatten)]
    output: OutputArgs,
}

/// Distance of averaging times.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Taus {
    /// 1, 2, 4, 8… ticks
    Octave,
    /// 1, 10, 100… ticks
    Decade,
}

impl DriftArgs {
    /// Does what the command says.
    pub(super) fn run(&self) -> Result<(), Error> {
        self.check()?;
        let title = "Noise and drift of several units";
        let batch = Batch { output: &self.output, title, accept_partial: false };
        batch.carry_out(self.units()?, |work, names, bar| self.report(work, names, bar))
    }

    /// The units of the logs; corrected ticks are read where they are analysed.
    fn units(&self) -> Result<Vec<Unit>, Error> {
        if self.is_corrected() {
            let unit = self.log.reading.serial()?.map_or_else(unnamed, Ok)?;
            let work = Work::new(None, Vec::new(), Vec::new());
            return Ok(vec![(unit, Ok(work))]);
        }
        let named = Named::together(&self.log.reading, &self.log.log, self.document.as_ref());
        Named { unnamed: Some(unnamed()?), ..named }.units()
    }

    fn is_corrected(&self) -> bool {
        self.corrected || self.log.log.iter().any(|path| is_csv(path))
    }

    /// Analyses a unit and writes what comes of it.
    fn report(&self, work: &Work, names: &Names<'_>, bar: fn() -> Bar) -> Result<Report, Error> {
        let columns = self.columns(work, names, bar)?;
        let (unit, kind, corrected) = (columns.unit.to_string(), columns.kind, columns.corrected);
        let mut grid = Grid::of(columns)?;
        grid.notes.extend(work.told());
        let working = names.at_work("Allan deviations, drift, spectrum");
        let factor = if self.taus == Taus::Decade { 10 } else { 2 };
        let sensors = analyse(&grid, Wanted { factor, fit_h: self.fit_hours });
        working.finish();
        let mut parameters = Vec::new();
        for sensor in sensors.iter().filter(|_| kind == Kind::Rate) {
            match Parameters::of(sensor, self.initial_sigma) {
                Ok(found) => parameters.push((sensor.name.clone(), found)),
                Err(why) => grid.refused.push(why),
            }
        }
        let report = Report {
            unit,
            kind,
            corrected,
            tick_s: grid.tick_s,
            ticks: grid.ticks,
            length_h: grid.length_h(),
            notes: grid.notes,
            refused: grid.refused,
            sensors,
            parameters,
        };
        // Where every gyro is refused there is nothing new to say.
        let stated = !report.parameters.is_empty();
        let document = || stated.then(|| self.document(work, &report)).transpose();
        self.output.write(document, || page(&report), names)?;
        Ok(report)
    }

    /// What the arguments must hold before anything is read.
    fn check(&self) -> Result<(), Error> {
        let positive = [
            ("--increment-weight", self.increment_weight.map(f64::abs)),
            ("--initial-sigma", self.initial_sigma),
            ("--fit-hours", Some(self.fit_hours)),
        ];
        positive
            .into_iter()
            .try_for_each(|(name, value)| value.map_or(Ok(()), |value| above_0(name, value)))?;
        if self.output.writes() && (self.document.is_none() || self.accelerometers) {
            return Err(Error::Usage(
                "--out writes drift parameters of gyros into a document: add --calibration, and remove \
                 --accelerometers"
                    .to_owned(),
            ));
        }
        let inputs: Vec<&Path> = self.log.log.iter().chain(&self.document).map(PathBuf::as_path).collect();
        self.output.check(&inputs)
    }

    fn columns(&self, work: &Work, names: &Names<'_>, bar: fn() -> Bar) -> Result<Columns, Error> {
        let kind = if self.accelerometers { Kind::Force } else { Kind::Rate };
        if self.is_corrected() {
            let unit = self.log.reading.serial()?;
            let mut bar = names.at_work("reading");
            let columns = Columns::of_corrected(&self.log.log, unit.as_ref(), kind, &work.cut, || bar.step());
            bar.finish();
            return columns;
        }
        let run = work.run()?;
        if let Some(document) = &work.base {
            return Columns::corrected_by(run, &document.loaded, kind, [bar(), bar()]);
        }
        let series = run.series(bar())?;
        if self.accelerometers {
            Columns::of_accelerometers(series)
        } else {
            Columns::of_gyros(series, self.increment_weight)
        }
    }

    /// The unit's document with the parameters in it.
    fn document(&self, work: &Work, report: &Report) -> Result<Written, Error> {
        let Some(base) = &work.base else {
            return Err(Error::Usage("--out needs --calibration".to_owned()));
        };
        let mut document = base.document.clone();
        // What the document says of the constant part holds, unless something else was stated.
        put(&mut document, &report.parameters, self.initial_sigma.is_none())?;
        self.output.put_date(&mut document)?;
        let of_log = origin(&work.logs(), &command_line())?;
        let mut whole = document.origin.take().unwrap_or_default();
        let mut details = whole.details.take().unwrap_or_default();
        let notes: Vec<String> = report
            .parameters
            .iter()
            .flat_map(|(name, found)| found.notes.iter().map(move |note| format!("gyro {name}: {note}")))
            .collect();
        let about = json!({
            "tool": TOOL,
            "command": of_log.command,
            "method": "restricted maximum likelihood of a first-order Markov drift; N from the overlapping Allan variance",
            "length_h": report.length_h,
            "verdict": report.verdict(),
            "notes": notes,
            "log": of_log.log,
        });
        let about = toml::Value::try_from(about).map_err(|error| Error::Document(vec![error.to_string()]))?;
        details.insert("drift".to_owned(), about);
        whole.details = Some(details);
        document.origin = Some(whole);
        Written::of(&document)
    }
}
