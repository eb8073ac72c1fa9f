//! `isotherm-calibrate tumble`.

use clap::Args;
use isotherm_protocol::document::AccelOutput;

use super::driver::{Job, Task};
use super::output::OutputArgs;
use super::place::GravityArgs;
use super::runs::{BaseArgs, LogArgs};
use super::units::Logs;
use crate::document::{About, Fitted, Written};
use crate::error::Error;
use crate::fits::positions::bare::of_run;
use crate::fits::positions::still::StillLimits;
use crate::fits::positions::track::Track;
use crate::fits::tumble::document::{before, complete, track};
use crate::fits::tumble::fit::{Settings, Tumble, analyse};
use crate::fits::tumble::report::{Left, details, of_gyros, report, sigmas};
use crate::limits::above_0;
use crate::runs::Run;

/// Axes, scale factors and biases of a unit that was put down in many ways by hand: accelerometers from |f| = g, gyros against them
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    isotherm-calibrate tumble gyro.txt.gz acc.txt.gz --mapping config/mappings/tumble-mems.toml --unit TUMBLE-0001 --gravity 9.81744 --out tumble.toml --html tumble.html\n  \
    isotherm-calibrate tumble tumbled.mcap --calibration unit.toml --latitude 55.75 --out unit-tumbled.toml\n\n\
    Leave the unit still for half a minute, then put it down in thirty or more different ways for two seconds each. The accelerometers define the case axes: z is the third's, y lies in the plane of the second and third.")]
pub(super) struct TumbleArgs {
    #[command(flatten)]
    log: LogArgs,
    #[command(flatten)]
    base: BaseArgs,
    #[command(flatten)]
    gravity: GravityArgs,
    /// Still time at the beginning (s)
    #[arg(long, value_name = "SECONDS", default_value_t = 30.0, value_parser = above_0)]
    still_start: f64,
    /// Window of the search for still poses (s)
    #[arg(long, hide_short_help = true, value_name = "SECONDS", default_value_t = 1.0, value_parser = above_0)]
    window: f64,
    /// Largest variance of a still window, relative to the still start (default: the best of 2 to 10)
    #[arg(long, hide_short_help = true, value_name = "FACTOR", value_parser = above_0)]
    threshold: Option<f64>,
    /// Rate above which the unit turns (°/s)
    #[arg(long, hide_short_help = true, value_name = "DEG_PER_S", default_value_t = 1.0, value_parser = above_0)]
    still_rate: f64,
    /// Shortest pose (s), less half a window at either end
    #[arg(long, hide_short_help = true, value_name = "SECONDS", default_value_t = 1.0, value_parser = above_0)]
    least: f64,
    /// Unit of the accelerometers' means without a document: "V" (converter readings too) or "m/s2" (default: the mapping's, else V)
    #[arg(long, value_name = "UNIT", value_parser = ["V", "m/s2"])]
    accelerometer_unit: Option<String>,
    #[command(flatten)]
    output: OutputArgs,
}

impl TumbleArgs {
    pub(super) fn run(&self) -> Result<(), Error> {
        let gravity = self.gravity.stated();
        let logs = Logs::together(&self.log, &self.base);
        let task = Task::new("Several units tumbled by hand", self.output.files(), logs);
        task.run(|job| self.output.done(self.fit(job, &gravity)?, job))
    }

    fn fit(&self, job: &Job<'_>, (gravity, about_gravity): &(f64, Option<String>)) -> Result<Fitted, Error> {
        let (work, run, gravity) = (job.work, job.work.run()?, *gravity);
        let base = &*work.base_with_accelerometers("add [accel], or leave the document out", || {
            self.first_document(run)
        })?;
        let track = track(run, base)?;
        let settings = Settings {
            gravity,
            latitude_deg: self.gravity.latitude_deg(),
            limits: StillLimits {
                window_s: self.window,
                factor: self.threshold.unwrap_or(4.0),
                rate_deg_per_s: self.still_rate,
                least_s: self.least,
                settle_s: 0.0,
            },
            search: self.threshold.is_none(),
            start_s: self.still_start,
        };
        let fitting = job.at_work("fitting");
        let found = analyse(&track, &settings);
        fitting.finish();
        let mut tumble = found.map_err(Error::Refused)?;
        tumble.warnings.extend(about_gravity.clone());
        let left = |written: &Written, tumble: &Tumble| -> Result<Left, Error> {
            Ok(Left::of(&Track::of(run, &written.loaded)?, tumble, gravity))
        };
        let (before, about_before) = before(&base.document, &tumble, work.base.is_some());
        let before = left(&Written::of(&before)?, &tumble)?;
        let new = |tumble: &Tumble| -> Result<(Written, Vec<String>, Left), Error> {
            let (document, warnings) = complete(&base.document, tumble).map_err(Error::Refused)?;
            let written = Written::of(&document)?;
            let after = left(&written, tumble)?;
            Ok((written, warnings, after))
        };
        let (mut written, mut warnings, mut after) = new(&tumble)?;
        let gyros = of_gyros([&before, &after]);
        if tumble.gyro.is_ok() && !gyros.accepted {
            // Those that are made worse keep their terms.
            tumble.gyro = Err(gyros.reason);
            (written, warnings, after) = new(&tumble)?;
        }
        tumble.warnings.extend(warnings);
        let mut report = report(&written.document, &tumble, &settings, &run.name, [&before, &after]);
        report.notes.push(about_before.to_owned());
        let about = About {
            method: "tumble: |f| = g over still poses; gyros against the accelerometers",
            key: "tumble",
            details: details(&tumble, &settings),
            sigmas: sigmas(&written.document, &tumble),
            ..About::default()
        };
        // Gyros are relative to the axes of the accelerometers that were found with them.
        let accepted = report.verdicts.first().is_some_and(|accel| accel.accepted);
        let written = if accepted { written } else { Written::of(&base.document)? };
        Ok(Fitted { written, report, about })
    }

    /// A document where there is none.
    fn first_document(&self, run: &Run) -> Result<Written, Error> {
        let mut document = of_run(run, self.accelerometer_unit.as_deref())?;
        if document.accel.as_ref().is_some_and(|accel| accel.output == AccelOutput::Volts) {
            document.note = Some(
                "V in this document is the accelerometers' reading in the log: volts, or counts of a converter with \
                 its zero at mid-scale, which is then part of the bias."
                    .to_owned(),
            );
        }
        Written::of(&document)
    }
}
