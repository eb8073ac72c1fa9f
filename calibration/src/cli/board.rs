//! `isotherm-calibrate board`.

use std::path::{Path, PathBuf};

use clap::Args;
use isotherm_cli::Bar;

use super::batch::{Batch, Named, Work};
use super::output::{About, Fitted, OutputArgs};
use super::runs::LogArgs;
use super::thermal::StandArgs;
use crate::board::{Wanted, fit};
use crate::error::Error;
use crate::thermal::Site;

/// Ratio of the accelerometers' board over its temperature, from cycles of the chamber in two positions
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    isotherm-calibrate board up.mcap down.mcap --calibration unit.toml --latitude 55.75 --heading 30 --pitch 35.264 --roll -135 \\\n      \
    --pitch -35.264 --roll 45 --out unit-board.toml --html board.html\n\n\
    Keep the accelerometers on their thermostat, or vary their temperature independently. The case diagonal up and down serves all axes.")]
pub(super) struct BoardArgs {
    #[command(flatten)]
    log: LogArgs,
    /// Log to judge by, out of sample; repeatable
    #[arg(long, value_name = "LOG")]
    judge: Vec<PathBuf>,
    /// Calibration document (TOML) to complete, with the boards' channels; several units: a folder with UNIT.toml of each
    #[arg(long = "calibration", short = 'c', value_name = "FILE", required = true)]
    document: Option<PathBuf>,
    /// Temperature of the board at which the ratio is 1 (°C) (default: the middle of its range)
    #[arg(long, value_name = "DEG_C", allow_negative_numbers = true)]
    reference: Option<f64>,
    /// Length of the windows of the fit (s)
    #[arg(long, value_name = "SECONDS", default_value_t = 10.0)]
    fit_window: f64,
    #[command(flatten)]
    stands: StandArgs,
    #[command(flatten)]
    output: OutputArgs,
}

impl BoardArgs {
    /// Does what the command says.
    pub(super) fn run(&self) -> Result<(), Error> {
        if !(1.0..=600.0).contains(&self.fit_window) {
            return Err(Error::Usage(format!(
                "--fit-window is {} s, must be from 1 to 600 s",
                self.fit_window
            )));
        }
        if let Some(reference) = self.reference.filter(|t| !(-100.0..=200.0).contains(t)) {
            return Err(Error::Usage(format!("--reference is {reference} °C, must be from -100 to 200 °C")));
        }
        let inputs: Vec<&Path> =
            self.log.log.iter().chain(&self.judge).chain(&self.document).map(PathBuf::as_path).collect();
        self.output.check(&inputs)?;
        let named = Named::apart(&self.log.reading, &self.log.log, &self.judge, self.document.as_ref());
        let batch = Batch { output: &self.output, title: "Boards of several units", accept_partial: false };
        batch.carry_out(named.units()?, |work, names, _| {
            self.output.keep(self.fit(work, names.at_work("fitting"))?, work, names)
        })
    }

    fn fit(&self, work: &Work, bar: Bar) -> Result<Fitted, Error> {
        let stands = self.stands.stands(work.runs.len(), work.judges.len())?;
        let stated = |run: usize| {
            let site = stands.get(run).map(|stand| (&stand.site, stand.turning));
            matches!(site, Some((Site::Known { force_m_per_s2: Some(_), .. }, None)))
        };
        if !(0..work.runs.len()).all(stated) {
            return Err(Error::Usage(
                "the position of every log must be known, at rest: give --latitude, --heading, --pitch and --roll, once for each log"
                    .to_owned(),
            ));
        }
        let Some(base) = &work.base else {
            return Err(Error::Usage("--calibration is needed".to_owned()));
        };
        let wanted = Wanted {
            runs: &work.runs,
            judges: &work.judges,
            stands: &stands,
            base: &base.document,
            reference_deg_c: self.reference,
            window_s: self.fit_window,
        };
        let made = fit(&wanted, bar)?;
        let about = About {
            method: "board ratio from cycles in two positions",
            key: "board",
            details: made.details(),
            sigmas: made.sigmas(),
            range_deg_c: made.range_deg_c(),
            logs: work.logs(),
        };
        Ok(Fitted { written: made.written, report: made.report, about })
    }
}
