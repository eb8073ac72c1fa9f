//! `isotherm-replay convert`.

use std::path::{Path, PathBuf};

use clap::Args;
use isotherm_cli::{Exit, print};
use isotherm_log::offline::read_document;
use serde::Serialize;

use super::log_args::LogArgs;
use super::record::Compression;
use super::show;
use crate::error::Error;
use isotherm_convert::{self as convert, Conversion, Place, Ros2Options, Target};

/// Convert recordings to text, ROS 2 bags or Parquet, and text logs to recordings
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    isotherm-replay simulate --preset mems-chamber --duration 60 --out mems.csv\n  \
    isotherm-replay convert mems.csv --unit MEMS-0001 --out mems.mcap\n  \
    isotherm-replay convert mems.mcap --to text --out text\n  \
    isotherm-replay convert mems.mcap --to ros2 --out bag --calibration config/calibration/MEMS-0001.toml\n  \
    isotherm-replay convert mems.mcap --to parquet --out tables\n\n\
    Text: FOLDER/UNIT/raw.csv with raw.mapping.toml, which reads it back to the same ticks, corrected.csv and health.csv;\n\
    for one unit also a file that ends in .csv or .csv.gz, with the others next to it. A new run of the producer begins\n\
    raw.2.csv. Parquet: FOLDER/UNIT/STREAM.parquet. ROS 2: /imu/UNIT/data and /imu/UNIT/temperature/CHANNEL; for units\n\
    without corrected ticks, or with --raw, /imu/UNIT/data_raw.\n\
    Exit code 3: part of the log could not be read or written; the summary says what.")]
#[expect(clippy::struct_excessive_bools, reason = "each is a switch of the command line")]
pub(super) struct ConvertArgs {
    #[command(flatten)]
    log: LogArgs,
    /// Output: a file that ends in .mcap, .csv or .csv.gz, or a folder with --to
    #[arg(long, short, value_name = "FILE")]
    out: PathBuf,
    /// Format (default: by the output's name)
    #[arg(long, value_enum, value_name = "TARGET")]
    to: Option<Target>,
    /// Replace existing files
    #[arg(long)]
    overwrite: bool,
    /// Gyro ticks per message of a recording (1…4096)
    #[arg(long, value_name = "TICKS", default_value_t = 64, value_parser = clap::value_parser!(u16).range(1..=4096))]
    batch: u16,
    /// Compression of a recording
    #[arg(long, value_enum, default_value_t)]
    compression: Compression,
    /// Leave out the JSON channels for viewers: recordings are half as long
    #[arg(long, hide_short_help = true)]
    no_json_channels: bool,
    /// ROS 2: write raw readings, at nominal scale, also for units with corrected ticks
    #[arg(long)]
    raw: bool,
    /// ROS 2: calibration document (TOML) for the raw readings (default: from the recording)
    #[arg(long, short, value_name = "FILE")]
    calibration: Vec<PathBuf>,
    /// ROS 2: frame of the messages (default: the unit's name)
    #[arg(long, value_name = "FRAME")]
    frame: Option<String>,
    /// Print the summary as one JSON object
    #[arg(long)]
    json: bool,
}

/// Everything that the summary says.
#[derive(Debug, Serialize)]
struct Report<'a> {
    target: Target,
    #[serde(flatten)]
    outcome: &'a convert::Outcome,
}

impl ConvertArgs {
    /// What it is converted to.
    fn target(&self, out: &Path) -> Result<Target, Error> {
        let by_name = Target::by_name(out);
        let parquet = out.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("parquet"));
        let out = out.display();
        let target = match (self.to, by_name) {
            (Some(to), Some(by_name)) if to != by_name => {
                return Err(Error::Usage(format!(
                    "{out} has the name of another kind of output than --to: change one of the two"
                )));
            }
            (to, by_name) => to.or(by_name),
        };
        match target {
            // A reader would take a folder of that name for one table.
            _ if parquet => Err(Error::Usage(format!(
                "{out}: Parquet has one file per unit and stream: give a folder that does not end in .parquet, and \
                 --to parquet"
            ))),
            Some(Target::Mcap) if by_name.is_none() => {
                Err(Error::Usage(format!("{out} does not end in .mcap, as a recording must")))
            }
            Some(target) => Ok(target),
            None => Err(Error::Usage(format!(
                "{out} does not say what to convert to: end it in .mcap, .csv or .csv.gz, or give a folder and --to text, ros2 or parquet"
            ))),
        }
    }

    /// Refuses options that have no meaning for the target.
    fn refuse_idle_options(&self, target: Target) -> Result<(), Error> {
        let (bags, recordings) = ((Target::Ros2, "ROS 2 bags"), (Target::Mcap, "recordings (.mcap)"));
        let options = [
            ("--raw", self.raw, bags),
            ("--calibration", !self.calibration.is_empty(), bags),
            ("--frame", self.frame.is_some(), bags),
            ("--compression", !self.compression.compresses(), recordings),
            ("--no-json-channels", self.no_json_channels, recordings),
        ];
        match options.iter().find(|(_, given, (of, _))| *given && target != *of) {
            Some((option, _, (_, outputs))) => {
                Err(Error::Usage(format!("{option} is for {outputs}: leave it out")))
            }
            None => Ok(()),
        }
    }

    /// The conversion that the arguments describe.
    fn conversion(&self) -> Result<Conversion, Error> {
        let (log, out) = (&self.log, &self.out);
        let target = self.target(out)?;
        self.refuse_idle_options(target)?;
        for path in &log.log {
            std::fs::metadata(path).map_err(|source| Error::file(path, "open the log", source))?;
        }
        let files = log.files(self.batch.into(), None)?;
        if target == Target::Mcap && log.is_recording()? {
            return Err(Error::Usage(
                "the log is a recording already: convert it to something else".to_owned(),
            ));
        }
        let inputs = log.inputs();
        let inputs = inputs.into_iter().chain(self.calibration.iter().cloned()).collect();
        let place = Place { overwrite: self.overwrite, inputs };
        // Before a long log is read, not after.
        match target {
            Target::Ros2 | Target::Parquet => place.check_folder(out)?,
            Target::Text if Target::by_name(out).is_none() => place.check_folder(out)?,
            Target::Text | Target::Mcap => place.check(out)?,
        }
        let documents = self.calibration.iter().map(|path| Ok(read_document(path)?.document));
        let documents = documents.collect::<Result<_, Error>>()?;
        let mut sources: Vec<_> = vec![("log".to_owned(), show::names(&log.log))];
        sources
            .extend(log.mapping_file().map(|mapping| ("mapping".to_owned(), mapping.display().to_string())));
        Ok(Conversion {
            files,
            part: log.part()?,
            target,
            out: out.clone(),
            place,
            compress: self.compression.compresses(),
            json: !self.no_json_channels,
            sources,
            ros2: Ros2Options { raw: self.raw, frame: self.frame.clone(), documents },
        })
    }
}

/// Runs the command.
pub(super) fn run(args: &ConvertArgs) -> Result<Exit, Error> {
    let conversion = args.conversion()?;
    let outcome = conversion.run()?;
    outcome.converted.notes.iter().for_each(show::warn);
    let report = Report { target: conversion.target, outcome: &outcome };
    let text = if args.json { show::json(&report) } else { human(&outcome) };
    Ok(print(&text, Exit::of_loss(outcome.lost_data())))
}

/// The summary as tables.
fn human(outcome: &convert::Outcome) -> String {
    let converted = &outcome.converted;
    let files: Vec<_> = converted
        .files
        .iter()
        .map(|file| (format!("{}  {}", file.path.display(), file.what), file.rows.to_string()))
        .collect();
    let topics: Vec<_> =
        converted.topics.iter().map(|topic| (topic.name.clone(), topic.messages.to_string())).collect();
    let mut counts: Vec<_> = Vec::new();
    if converted.duplicates > 0 {
        counts.push(("duplicates, written once".to_owned(), converted.duplicates.to_string()));
    }
    let left_out = converted.left_out.iter();
    counts.extend(left_out.map(|(what, count)| (format!("left out: {what}"), count.to_string())));
    counts.extend(converted.lost.iter().map(|(why, count)| (format!("LOST: {why}"), count.to_string())));
    let mut text = String::new();
    for rows in [&files, &topics, &counts] {
        if !rows.is_empty() {
            let rows: Vec<_> = rows.iter().map(|(name, figure)| (name.as_str(), figure.clone())).collect();
            text += &show::table(&rows);
        }
    }
    text + &show::reading(&outcome.log)
}
