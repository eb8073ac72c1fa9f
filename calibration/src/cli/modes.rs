//! `isotherm-calibrate modes`.

use std::path::{Path, PathBuf};

use clap::Args;
use isotherm_cli::Bar;
use isotherm_correction::earth::Place;
use isotherm_correction::reversal::MAX_TRANSITION_TICKS;

use super::batch::{Batch, Named, Work};
use super::output::{About, Fitted, OutputArgs};
use super::place::PlaceArgs;
use super::runs::LogArgs;
use crate::error::Error;
use crate::modes::document::{details, sigmas};
use crate::modes::fit::Asked;
use crate::modes::make::{Wanted, make};

/// Magnetic and non-magnetic drift over temperature, slow meander and switch parameters of a mode-reversed laser gyro
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    isotherm-calibrate modes chamber.mcap --calibration unit.toml --latitude 55.75 --heading 30 --out unit-modes.toml\n  \
    isotherm-calibrate modes up.mcap down.mcap --judge other.mcap --calibration unit.toml --latitude 55.75 --heading 30 \
    --html modes.html\n\n\
    The runs are at rest, with mode reversal, over the temperatures of use. The document gives scale, axes, temperature channels and filter; its static, magnetic and slow-meander terms are replaced, and transition ticks and servo if the runs show them.")]
pub(super) struct ModesArgs {
    #[command(flatten)]
    log: LogArgs,
    /// Log to judge by, out of sample; repeatable
    #[arg(long, value_name = "LOG")]
    judge: Vec<PathBuf>,
    /// Calibration document (TOML) to start from; several units: a folder with UNIT.toml of each
    #[arg(long = "calibration", short = 'c', alias = "document", short_alias = 'd', value_name = "FILE")]
    document: Option<PathBuf>,
    #[command(flatten)]
    place: PlaceArgs,
    /// Order of the static polynomial, 0…3 (default: by cross-validation)
    #[arg(long, value_name = "ORDER", value_parser = clap::value_parser!(u8).range(0..=3))]
    static_order: Option<u8>,
    /// Order of the magnetic polynomial, 0…3 (default: by cross-validation)
    #[arg(long, value_name = "ORDER", value_parser = clap::value_parser!(u8).range(0..=3))]
    magnetic_order: Option<u8>,
    /// Order of the slow meander, 0 or 1 (default: by cross-validation)
    #[arg(long, value_name = "ORDER", value_parser = clap::value_parser!(u8).range(0..=1))]
    meander_order: Option<u8>,
    /// Ticks lost by a switch, 1…32 (default: found in the log)
    #[arg(long, value_name = "TICKS", value_parser = clap::value_parser!(u8).range(1..=i64::from(MAX_TRANSITION_TICKS)))]
    transition_ticks: Option<u8>,
    /// Time to leave out after every switch (s) (default: the servo's transient)
    #[arg(long, value_name = "SECONDS")]
    settle: Option<f64>,
    /// Reference temperature of the polynomials (°C) (default: the document's, else 20)
    #[arg(long, value_name = "DEG_C", allow_negative_numbers = true)]
    reference: Option<f64>,
    #[command(flatten)]
    output: OutputArgs,
}

const NO_DOCUMENT: &str = "a mode-reversed gyro counts, and a log does not state its increment weight: give \
                           --calibration with increment weights, input axes, temperature channels and filter";

impl ModesArgs {
    /// Does what the command says.
    pub(super) fn run(&self) -> Result<(), Error> {
        let inputs = self.log.log.iter().chain(&self.judge).chain(&self.document);
        self.output.check(&inputs.map(PathBuf::as_path).collect::<Vec<&Path>>())?;
        if let Some(settle) = self.settle.filter(|settle| !(0.0..=3600.0).contains(settle)) {
            return Err(Error::Usage(format!("--settle is {settle}, must be from 0 to 3600 s")));
        }
        let Some(document) = &self.document else {
            return Err(Error::Usage(NO_DOCUMENT.to_owned()));
        };
        let place = self.place.place()?;
        let named = Named::apart(&self.log.reading, &self.log.log, &self.judge, Some(document));
        let title = "Mode-reversed gyros of several units";
        let batch = Batch { output: &self.output, title, accept_partial: false };
        batch.carry_out(named.units()?, |work, names, bar| {
            self.output.keep(self.fit(work, place, bar)?, work, names)
        })
    }

    fn fit(&self, work: &Work, place: Option<Place>, bar: fn() -> Bar) -> Result<Fitted, Error> {
        let Some(base) = &work.base else { return Err(Error::Usage(NO_DOCUMENT.to_owned())) };
        let order = |order: Option<u8>| order.map(usize::from);
        let made = make(
            &Wanted {
                runs: &work.runs,
                judge: &work.judges,
                base: &base.document,
                place,
                asked: Asked {
                    static_order: order(self.static_order),
                    magnetic_order: order(self.magnetic_order),
                    meander_order: order(self.meander_order),
                },
                transition_ticks: self.transition_ticks,
                settle_s: self.settle,
                reference_deg_c: self.reference,
            },
            bar,
        )?;
        let ranges = made.gyros.iter().flatten().map(|fit| fit.range_deg_c);
        let about = About {
            method: "polynomials of the lasing modes by generalised least squares",
            key: "modes",
            details: details(&made),
            sigmas: sigmas(&made),
            range_deg_c: ranges.reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])]),
            logs: work.logs(),
        };
        Ok(Fitted { report: made.report(), written: made.written, about })
    }
}
