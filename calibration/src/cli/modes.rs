//! `isotherm-calibrate modes`.

use clap::Args;
use isotherm_correction::earth::Place;

use super::driver::Job;
use super::output::FitArgs;
use super::place::PlaceArgs;
use crate::document::{About, Fitted};
use crate::error::Error;
use crate::fits::modes::document::{details, sigmas};
use crate::fits::modes::fit::{Wanted, make};
use crate::fits::modes::model::Asked;
use crate::numbers::hull;

/// Magnetic and non-magnetic drift over temperature, slow meander and switch parameters of a mode-reversed laser gyro
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    isotherm-calibrate modes chamber.mcap --calibration unit.toml --latitude 55.75 --heading 30 --out unit-modes.toml\n  \
    isotherm-calibrate modes up.mcap down.mcap --judge other.mcap --calibration unit.toml --latitude 55.75 --heading 30 \
    --html modes.html\n\n\
    The runs are at rest, with mode reversal, over the temperatures of use. The document gives scale, axes, temperature channels and filter; its static, magnetic and slow-meander terms are replaced, and transition ticks and servo if the runs show them.")]
pub(super) struct ModesArgs {
    #[command(flatten)]
    common: FitArgs,
    #[command(flatten)]
    place: PlaceArgs,
    #[command(flatten)]
    asked: Asked,
}

const NO_DOCUMENT: &str = "a mode-reversed gyro counts, and a log does not state its increment weight: give \
                           --calibration with increment weights, input axes, temperature channels and filter";

impl ModesArgs {
    pub(super) fn run(&self) -> Result<(), Error> {
        if self.common.base.document.is_none() {
            return Err(Error::Usage(NO_DOCUMENT.to_owned()));
        }
        let place = self.place.place()?;
        self.common.run("Mode-reversed gyros of several units", None, |job| self.fit(job, place))
    }

    fn fit(&self, job: &Job<'_>, place: Option<Place>) -> Result<Fitted, Error> {
        let work = job.work;
        let base = work.base()?;
        let made = make(&Wanted {
            runs: &work.runs,
            judge: &work.judges,
            base: &base.document,
            place,
            asked: self.asked,
        })?;
        let ranges = made.gyros.iter().flatten().map(|fit| fit.range_deg_c);
        let about = About {
            method: "polynomials of the lasing modes by generalised least squares",
            key: "modes",
            details: details(&made),
            sigmas: sigmas(&made),
            range_deg_c: hull(ranges),
            ..About::default()
        };
        Ok(Fitted { report: made.report(), written: made.written, about })
    }
}
