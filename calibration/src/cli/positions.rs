//! `isotherm-calibrate positions`.

mod planned;
mod steps;

use std::path::{Path, PathBuf};

use clap::Args;
use isotherm_cli::Bar;
use isotherm_protocol::document::AccelOutput;

use super::above_0;
use super::batch::{Batch, Named, Work};
use super::output::{About, Fitted, OutputArgs};
use super::place::GravityArgs;
use super::print;
use super::runs::Reading;
use crate::error::Error;
use crate::positions::analysis::{Analysis, Settings, analyse, positions};
use crate::positions::budget::ARCSEC_PER_RAD;
use crate::positions::document::{complete, range};
use crate::positions::judged::Judgement;
use crate::positions::plan::Plan;
use crate::positions::pose::Pose;
use crate::positions::provenance::{before, details, sigmas};
use crate::positions::report::{Set, report};
use crate::positions::still::StillLimits;
use crate::positions::times::Times;
use crate::runs::Run;
use crate::written::Written;
use planned::PlannedArgs;
use steps::{first_document, judged, tracks};

/// Axes, scale factors and biases of accelerometers from positions of a stand, at one temperature or several
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    isotherm-calibrate positions --budget --positioning 5 --run-out 2\n  \
    isotherm-calibrate positions cold.mcap room.mcap hot.mcap --calibration unit.toml --latitude 55.75 --out unit-positions.toml --html positions.html\n  \
    isotherm-calibrate positions stand.mcap --plan my-plan.toml --gravity 9.8154 --times held.csv\n\n\
    Still poses are found in the logs and identified by the gyros' turns between them. Any set of positions works that shows each axis up and down; nine or more separate the stand's errors from the axes.")]
pub(super) struct PositionsArgs {
    /// Recordings (.mcap), or the files of a text log in the mapping's order; one log per temperature is possible
    #[arg(value_name = "LOG", required_unless_present = "budget")]
    log: Vec<PathBuf>,
    #[command(flatten)]
    reading: Reading,
    /// Print only the error budget of a planned calibration (default: the example of 004)
    #[arg(long, conflicts_with_all = ["log", "document", "out", "judge", "html", "times"])]
    budget: bool,
    /// Positions in order: "twelve" (of 004; needs the turns in the log, or --times), "six", or a file (TOML, CSV)
    #[arg(long, value_name = "PLAN", default_value = "twelve")]
    plan: String,
    /// Times of the positions (CSV: `start_s,end_s,position[,log]`), for logs without turns (default: found in the logs)
    #[arg(long, value_name = "FILE")]
    times: Option<PathBuf>,
    /// Calibration document (TOML) to complete (default: accelerometers along the case axes); several units: a folder with UNIT.toml of each
    #[arg(long = "calibration", short = 'c', alias = "document", short_alias = 'd', value_name = "FILE")]
    document: Option<PathBuf>,
    /// Log to judge by, out of sample; repeatable
    #[arg(long, value_name = "LOG")]
    judge: Vec<PathBuf>,
    #[command(flatten)]
    gravity: GravityArgs,
    /// σ1: standard deviation of the stand's positioning (″)
    #[arg(long, value_name = "ARCSEC", default_value_t = 5.0)]
    positioning: f64,
    /// σ2: standard deviation of its axes' run-out (″)
    #[arg(long, value_name = "ARCSEC", default_value_t = 2.0)]
    run_out: f64,
    /// Level error of the stand (″, one sigma)
    #[arg(long, value_name = "ARCSEC", default_value_t = 60.0)]
    levelling: f64,
    /// Window of the search for still poses (s)
    #[arg(long, value_name = "SECONDS", default_value_t = 1.0)]
    window: f64,
    /// Largest variance of a still window, relative to the log's quietest fifth
    #[arg(long, value_name = "FACTOR", default_value_t = 4.0)]
    threshold: f64,
    /// Rate above which the unit turns (°/s)
    #[arg(long, value_name = "DEG_PER_S", default_value_t = 0.2)]
    still_rate: f64,
    /// Time to leave out at the beginning of each pose (s)
    #[arg(long, value_name = "SECONDS", default_value_t = 2.0)]
    settle: f64,
    /// Shortest pose (s)
    #[arg(long, value_name = "SECONDS", default_value_t = 10.0)]
    least: f64,
    /// Temperature channels that the axes follow by their mean (default: the document's, else the accelerometers')
    #[arg(long, value_name = "CHANNEL")]
    channel: Vec<String>,
    /// Reference temperature of the polynomials (°C)
    #[arg(long, value_name = "DEG_C", allow_hyphen_values = true)]
    reference: Option<f64>,
    /// Unit of the accelerometers' means without a document: "V" or "m/s2"
    #[arg(long, value_name = "UNIT", default_value = "V", value_parser = ["V", "m/s2"])]
    accelerometer_unit: String,
    #[command(flatten)]
    planned: PlannedArgs,
    #[command(flatten)]
    output: OutputArgs,
}

impl PositionsArgs {
    /// Does what the command says.
    pub(super) fn run(&self) -> Result<(), Error> {
        self.check()?;
        let plan = Plan::named(&self.plan)?;
        if self.budget {
            return self.print_budget(&plan);
        }
        let (settings, about_gravity) = self.settings(plan)?;
        let named = Named::apart(&self.reading, &self.log, &self.judge, self.document.as_ref());
        let batch =
            Batch { output: &self.output, title: "Accelerometers of several units", accept_partial: false };
        batch.carry_out(named.units()?, |work, names, bar| {
            self.output.keep(self.fit(work, &settings, about_gravity.as_ref(), bar)?, work, names)
        })
    }

    /// What the arguments must hold before anything is read.
    fn check(&self) -> Result<(), Error> {
        let positive = [
            ("--positioning", self.positioning),
            ("--levelling", self.levelling),
            ("--window", self.window),
            ("--threshold", self.threshold),
            ("--still-rate", self.still_rate),
            ("--least", self.least),
            ("--noise", self.planned.noise),
            ("--seconds", self.planned.seconds),
            ("--scale", self.planned.scale),
        ];
        positive.into_iter().try_for_each(|(name, value)| above_0(name, value))?;
        let planned = ("--hysteresis", self.planned.hysteresis);
        for (name, value) in [("--run-out", self.run_out), ("--settle", self.settle), planned] {
            if !(value.is_finite() && value >= 0.0) {
                return Err(Error::Usage(format!("{name} is {value}, must be a number, 0 or above")));
            }
        }
        let inputs: Vec<&Path> =
            (self.log.iter().chain(&self.judge).chain(&self.document).chain(&self.times))
                .map(PathBuf::as_path)
                .collect();
        self.output.check(&inputs)
    }

    fn print_budget(&self, plan: &Plan) -> Result<(), Error> {
        let budget = self.planned.budget(self.positioning, self.run_out);
        let levelling_rad = self.levelling / ARCSEC_PER_RAD;
        if self.output.json {
            return print(format!("{}\n", budget.to_json(plan, levelling_rad)).as_bytes());
        }
        print(budget.to_text(plan, levelling_rad).as_bytes())
    }

    fn settings(&self, plan: Plan) -> Result<(Settings, Option<String>), Error> {
        let (gravity, warning) = self.gravity.stated()?;
        let settings = Settings {
            plan,
            gravity,
            limits: StillLimits {
                window_s: self.window,
                factor: self.threshold,
                rate_deg_per_s: self.still_rate,
                least_s: self.least,
                settle_s: self.settle,
            },
            times: self.times.as_deref().map(Times::read).transpose()?,
            positioning_rad: self.positioning.hypot(self.run_out) / ARCSEC_PER_RAD,
            levelling_rad: self.levelling / ARCSEC_PER_RAD,
            channels: self.channel.clone(),
            reference_deg_c: self.reference,
        };
        Ok((settings, warning))
    }

    fn fit(
        &self,
        work: &Work,
        settings: &Settings,
        about_gravity: Option<&String>,
        bar: fn() -> Bar,
    ) -> Result<Fitted, Error> {
        let runs = &work.runs;
        let output = if self.accelerometer_unit == "V" {
            AccelOutput::Volts
        } else {
            AccelOutput::MetresPerSecondSquared
        };
        let first;
        let base = match &work.base {
            Some(base) if base.document.accel.is_some() => base,
            Some(_) => {
                return Err(Error::Refused(vec![
                    "the document has no accelerometers: add [accel] with their channels, nominal scale factors and axes".to_owned(),
                ]));
            }
            None => {
                first = Written::of(&first_document(runs, output, bar())?)?;
                &first
            }
        };
        let tracks = tracks(runs, base, bar)?;
        let mut analysis = analyse(&tracks, &base.document, settings).map_err(Error::Refused)?;
        analysis.warnings.extend(about_gravity.cloned());
        let document = complete(&base.document, &analysis, settings.gravity);
        let before = Written::of(&before(&base.document, &analysis, settings.gravity, work.base.is_some()))?;
        let after = Written::of(&document)?;
        let inside: Vec<(Pose, usize)> =
            analysis.poses.iter().map(|(pose, position, _)| (pose.clone(), *position)).collect();
        let inside = judged(settings, &analysis, &inside, runs, [&before, &after], bar)?;
        let outside = outside(settings, &analysis, &work.judges, [&before, &after, base], bar)?;
        let [names, outside_names] = [runs, &work.judges]
            .map(|runs| -> Vec<String> { runs.iter().map(|run| run.name.clone()).collect() });
        let report = report(
            &document,
            &analysis,
            settings,
            Set { judged: &inside, runs: &names },
            outside.as_ref().map(|judged| Set { judged, runs: &outside_names }),
        );
        let about = About {
            method: "positions of a stand, weighted least squares with the stand's errors",
            key: "positions",
            details: details(&analysis, settings, &report)?,
            sigmas: sigmas(&document, &analysis, settings),
            range_deg_c: Some(range(&analysis)),
            logs: work.logs(),
        };
        let accepted = report.verdicts.iter().all(|verdict| verdict.accepted);
        let written = if accepted { after } else { Written::of(&base.document)? };
        Ok(Fitted { written, report, about })
    }
}

/// Positions that the fit has not seen.
fn outside(
    settings: &Settings,
    analysis: &Analysis,
    runs: &[Run],
    [before, after, base]: [&Written; 3],
    bar: fn() -> Bar,
) -> Result<Option<Vec<Judgement>>, Error> {
    if runs.is_empty() {
        return Ok(None);
    }
    let (poses, _) = positions(&tracks(runs, base, bar)?, settings).map_err(Error::Refused)?;
    Ok(Some(judged(settings, analysis, &poses, runs, [before, after], bar)?))
}
