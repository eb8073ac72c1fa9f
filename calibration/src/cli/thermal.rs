//! `isotherm-calibrate thermal`.

mod stands;

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use isotherm_correction::units::Span;

use super::batch::{Batch, Named, Names, Work};
use super::output::OutputArgs;
use super::runs::{LogArgs, Reading};
use crate::error::Error;
use crate::provenance::{command_line, origin};
use crate::report::FitReport;
use crate::thermal::{Fitted, Method, Settings, Terms, fit};
pub(super) use stands::StandArgs;

/// Bias and scale factor over temperature from chamber runs of units at rest or on a rate table
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    isotherm-calibrate thermal train.mcap --judge other.mcap --calibration unit.toml --out unit-new.toml --html unit.html\n  \
    isotherm-calibrate thermal train.mcap --latitude 55.75 --heading 30 --calibration unit.toml --out unit-new.toml\n  \
    isotherm-calibrate thermal chamber.tsv --mapping config/mappings/chamber-mems.toml --unit CHAMBER-MEMS \\\n      \
    --duration 3130 --judge chamber.tsv --judge-start 3130 --out chamber-mems.toml\n  \
    isotherm-calibrate thermal up.mcap down.mcap --calibration unit.toml --latitude 55.75 --heading 30 --pitch 0 --roll 0 --roll 180 \\\n      \
    --out unit-new.toml\n  \
    isotherm-calibrate thermal still.mcap turned.mcap --calibration unit.toml --latitude 55.75 --heading 30 --pitch 0 --roll 0 \\\n      \
    --axis z --rate 0 --rate 20 --out unit-new.toml\n\n\
    A refused sensor keeps the terms that it had; the others are written, and the command ends with 1 unless --accept-partial.")]
pub(super) struct ThermalArgs {
    #[command(flatten)]
    log: LogArgs,
    /// Method of the fit
    #[arg(long, value_enum, default_value_t = MethodArg::Joint)]
    method: MethodArg,
    /// Choice of terms: cross-validation, or the largest model
    #[arg(long, value_enum, default_value_t = TermsArg::Auto)]
    terms: TermsArg,
    /// Log to judge by, out of sample; repeatable
    #[arg(long, value_name = "LOG")]
    judge: Vec<PathBuf>,
    /// Start this long after each judging log's beginning (s)
    #[arg(long, value_name = "SECONDS", requires = "judge")]
    judge_start: Option<f64>,
    /// Length to take of each judging log (s) (default: all)
    #[arg(long, value_name = "SECONDS", requires = "judge")]
    judge_duration: Option<f64>,
    /// Calibration document (TOML) to start from and complete; several units: a folder with UNIT.toml of each
    #[arg(long = "calibration", short = 'c', alias = "document", short_alias = 'd', value_name = "FILE")]
    document: Option<PathBuf>,
    /// Exit code 0 although a sensor was refused
    #[arg(long)]
    accept_partial: bool,
    #[command(flatten)]
    output: OutputArgs,
    #[command(flatten)]
    stands: StandArgs,
    /// Length of the windows of the fit (s)
    #[arg(long, value_name = "SECONDS", default_value_t = 10.0)]
    fit_window: f64,
    /// Windows of the stated residuals (s) (default: those of the fit, up to ten of them in runs of hours)
    #[arg(long, value_name = "SECONDS")]
    window: Option<f64>,
    /// Smoothing of the temperature (s) (default: by cross-validation)
    #[arg(long, value_name = "SECONDS")]
    smoothing: Option<f64>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum MethodArg {
    /// Plateaus, then rate, then acceleration of temperature (paper 000)
    Sequential,
    /// Plateaus, then the rate alone
    Rate,
    /// All terms at once, shrunk by cross-validation
    #[value(alias = "lag")]
    Joint,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum TermsArg {
    /// Cross-validation across thermal branches
    Auto,
    /// The largest model
    All,
}

impl ThermalArgs {
    /// Does what the command says.
    pub(super) fn run(&self) -> Result<(), Error> {
        let settings = self.settings()?;
        self.check()?;
        let judging = Reading {
            start: self.judge_start.map_or(Span::ZERO, Span::from_s),
            duration: self.judge_duration.map(Span::from_s),
            end: None,
            ..self.log.reading.clone()
        };
        let named = Named {
            judging: &judging,
            ..Named::apart(&self.log.reading, &self.log.log, &self.judge, self.document.as_ref())
        };
        let title = "Thermal calibration of several units";
        let batch = Batch { output: &self.output, title, accept_partial: self.accept_partial };
        batch.carry_out(named.units()?, |work, names, _| self.fit(work, names, &settings))
    }

    /// Fits a unit and writes what comes of it.
    fn fit(&self, work: &Work, names: &Names<'_>, settings: &Settings) -> Result<FitReport, Error> {
        let stands = self.stands.stands(work.runs.len(), work.judges.len())?;
        let settings = Settings { stands, ..settings.clone() };
        let origin = origin(&work.logs(), &command_line())?;
        let base = work.base.as_ref().map(|base| &base.document);
        let bar = names.at_work("fitting");
        let Fitted { written, report, any_accepted } =
            fit(base, (&work.runs, &work.judges), &settings, origin, bar)?;
        self.output.put(any_accepted, |_| Ok(written), report, work, names)
    }

    /// What the arguments must hold before anything is read.
    fn check(&self) -> Result<(), Error> {
        let inputs: Vec<&Path> =
            self.log.log.iter().chain(&self.judge).chain(&self.document).map(PathBuf::as_path).collect();
        self.output.check(&inputs)?;
        self.each_once()
    }

    /// A log counts once, and judges nothing that was fitted to it.
    fn each_once(&self) -> Result<(), Error> {
        let same = |a: &Path, b: &Path| match (a.canonicalize(), b.canonicalize()) {
            (Ok(a), Ok(b)) => a == b,
            _ => a == b,
        };
        let logs = &self.log.log;
        let again =
            logs.iter().enumerate().find(|(at, log)| logs.iter().take(*at).any(|other| same(log, other)));
        if let Some((_, log)) = again {
            return Err(Error::Usage(format!(
                "{} is given twice: cross-validation needs each log once",
                log.display()
            )));
        }
        let part = |start: f64, length: Option<f64>| [start, length.map_or(f64::INFINITY, |l| start + l)];
        let fitted = part(self.log.reading.start.as_s(), self.log.reading.duration.map(Span::as_s));
        let judged = part(self.judge_start.unwrap_or(0.0), self.judge_duration);
        if fitted[0] >= judged[1] || judged[0] >= fitted[1] {
            return Ok(());
        }
        match self.judge.iter().find(|judge| logs.iter().any(|log| same(log, judge))) {
            None => Ok(()),
            Some(judge) => Err(Error::Usage(format!(
                "--judge {}: the document is fitted to the same part of it: give another log, or another part \
                 (--duration, --judge-start)",
                judge.display()
            ))),
        }
    }

    fn settings(&self) -> Result<Settings, Error> {
        let lengths = [
            ("--fit-window", Some(self.fit_window), 1.0, 600.0),
            ("--window", self.window, 1.0, 3600.0),
            ("--smoothing", self.smoothing, 0.0, 3600.0),
            ("--judge-start", self.judge_start, 0.0, 1e9),
            ("--judge-duration", self.judge_duration, 1.0, 1e9),
        ];
        for (name, value, low, high) in lengths {
            if let Some(value) = value.filter(|value| !(low..=high).contains(value)) {
                return Err(Error::Usage(format!("{name} is {value} s, must be from {low} to {high} s")));
            }
        }
        let created = Some(self.output.date()?);
        Ok(Settings {
            method: match self.method {
                MethodArg::Sequential => Method::Sequential,
                MethodArg::Rate => Method::Rate,
                MethodArg::Joint => Method::Joint,
            },
            terms: if self.terms == TermsArg::All { Terms::All } else { Terms::Auto },
            stands: Vec::new(),
            fit_window_s: self.fit_window,
            window_s: self.window,
            smoothing_s: self.smoothing,
            created,
        })
    }
}
