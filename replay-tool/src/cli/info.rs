//! `isotherm-replay info`.

mod readings;
pub(super) mod tables;

use clap::Args;
use isotherm_cli::{Bar, Exit, print};
use isotherm_log::info::{FileInfo, LogInfo, Survey};

use super::log_args::{LogArgs, unnamed};
use super::show;
use crate::error::Error;

/// Ticks in one batch of a text log.
const BATCH: usize = 256;

/// Summarise a log: topics, rates, gaps, jitter, temperatures, mode switches, calibrations, commands
#[derive(Debug, Args)]
#[command(after_help = "Example, in two steps:\n  \
    isotherm-replay simulate --preset mems-chamber --duration 60 --out mems.csv\n  \
    isotherm-replay info mems.csv\n\n\
    Memory does not grow with the length of the log. Exit code 3: the log is cut short, or rows of it could not be read.")]
pub(super) struct InfoArgs {
    #[command(flatten)]
    log: LogArgs,
    /// Print everything as one JSON object; times are in ns
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub(super) fn run(args: &InfoArgs) -> Result<Exit, Error> {
    let info = survey(&args.log)?;
    Ok(print(&if args.json { show::json(&info) } else { tables::of(&info) }, outcome(&info)))
}

/// Reads the log to its end.
pub(super) fn survey(log: &LogArgs) -> Result<LogInfo, Error> {
    let opened = log.files(BATCH, unnamed().as_ref())?;
    let mut messages = opened.open(&log.part()?)?;
    let files = log.log_files()?;
    let files: Vec<_> = files.iter().map(|path| FileInfo::of(path)).collect::<Result<_, _>>()?;
    let mut survey = Survey::new(&opened);
    let mut bar = Bar::over_log(messages.progress().watch());
    loop {
        let message = messages.next_message()?;
        if let Some(recordings) = messages.recording() {
            survey.beside(recordings.take_attachments(), recordings.take_metadata());
        }
        let Some(message) = message else { break };
        survey.take(&message);
        bar.step_saying(|| Some(format!("{} ticks", survey.ticks())));
    }
    bar.finish();
    Ok(survey.finish(files, messages.report()))
}

/// How it went.
pub(super) fn outcome(info: &LogInfo) -> Exit {
    let cut = |file: &FileInfo| file.recording.as_ref().is_some_and(|recording| !recording.complete);
    Exit::of_loss(info.reading.lost_data() || info.files.iter().any(cut))
}
