//! `isotherm-calibrate thermal`.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use isotherm_correction::units::Span;
use isotherm_protocol::key::UnitId;

use super::bar::Bar;
use super::output::{check_outputs, date};
use super::print;
use super::runs::{LogArgs, Reading};
use crate::error::Error;
use crate::provenance::{command_line, origin};
use crate::report::{BatchTable, in_parallel, of_unit};
use crate::run::Run;
use crate::thermal::{Fitted, Method, Settings, Site, Terms, fit};
use crate::written::{Written, write_file};

/// Bias over temperature from chamber runs of units at rest
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    isotherm-calibrate thermal train.mcap --judge other.mcap --document unit.toml --out unit-new.toml --html unit.html\n  \
    isotherm-calibrate thermal train.mcap --method lag --latitude 55.75 --heading 30 --document unit.toml --out unit-new.toml\n  \
    isotherm-calibrate thermal chamber.tsv --mapping config/mappings/chamber-mems.toml --unit CHAMBER-MEMS --method lag \\\n      \
    --duration 3130 --judge chamber.tsv --judge-start 3130 --out chamber-mems.toml\n\n\
    A refused sensor keeps the terms that it had; the others are written, and the command ends with 1 unless --accept-partial.")]
#[expect(clippy::struct_excessive_bools, reason = "switches of a command line")]
pub(super) struct ThermalArgs {
    #[command(flatten)]
    log: LogArgs,
    /// How the coefficients are found
    #[arg(long, value_enum, default_value_t = MethodArg::Joint)]
    method: MethodArg,
    /// Who chooses the terms: cross-validation, or nobody (the largest model of the method)
    #[arg(long, value_enum, default_value_t = TermsArg::Auto)]
    terms: TermsArg,
    /// Run to judge the document on, which it is not fitted to; may be repeated
    #[arg(long, value_name = "LOG")]
    judge: Vec<PathBuf>,
    /// Leave out this much of each judging log's beginning (s)
    #[arg(long, value_name = "SECONDS", requires = "judge")]
    judge_start: Option<f64>,
    /// Take this much of each judging log (s); without it, all
    #[arg(long, value_name = "SECONDS", requires = "judge")]
    judge_duration: Option<f64>,
    /// Document that the fit starts from and completes; for several units the folder that has UNIT.toml of each
    #[arg(long, short, value_name = "BASE")]
    document: Option<PathBuf>,
    /// Write the new document; of several units each to NEW-UNIT.toml
    #[arg(long, short, value_name = "NEW")]
    out: Option<PathBuf>,
    /// Write over files that are there
    #[arg(long)]
    overwrite: bool,
    /// End with 0 although a sensor was refused
    #[arg(long)]
    accept_partial: bool,
    /// Date that the document states (YYYY-MM-DD); that of the base document without it
    #[arg(long, value_name = "DATE")]
    created: Option<String>,
    /// Write the report with its diagrams as one HTML file; of several units each to FILE-UNIT.html
    #[arg(long, value_name = "FILE")]
    html: Option<PathBuf>,
    /// Print everything as one JSON object
    #[arg(long)]
    json: bool,
    /// Geodetic latitude (°, north positive): the Earth's rate is removed from the gyros
    #[arg(long, value_name = "DEG", requires = "heading", allow_negative_numbers = true)]
    latitude: Option<f64>,
    /// Heading of the case's x axis from north towards east (°)
    #[arg(long, value_name = "DEG", requires = "latitude", allow_negative_numbers = true)]
    heading: Option<f64>,
    /// Roll about the case's x axis (°); without it and --pitch the unit is levelled from its accelerometers
    #[arg(long, value_name = "DEG", requires_all = ["pitch", "latitude"], allow_negative_numbers = true)]
    roll: Option<f64>,
    /// Pitch of the case's x axis above the horizon (°)
    #[arg(long, value_name = "DEG", requires_all = ["roll", "latitude"], allow_negative_numbers = true)]
    pitch: Option<f64>,
    /// Take the mean of each run off, as it is done without --latitude
    #[arg(long, conflicts_with = "latitude")]
    remove_mean: bool,
    /// Windows of the fit (s)
    #[arg(long, value_name = "SECONDS", default_value_t = 10.0)]
    fit_window: f64,
    /// Windows over which residuals are stated (s); those of the fit without it
    #[arg(long, value_name = "SECONDS")]
    window: Option<f64>,
    /// Smoothing of the temperature (s); searched without it
    #[arg(long, value_name = "SECONDS")]
    smoothing: Option<f64>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum MethodArg {
    /// Plateaus first, then rate, then acceleration of the temperature (the paper's)
    Sequential,
    /// All terms at once, with lags on a fixed ladder
    Joint,
    /// Lags whose time constants are searched
    Lag,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum TermsArg {
    /// Cross-validation across thermal branches
    Auto,
    /// The largest model
    All,
}

/// One unit's work.
struct Work {
    unit: UnitId,
    base: Option<Written>,
    runs: Vec<Run>,
    judges: Vec<Run>,
}

impl ThermalArgs {
    /// Does what the command says.
    pub(super) fn run(&self) -> Result<(), Error> {
        let settings = self.settings()?;
        self.check()?;
        let work = self.work()?;
        let origin = origin(&self.log.log, &command_line())?;
        if let [only] = work.as_slice() {
            let runs = (only.runs.as_slice(), only.judges.as_slice());
            let base = only.base.as_ref().map(|base| &base.document);
            let fitted = fit(base, runs, &settings, origin, Bar::at_work("fitting"))?;
            self.give_out(&fitted, Path::to_path_buf)?;
            let report = &fitted.report;
            if self.json {
                print(format!("{}\n", report.to_json()).as_bytes())?;
            } else {
                print(report.to_text().as_bytes())?;
            }
            let refusals = report.refusals();
            return if refusals.is_empty() || self.accept_partial {
                Ok(())
            } else {
                Err(Error::Refused(refusals))
            };
        }
        self.batch(&work, &settings, &origin)
    }

    fn batch(
        &self,
        work: &[Work],
        settings: &Settings,
        origin: &isotherm_protocol::document::Origin,
    ) -> Result<(), Error> {
        let bar = Bar::at_work("fitting units");
        let made = in_parallel(
            work,
            |_| (),
            |one| {
                let runs = (one.runs.as_slice(), one.judges.as_slice());
                let fitted =
                    fit(one.base.as_ref().map(|base| &base.document), runs, settings, origin.clone(), ())?;
                self.give_out(&fitted, |path| of_unit(path, one.unit.as_str()))?;
                Ok::<_, Error>(fitted)
            },
        );
        bar.finish();
        let mut table = BatchTable::default();
        let (mut refusals, mut reports) = (Vec::new(), Vec::new());
        for (one, made) in work.iter().zip(made) {
            match made {
                Ok(fitted) => {
                    table.add(one.unit.as_str(), Ok(fitted.report.verdicts.clone()));
                    refusals.extend(fitted.report.refusals());
                    reports.push(fitted.report.to_json());
                }
                Err(error) => {
                    table.add(one.unit.as_str(), Err(error.to_string()));
                    refusals.push(format!("{}: {error}", one.unit));
                }
            }
        }
        if self.json {
            let whole = serde_json::json!({ "batch": table.to_json(), "units": reports });
            print(format!("{whole}\n").as_bytes())?;
        } else {
            print(table.to_text().as_bytes())?;
        }
        if refusals.is_empty() || self.accept_partial { Ok(()) } else { Err(Error::Refused(refusals)) }
    }

    fn give_out(&self, fitted: &Fitted, name: impl Fn(&Path) -> PathBuf) -> Result<(), Error> {
        if let Some(out) = &self.out {
            fitted.written.save(&name(out), self.overwrite)?;
        }
        if let Some(html) = &self.html {
            write_file(&name(html), fitted.report.to_html().as_bytes(), true)?;
        }
        Ok(())
    }

    /// The units with their documents and runs.
    fn work(&self) -> Result<Vec<Work>, Error> {
        let folder = self.document.as_ref().filter(|path| path.is_dir());
        let single = self
            .document
            .as_ref()
            .filter(|path| !path.is_dir())
            .map(|path| Written::read(path))
            .transpose()?;
        let fallback = single.as_ref().map(|written| written.loaded.unit.clone());
        let units = self.log.reading.runs(&self.log.log, fallback.as_ref())?;
        let judging = Reading {
            start: self.judge_start.map_or(Span::ZERO, Span::from_s),
            duration: self.judge_duration.map(Span::from_s),
            ..self.log.reading.clone()
        };
        let mut judges = if self.judge.is_empty() {
            BTreeMap::default()
        } else {
            judging.runs(&self.judge, fallback.as_ref())?
        };
        let several = units.len() > 1;
        let mut work = Vec::new();
        for (unit, runs) in units {
            let base = match (&single, folder) {
                (Some(single), _) if several && single.loaded.unit != unit => {
                    return Err(Error::Refused(vec![format!(
                        "the log is of several units ({unit} among them), the document is of {}: choose that one with --unit, or give \
                         --document the folder that has UNIT.toml of each",
                        single.loaded.unit
                    )]));
                }
                (Some(single), _) => Some(single.clone()),
                (None, Some(folder)) => Some(Written::read(&folder.join(format!("{unit}.toml")))?),
                (None, None) => None,
            };
            let judges = judges.remove(&unit).unwrap_or_default();
            if judges.is_empty() && !self.judge.is_empty() {
                return Err(Error::Refused(vec![format!("--judge: the logs have nothing of unit {unit}")]));
            }
            work.push(Work { unit, base, runs, judges });
        }
        Ok(work)
    }

    /// What the arguments must hold before anything is read.
    fn check(&self) -> Result<(), Error> {
        let inputs: Vec<&Path> =
            self.log.log.iter().chain(&self.judge).chain(&self.document).map(PathBuf::as_path).collect();
        check_outputs(self.out.as_deref(), self.html.as_deref(), &inputs, self.overwrite)
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
        let created = self.created.as_deref().map(date).transpose()?;
        Ok(Settings {
            method: match self.method {
                MethodArg::Sequential => Method::Sequential,
                MethodArg::Joint => Method::Joint,
                MethodArg::Lag => Method::Lag,
            },
            terms: if self.terms == TermsArg::All { Terms::All } else { Terms::Auto },
            site: self.site()?,
            fit_window_s: self.fit_window,
            window_s: self.window,
            smoothing_s: self.smoothing,
            created,
        })
    }

    fn site(&self) -> Result<Site, Error> {
        let (Some(latitude), Some(heading)) = (self.latitude, self.heading) else { return Ok(Site::Unknown) };
        let tilt = self.pitch.zip(self.roll).map(|(pitch, roll)| [pitch, roll]);
        Site::at(latitude, heading, tilt).map_err(|errors| {
            Error::Usage(errors.iter().map(ToString::to_string).collect::<Vec<_>>().join("; "))
        })
    }
}
