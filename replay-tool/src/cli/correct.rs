//! `isotherm-replay correct`.

mod recording;
mod report;
mod sink;
mod text;

use std::path::{Path, PathBuf};
use std::thread::available_parallelism;

use clap::Args;
use isotherm_cli::{Bar, Exit, print, say_lines};
use isotherm_correction::navigation::NavigationStep;
use isotherm_correction::unit::UnitSettings;
use isotherm_correction::units::Span;
use isotherm_log::file::read_small_text;
use isotherm_log::offline::{Loaded, RunOptions, UnitPlan, UnitReport, correct, load_calibration};
use isotherm_log::part::LogFiles;
use isotherm_log::source::LogReport;

use super::{LogArgs, show};
use crate::error::Error;
use sink::{Format, Sink};

/// Correct a log offline, with the service's own state machine
#[derive(Debug, Args)]
#[command(after_help = "Example, in two steps:\n  \
    isotherm-replay simulate --preset mems-chamber --duration 60 --out mems.csv\n  \
    isotherm-replay correct mems.csv --calibration config/calibration/MEMS-0001.toml --out corrected.csv\n\n\
    The CSV's column names end with their unit; its numbers read back to the bit.\n\n\
    A recording is corrected by its own journal, all units at once, with the calibrations, swaps and commands of the service at the same ticks: `isotherm-replay correct session.mcap`. Corrected ticks in it are compared to the bit.\n\n\
    Exit code 3: units without a journal were left out, recorder and service received different messages, corrected and published ticks differ, or part of the log \
    could not be read.")]
#[expect(clippy::struct_excessive_bools, reason = "each is a switch of the command line")]
pub(super) struct CorrectArgs {
    #[command(flatten)]
    log: LogArgs,
    /// Calibration document (TOML), in force from the beginning; for a recording, replaces its unit's first one; repeatable
    #[arg(long, short, value_name = "FILE")]
    calibration: Vec<PathBuf>,
    /// Corrected ticks: a file for one unit (- for stdout), a folder ending in /, or FILE.mcap for all (default: none)
    #[arg(long, short, value_name = "PATH")]
    out: Option<PathBuf>,
    /// Replace existing files
    #[arg(long)]
    overwrite: bool,
    /// Format, except for FILE.mcap (default: csv)
    #[arg(long, value_enum, hide_short_help = true)]
    format: Option<Format>,
    /// Pairing window: wait of a gyro tick for its accelerometer tick (ms) (default: 50; recordings: as recorded)
    #[arg(long, value_name = "MS", hide_short_help = true)]
    pairing_window_ms: Option<u32>,
    /// Delay from a temperature reading to the first tick it affects (ms) (default: 50; recordings: as recorded)
    #[arg(long, value_name = "MS", hide_short_help = true)]
    temperature_delay_ms: Option<u32>,
    /// Ticks per navigation step (1…1000) (default: 1; recordings: as recorded)
    #[arg(long, value_name = "TICKS", hide_short_help = true)]
    navigation_ticks: Option<u16>,
    /// Apply coning and sculling terms to navigation steps (recordings: as recorded)
    #[arg(long, hide_short_help = true)]
    coning_sculling: bool,
    /// Ignore the swaps of a recording: keep the first calibration
    #[arg(long, hide_short_help = true)]
    ignore_swaps: bool,
    /// Ignore the journal of a recording: correct by --calibration alone
    #[arg(long, requires = "calibration", conflicts_with = "ignore_swaps", hide_short_help = true)]
    ignore_journal: bool,
    /// Compare with the corrected ticks in a recording although a setting differs
    #[arg(long, conflicts_with = "no_compare", hide_short_help = true)]
    compare: bool,
    /// Do not compare with the corrected ticks in a recording
    #[arg(long, hide_short_help = true)]
    no_compare: bool,
    /// Threads that correct the units of a log; 1: also reads it (default: all cores)
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024), hide_short_help = true)]
    threads: Option<u16>,
    /// Print the summary as one JSON object
    #[arg(long)]
    json: bool,
}

impl CorrectArgs {
    /// The unit's settings, where no journal has them.
    fn settings(&self) -> Result<UnitSettings, Error> {
        let default = UnitSettings::default();
        let navigation = NavigationStep::new(self.navigation_ticks.unwrap_or(1), self.coning_sculling)
            .map_err(|error| Error::Usage(format!("--navigation-ticks: {error}")))?;
        Ok(UnitSettings {
            pairing_window: self.pairing_window_ms.map_or(default.pairing_window, Span::from_ms),
            temperature_delay: self.temperature_delay_ms.map_or(default.temperature_delay, Span::from_ms),
            navigation,
            ..default
        })
    }

    /// The first setting that was given.
    fn given_setting(&self) -> Option<&'static str> {
        let given = [
            ("--pairing-window-ms", self.pairing_window_ms.is_some()),
            ("--temperature-delay-ms", self.temperature_delay_ms.is_some()),
            ("--navigation-ticks", self.navigation_ticks.is_some()),
            ("--coning-sculling", self.coning_sculling),
        ];
        given.into_iter().find_map(|(name, given)| given.then_some(name))
    }
}

/// Prints the summary: on standard error where the ticks go to standard output.
fn print_summary(args: &CorrectArgs, text: &str, exit: Exit) -> Exit {
    if args.out.as_deref() == Some(Path::new("-")) {
        say_lines(text.trim_end_matches('\n'));
        return exit;
    }
    print(text, exit)
}

/// Reads a calibration document and says what is doubtful about it.
fn loaded(path: &Path) -> Result<Loaded, Error> {
    let loaded = load_calibration(path)?;
    loaded.warnings.iter().for_each(show::warn);
    Ok(loaded)
}

/// Corrects the units as planned, and writes what comes of it with the documents beside it.
fn corrected(
    args: &CorrectArgs,
    mut files: LogFiles,
    plans: Vec<UnitPlan>,
    documents: &[&Path],
) -> Result<(Vec<UnitReport>, LogReport), Error> {
    let units: Vec<_> = plans.iter().map(|plan| plan.id.clone()).collect();
    let mut sink = Sink::open(args, &units)?;
    for path in documents {
        sink.document(read_small_text(path, "read the calibration document")?.into_bytes())?;
    }
    // A unit's state rests on all that came before the part: that is corrected and not given out.
    let mut part = args.log.part()?;
    let from_ns = files.from_beginning(&mut part)?;
    let cores = available_parallelism().map_or(1, usize::from);
    let options = RunOptions {
        threads: args.threads.map_or(cores, usize::from),
        form: sink.form(args.format),
        from_ns,
    };
    let (mut bar, mut ticks) = (None, 0);
    let result = correct(&files, &part, plans, options, &mut |made, progress| {
        let bar = bar.get_or_insert_with(|| Bar::over_log(progress.watch()));
        ticks += made.iter().map(|(_, output)| output.ticks).sum::<u64>();
        bar.show(format!("{ticks} ticks"));
        sink.write(made)
    });
    bar.iter().for_each(Bar::finish);
    let (units, log) = result?;
    let is_empty = units.iter().all(|unit| unit.summary.ticks == 0 && unit.unanswered() == 0);
    if is_empty && matches!(files, LogFiles::Text { .. }) && !log.lost_data() {
        return Err(Error::Nothing("corrected", "raw message"));
    }
    sink.finish(&args.log.log)?;
    Ok((units, log))
}

/// Runs the command.
pub(super) fn run(args: &CorrectArgs) -> Result<Exit, Error> {
    if args.log.is_recording()? { recording::run(args) } else { text::run(args) }
}
