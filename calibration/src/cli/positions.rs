//! `isotherm-calibrate positions`.

use std::path::PathBuf;

use clap::{Arg, Args};

use super::driver::{Job, close};
use super::output::FitArgs;
use super::place::GravityArgs;
use crate::document::{About, Fitted, Written};
use crate::error::Error;
use crate::fits::positions::bare::of_run;
use crate::fits::positions::budget::Budget;
use crate::fits::positions::document::{complete, range};
use crate::fits::positions::fit::{Analysis, Found, Settings, analyse, positions};
use crate::fits::positions::judged::{Judgement, judge};
use crate::fits::positions::plan::Plan;
use crate::fits::positions::pose::Pose;
use crate::fits::positions::provenance::{before, details, sigmas};
use crate::fits::positions::report::{Set, report};
use crate::fits::positions::still::StillLimits;
use crate::fits::positions::times::Times;
use crate::fits::positions::track::Track;
use crate::limits::{above_0, from_0};
use crate::numbers::{ARCSEC_PER_RAD, dot};
use crate::report::Report;
use crate::runs::Run;

/// Axes, scale factors and biases of accelerometers from positions of a stand, at one temperature or several
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    isotherm-calibrate positions --budget --positioning 5 --run-out 2\n  \
    isotherm-calibrate positions cold.mcap room.mcap hot.mcap --calibration unit.toml --latitude 55.75 --out unit-positions.toml --html positions.html\n  \
    isotherm-calibrate positions stand.mcap --plan my-plan.toml --gravity 9.8154 --times held.csv\n\n\
    Still poses are found in the logs and known by the gyros' turns between them. Every set of positions works that shows each axis up \
    and down; nine or more tell the stand's errors from the axes.",
    mut_arg("log", |log: Arg| log.required(false).required_unless_present("budget")))]
pub(super) struct PositionsArgs {
    #[command(flatten)]
    common: FitArgs,
    /// Print only the error budget of a planned calibration (default: the example of 004)
    #[arg(long, conflicts_with_all = ["log", "document", "out", "judge", "html", "times"])]
    budget: bool,
    /// Positions in order: "twelve" (of 004; needs the turns in the log, or --times), "six", or a file (TOML, CSV)
    #[arg(long, value_name = "PLAN", default_value = "twelve")]
    plan: String,
    /// Times of the positions (CSV: `start_s,end_s,position[,log]`), for logs without turns (default: found in the logs)
    #[arg(long, value_name = "FILE")]
    times: Option<PathBuf>,
    #[command(flatten)]
    gravity: GravityArgs,
    /// σ1: standard deviation of the stand's positioning (″)
    #[arg(long, value_name = "ARCSEC", default_value_t = 5.0, value_parser = above_0)]
    positioning: f64,
    /// σ2: standard deviation of its axes' run-out (″)
    #[arg(long, value_name = "ARCSEC", default_value_t = 2.0, value_parser = from_0)]
    run_out: f64,
    /// Level error of the stand (″, one sigma)
    #[arg(long, hide_short_help = true, value_name = "ARCSEC", default_value_t = 60.0, value_parser = above_0)]
    levelling: f64,
    #[command(flatten)]
    limits: StillLimits,
    /// Temperature channels that the axes follow by their mean (default: the document's, else the accelerometers')
    #[arg(long, value_name = "CHANNEL")]
    channel: Vec<String>,
    /// Reference temperature of the polynomials (°C)
    #[arg(long, hide_short_help = true, value_name = "DEG_C", allow_hyphen_values = true)]
    reference: Option<f64>,
    /// Unit of the accelerometers' means without a document: "V" or "m/s2" (default: the mapping's, else V)
    #[arg(long, value_name = "UNIT", value_parser = ["V", "m/s2"])]
    accelerometer_unit: Option<String>,
    #[command(flatten)]
    planned: Budget,
}

impl PositionsArgs {
    pub(super) fn run(&self) -> Result<(), Error> {
        let plan = Plan::named(&self.plan)?;
        if self.budget {
            return self.print_budget(&plan);
        }
        let (settings, about_gravity) = self.settings(plan)?;
        self.common.run("Accelerometers of several units", self.times.as_deref(), |job| {
            self.fit(job, &settings, about_gravity.as_ref())
        })
    }

    fn print_budget(&self, plan: &Plan) -> Result<(), Error> {
        let budget = Budget {
            positioning_arcsec: self.positioning,
            run_out_arcsec: self.run_out,
            ..self.planned.clone()
        };
        let levelling_rad = self.levelling / ARCSEC_PER_RAD;
        close(&self.common.output.files(), &budget.report(plan, levelling_rad), Report::whole_text)
    }

    fn settings(&self, plan: Plan) -> Result<(Settings, Option<String>), Error> {
        let (gravity, warning) = self.gravity.stated();
        let settings = Settings {
            plan,
            gravity,
            limits: self.limits,
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
        job: &Job<'_>,
        settings: &Settings,
        about_gravity: Option<&String>,
    ) -> Result<Fitted, Error> {
        let work = job.work;
        let runs = &work.runs;
        let add = "add [accel] with their channels, nominal scale factors and axes";
        let base = &*work.base_with_accelerometers(add, || {
            Written::of(&of_run(work.run()?, self.accelerometer_unit.as_deref())?)
        })?;
        let tracks = tracks_of(runs, base)?;
        let mut analysis = analyse(&tracks, &base.document, settings).map_err(Error::Refused)?;
        analysis.warnings.extend(about_gravity.cloned());
        let document = complete(&base.document, &analysis, settings.gravity);
        let before = Written::of(&before(&base.document, &analysis, settings.gravity, work.base.is_some()))?;
        let after = Written::of(&document)?;
        let known = Found { poses: analysis.poses.clone(), ..Found::default() };
        let inside = judged(settings, &analysis, known, runs, [&before, &after])?;
        let mut outside = None;
        if !work.judges.is_empty() {
            let unseen = tracks_of(&work.judges, base)?;
            let found = positions(&unseen, settings).map_err(Error::Refused)?;
            outside = Some(judged(settings, &analysis, found, &work.judges, [&before, &after])?);
        }
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
            details: details(&analysis, settings),
            sigmas: sigmas(&document, &analysis, settings),
            range_deg_c: Some(range(&analysis)),
            ..About::default()
        };
        let accepted = report.verdicts.iter().all(|verdict| verdict.accepted);
        let written = if accepted { after } else { Written::of(&base.document)? };
        Ok(Fitted { written, report, about })
    }
}

/// Runs tick by tick, corrected with a document.
fn tracks_of(runs: &[Run], written: &Written) -> Result<Vec<Track>, Error> {
    runs.iter().map(|run| Track::of(run, &written.loaded)).collect()
}

/// Poses of runs, before and after; those that may be other positions are taken for the ones that they fit better.
fn judged(
    settings: &Settings,
    analysis: &Analysis,
    mut found: Found,
    runs: &[Run],
    [before, after]: [&Written; 2],
) -> Result<Vec<Judgement>, Error> {
    let (before, after) = (tracks_of(runs, before)?, tracks_of(runs, after)?);
    let errors = analysis.fit.stand.map(|(error, _)| error);
    let of = |poses: &[(Pose, usize)]| {
        judge(&settings.plan, errors, settings.gravity, poses, [&before, &after], &analysis.channels)
    };
    let left = |judged: &[Judgement]| -> f64 {
        judged.iter().map(|judgement| dot(judgement.error[1], judgement.error[1])).sum()
    };
    let mut judged = of(&found.poses);
    for mut other in found.others {
        let mut poses = found.poses.clone();
        other.swap(poses.iter_mut().map(|(_, position)| position));
        let otherwise = of(&poses);
        if left(&otherwise) < left(&judged) {
            (judged, found.poses) = (otherwise, poses);
        }
    }
    Ok(judged)
}
