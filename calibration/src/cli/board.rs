//! `isotherm-calibrate board`.

use clap::{Arg, Args};

use super::driver::Job;
use super::output::FitArgs;
use super::thermal::StandArgs;
use crate::document::{About, Fitted};
use crate::error::Error;
use crate::fits::board::{Wanted, fit};
use crate::fits::thermal::Site;
use crate::limits::within;

/// Ratio of the accelerometers' board over its temperature, from cycles of the chamber in two positions
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    isotherm-calibrate board up.mcap down.mcap --calibration unit.toml --latitude 55.75 --heading 30 --pitch 35.264 --roll -135 \\\n      \
    --pitch -35.264 --roll 45 --out unit-board.toml --html board.html\n\n\
    The accelerometers stay on their thermostat, or their temperature moves by itself. The case diagonal up and down serves all axes. \
    The document names the boards' channels.", mut_arg("document", |document: Arg| document.required(true)))]
pub(super) struct BoardArgs {
    #[command(flatten)]
    common: FitArgs,
    /// Temperature of the board at which the ratio is 1 (°C) (default: the document's, else the middle of its range)
    #[arg(long, hide_short_help = true, value_name = "DEG_C", allow_negative_numbers = true, value_parser = within(-100.0, 200.0))]
    reference: Option<f64>,
    /// Length of the windows of the fit (s)
    #[arg(long, hide_short_help = true, value_name = "SECONDS", default_value_t = 10.0, value_parser = within(1.0, 600.0))]
    fit_window: f64,
    #[command(flatten)]
    stands: StandArgs,
}

impl BoardArgs {
    pub(super) fn run(&self) -> Result<(), Error> {
        self.common.run("Boards of several units", None, |job| self.fit(job))
    }

    fn fit(&self, job: &Job<'_>) -> Result<Fitted, Error> {
        let work = job.work;
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
        let base = work.base()?;
        let wanted = Wanted {
            runs: &work.runs,
            judges: &work.judges,
            stands: &stands,
            base: &base.document,
            reference_deg_c: self.reference,
            window_s: self.fit_window,
        };
        let made = fit(&wanted)?;
        let about = About {
            method: "board ratio from cycles in two positions",
            key: "board",
            sigmas: made.sigmas(),
            range_deg_c: made.range_deg_c(),
            ..About::default()
        };
        Ok(Fitted { written: made.written, report: made.report, about })
    }
}
