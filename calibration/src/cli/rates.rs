//! `isotherm-calibrate rates`.

use std::path::PathBuf;

use clap::Args;
use isotherm_protocol::document::{Document, GyroOutput};

use super::driver::Job;
use super::output::FitArgs;
use super::place::PlaceArgs;
use crate::axes::AXES;
use crate::document::{About, Fitted};
use crate::error::Error;
use crate::fits::rates::document::{details, sigmas};
use crate::fits::rates::fit::{Wanted, make};
use crate::fits::rates::steps::{Step, listed, read};
use crate::fits::thermal::bare::nominal;
use crate::limits::within;
use crate::numbers::{median_if_any, norm};
use crate::runs::Run;
use crate::runs::series::Ticks;
use crate::runs::table::is_one_g;

/// Scale factor, asymmetry, linearity, input axes and bias of gyros from runs on a rate table
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    isotherm-calibrate rates x.mcap y.mcap z.mcap --axis x --axis y --axis z --rates 10,-10,50,-50,100,-100 \
    --calibration unit.toml --latitude 55.75 --heading 30 --pitch 0 --roll 0 --out unit-rates.toml\n  \
    isotherm-calibrate rates table.mcap --steps table.csv --calibration unit.toml --remove-mean\n\n\
    Plateaus of steady rate and the rests between them are found in the log, in the order of --rates. --steps is a CSV with the columns log, axis, rate_deg_per_s, begin_s, end_s (log and times optional), or TOML with [[step]] tables of these keys; judging logs are numbered after the others, for each unit separately. Latitude and attitude are those of the beginning of each log.")]
pub(super) struct RatesArgs {
    #[command(flatten)]
    common: FitArgs,
    /// Axis of the table in case axes (x, -y, … or 0,0.6,0.8); once for each log, then for each judging log
    #[arg(long, value_name = "AXIS", allow_hyphen_values = true, requires = "rates")]
    axis: Vec<String>,
    /// Rates of the table in their order (°/s), with commas
    #[arg(long, value_name = "RATES", value_delimiter = ',', allow_hyphen_values = true, requires = "axis")]
    rates: Vec<f64>,
    /// Rates of the table in the judging logs (°/s), with commas (default: --rates)
    #[arg(
        long,
        value_name = "RATES",
        value_delimiter = ',',
        allow_hyphen_values = true,
        requires_all = ["rates", "judge"]
    )]
    judge_rates: Vec<f64>,
    /// Table of the steps (CSV or TOML)
    #[arg(long, value_name = "FILE", conflicts_with_all = ["axis", "rates", "judge_rates"])]
    steps: Option<PathBuf>,
    #[command(flatten)]
    place: PlaceArgs,
    /// Standard deviation of the table's rates (ppm)
    #[arg(long, hide_short_help = true, value_name = "PPM", default_value_t = 0.0, value_parser = within(0.0, 1e6))]
    table_ppm: f64,
    /// Add the remaining bias to the document's static bias
    #[arg(long, hide_short_help = true)]
    with_bias: bool,
}

impl RatesArgs {
    pub(super) fn run(&self) -> Result<(), Error> {
        self.common.run("Rate table, several units", self.steps.as_deref(), |job| self.fit(job))
    }

    fn fit(&self, job: &Job<'_>) -> Result<Fitted, Error> {
        let work = job.work;
        let place = &self.place.places([work.runs.len(), work.judges.len()])?;
        let nominal;
        let base = match (&work.base, work.runs.first()) {
            (Some(base), _) => &base.document,
            (None, Some(first)) => {
                nominal = without_document(first)?;
                &nominal
            }
            (None, None) => return Err(Error::Usage("no log is given".to_owned())),
        };
        let steps = self.stated(work.runs.len(), work.judges.len())?;
        let wanted = Wanted {
            runs: &work.runs,
            judge: &work.judges,
            steps: &steps,
            scale_known: work.base.is_some() || base.gyro.output == GyroOutput::Mean,
            base,
            place,
            table_ppm: self.table_ppm,
            with_bias: self.with_bias,
        };
        let made = make(&wanted)?;
        let about = About {
            method: "rate table, weighted least squares",
            key: "rates",
            details: details(&made),
            sigmas: sigmas(&made),
            range_deg_c: made.range_deg_c(),
            ..About::default()
        };
        Ok(Fitted { report: made.report(), written: made.written, about })
    }

    /// The steps of the logs and, behind them, of the judging logs.
    fn stated(&self, runs: usize, judges: usize) -> Result<Vec<Step>, Error> {
        match &self.steps {
            Some(path) => read(path, runs + judges),
            None if self.rates.is_empty() => Err(Error::Usage(
                "the steps of the table are missing: give --axis and --rates, or --steps FILE".to_owned(),
            )),
            None => {
                let judging = if self.judge_rates.is_empty() { &self.rates } else { &self.judge_rates };
                listed(&self.axis, [&self.rates, judging], [runs, judges])
            }
        }
    }
}

/// A nominal document for a log of three gyros.
fn without_document(run: &Run) -> Result<Document, Error> {
    let mut series = run.series()?;
    let gyros = series.gyros.readings.len();
    if gyros != AXES.len() {
        return Err(Error::Usage(format!(
            "{} has {gyros} gyros: only three of them have nominal axes. Give --calibration",
            run.name
        )));
    }
    // At one temperature nothing tells °C from volts, and a table does not turn so fast that its accelerometers feel much beside gravity.
    if !run.thermometers_read_deg_c() {
        series.temperatures.clear();
    }
    let force: Vec<f64> =
        series.accels.readings.iter().filter_map(|readings| median_if_any(readings)).collect();
    if !<[f64; 3]>::try_from(force).is_ok_and(|force| is_one_g(norm(force))) {
        series.accels = Ticks::default();
    }
    Ok(nominal(&series))
}
