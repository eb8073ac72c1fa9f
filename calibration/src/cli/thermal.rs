//! `isotherm-calibrate thermal`.

mod stands;

use clap::Args;
use isotherm_cli::Window;
use isotherm_correction::units::Span;

use super::driver::{Done, Job, Task};
use super::output::FitArgs;
use super::runs::Reading;
use super::units::Logs;
use crate::error::Error;
use crate::fits::thermal::{Settings, fit};
use crate::limits::within;
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
    A refused sensor keeps its old terms; the others are written, and the exit code is 1 unless --accept-partial.")]
pub(super) struct ThermalArgs {
    #[command(flatten)]
    common: FitArgs,
    #[command(flatten)]
    settings: Settings,
    /// Start this long after each judging log's beginning (s)
    #[arg(long, value_name = "SECONDS", requires = "judge", value_parser = within(0.0, 1e9))]
    judge_start: Option<f64>,
    /// Length of each judging log to read (s) (default: all)
    #[arg(long, value_name = "SECONDS", requires = "judge", value_parser = within(1.0, 1e9))]
    judge_duration: Option<f64>,
    /// Exit code 0 although a sensor was refused
    #[arg(long)]
    accept_partial: bool,
    #[command(flatten)]
    stands: StandArgs,
}

impl ThermalArgs {
    pub(super) fn run(&self) -> Result<(), Error> {
        let judging = Reading {
            window: Window {
                start: self.judge_start.map_or(Span::ZERO, Span::from_s),
                duration: self.judge_duration.map(Span::from_s),
                end: None,
            },
            ..self.common.log.reading.clone()
        };
        let logs = Logs { judging: &judging, ..self.common.logs() };
        let task = Task {
            accept_partial: self.accept_partial,
            ..Task::new("Thermal calibration of several units", self.common.output.files(), logs)
        };
        task.run(|job| self.fit(job))
    }

    fn fit(&self, job: &Job<'_>) -> Result<Done, Error> {
        let work = job.work;
        let base = work.base.as_ref().map(|base| &base.document);
        let stands = self.stands.stands(work.runs.len(), work.judges.len())?;
        let settings = Settings { stands, ..self.settings.clone() };
        let fitted = fit(base, (&work.runs, &work.judges), &settings)?;
        self.common.output.done(fitted, job)
    }
}
