//! `isotherm-calibrate tumble`.

use std::path::{Path, PathBuf};

use clap::Args;
use isotherm_cli::Bar;
use isotherm_correction::sample::OutputKind;
use isotherm_protocol::document::AccelOutput;

use super::above_0;
use super::batch::{Batch, Named, Names, Work};
use super::output::{About, Fitted, OutputArgs};
use super::place::GravityArgs;
use super::runs::LogArgs;
use crate::error::Error;
use crate::positions::bare::bare;
use crate::positions::still::StillLimits;
use crate::positions::track::Track;
use crate::runs::Run;
use crate::tumble::analysis::{Settings, analyse};
use crate::tumble::document::{before, complete};
use crate::tumble::report::{Left, details, report, sigmas};
use crate::written::Written;

/// Axes, scale factors and biases of a unit that was put down in many ways by hand: accelerometers from |f| = g, gyros against them
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    isotherm-calibrate tumble gyro.txt.gz acc.txt.gz --mapping config/mappings/tumble-mems.toml --unit TUMBLE-0001 --gravity 9.81744 --out tumble.toml --html tumble.html\n  \
    isotherm-calibrate tumble tumbled.mcap --calibration unit.toml --latitude 55.75 --out unit-tumbled.toml\n\n\
    Leave the unit alone for half a minute, then put it down in thirty or more different ways for two seconds each. The accelerometers define the case axes: z is the third's, y lies in the plane of the second and third.")]
pub(super) struct TumbleArgs {
    #[command(flatten)]
    log: LogArgs,
    /// Calibration document (TOML) to complete (default: everything else as in the log); several units: a folder with UNIT.toml of each
    #[arg(long = "calibration", short = 'c', alias = "document", short_alias = 'd', value_name = "FILE")]
    document: Option<PathBuf>,
    #[command(flatten)]
    gravity: GravityArgs,
    /// Still time at the beginning (s)
    #[arg(long, value_name = "SECONDS", default_value_t = 30.0)]
    still_start: f64,
    /// Window of the search for still poses (s)
    #[arg(long, value_name = "SECONDS", default_value_t = 1.0)]
    window: f64,
    /// Largest variance of a still window, relative to the still start (default: the best of 2 to 10)
    #[arg(long, value_name = "FACTOR")]
    threshold: Option<f64>,
    /// Rate above which the unit turns (°/s)
    #[arg(long, value_name = "DEG_PER_S", default_value_t = 1.0)]
    still_rate: f64,
    /// Shortest pose (s), less half a window at either end
    #[arg(long, value_name = "SECONDS", default_value_t = 1.0)]
    least: f64,
    /// Unit of the accelerometers' means without a document: "V" (converter readings too) or "m/s2"
    #[arg(long, value_name = "UNIT", default_value = "V", value_parser = ["V", "m/s2"])]
    accelerometer_unit: String,
    #[command(flatten)]
    output: OutputArgs,
}

impl TumbleArgs {
    /// Does what the command says.
    pub(super) fn run(&self) -> Result<(), Error> {
        self.check()?;
        let gravity = self.gravity.stated()?;
        let named = Named::together(&self.log.reading, &self.log.log, self.document.as_ref());
        let batch =
            Batch { output: &self.output, title: "Several units tumbled by hand", accept_partial: false };
        batch.carry_out(named.units()?, |work, names, bar| {
            self.output.keep(self.fit(work, names, &gravity, bar)?, work, names)
        })
    }

    fn fit(
        &self,
        work: &Work,
        names: &Names<'_>,
        (gravity, about_gravity): &(f64, Option<String>),
        bar: fn() -> Bar,
    ) -> Result<Fitted, Error> {
        let (run, gravity) = (work.run()?, *gravity);
        let first;
        let base = match &work.base {
            Some(base) if base.document.accel.is_some() => base,
            Some(_) => {
                return Err(Error::Refused(vec![
                    "the document has no accelerometers: add [accel], or leave the document out".to_owned(),
                ]));
            }
            None => {
                first = self.first_document(run, bar())?;
                &first
            }
        };
        let track = Track::of(run, &base.loaded, bar())?;
        let settings = Settings {
            gravity,
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
        let fitting = names.at_work("fitting");
        let found = analyse(&track, &settings);
        fitting.finish();
        let mut tumble = found.map_err(Error::Refused)?;
        tumble.warnings.extend(about_gravity.clone());
        let (document, warnings) = complete(&base.document, &tumble).map_err(Error::Refused)?;
        tumble.warnings.extend(warnings);
        let left = |written: &Written| -> Result<Left, Error> {
            let track = Track::of(run, &written.loaded, bar())?;
            Ok(Left::of(&track, &tumble.poses, gravity))
        };
        let (before, about_before) = before(&base.document, &tumble, work.base.is_some());
        let before = left(&Written::of(&before)?)?;
        let written = Written::of(&document)?;
        let after = left(&written)?;
        let mut report = report(&document, &tumble, &settings, &run.name, [&before, &after]);
        report.notes.push(about_before.to_owned());
        let about = About {
            method: "tumble: |f| = g over still poses; gyros against the accelerometers",
            key: "tumble",
            details: details(&tumble, &settings, &report)?,
            sigmas: sigmas(&document, &tumble),
            range_deg_c: None,
            logs: work.logs(),
        };
        // Gyros are relative to the axes of the accelerometers that were found with them.
        let accepted = report.verdicts.first().is_some_and(|accel| accel.accepted);
        let written = if accepted { written } else { Written::of(&base.document)? };
        Ok(Fitted { written, report, about })
    }

    /// What the arguments must hold before anything is read.
    fn check(&self) -> Result<(), Error> {
        let positive = [
            ("--still-start", self.still_start),
            ("--window", self.window),
            ("--threshold", self.threshold.unwrap_or(1.0)),
            ("--still-rate", self.still_rate),
            ("--least", self.least),
        ];
        positive.into_iter().try_for_each(|(name, value)| above_0(name, value))?;
        let inputs: Vec<&Path> = self.log.log.iter().chain(&self.document).map(PathBuf::as_path).collect();
        self.output.check(&inputs)
    }

    /// A document where there is none.
    fn first_document(&self, run: &Run, bar: Bar) -> Result<Written, Error> {
        let series = run.series(bar)?;
        let output = match (series.accels.output, self.accelerometer_unit.as_str()) {
            (Some(OutputKind::Counts), _) => AccelOutput::Counts,
            (_, "V") => AccelOutput::Volts,
            _ => AccelOutput::MetresPerSecondSquared,
        };
        let mut document = bare(&series, output)?;
        if output == AccelOutput::Volts {
            document.note = Some(
                "V in this document is the accelerometers' reading in the log: volts, or counts of a converter with \
                 its zero at mid-scale, which is then part of the bias."
                    .to_owned(),
            );
        }
        Written::of(&document)
    }
}
