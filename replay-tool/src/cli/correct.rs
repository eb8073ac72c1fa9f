//! `isotherm-replay correct`.

mod recording;
mod report;
mod sink;
mod text;

use std::path::PathBuf;

use clap::Args;
use isotherm_cli::Exit;
use isotherm_correction::navigation::NavigationStep;
use isotherm_correction::unit::UnitSettings;
use isotherm_correction::units::Span;

use super::LogArgs;
use crate::error::Error;
use crate::output::Format;

/// Correct a log offline, through the state machine of the service
#[derive(Debug, Args)]
#[command(after_help = "Example, in two steps:\n  \
    isotherm-replay simulate --preset mems-chamber --duration 60 --out mems.csv\n  \
    isotherm-replay correct mems.csv --calibration config/calibration/MEMS-0001.toml --out corrected.csv\n\n\
    The CSV's columns are named with their units; its numbers read back to the bit.\n\n\
    A recording is corrected by its own journal, all units at once: each with the calibrations, swaps and commands that it had \
    in the service, at the same ticks: `isotherm-replay correct session.mcap`. Where it has the corrected ticks of the service \
    too, they are compared to the bit.\n\n\
    Exit code 3: units without journal were left out, recorder and service did not have the same, corrected and published ticks differ, or a part of the log could \
    not be read.")]
#[expect(clippy::struct_excessive_bools, reason = "each is a switch of the command line")]
pub(super) struct CorrectArgs {
    #[command(flatten)]
    log: LogArgs,
    /// Calibration document (TOML), in force from the beginning. Of a text log the one that it is corrected with; of a
    /// recording, in the place of the one that the unit it names began with; may be given several times, one for each unit
    #[arg(long, short, value_name = "FILE")]
    calibration: Vec<PathBuf>,
    /// Where the corrected ticks go: a file for one unit, - for standard output; a folder (ending in /) for a file of each unit;
    /// FILE.mcap for a recording of all units (default: the summary alone)
    #[arg(long, short, value_name = "PATH")]
    out: Option<PathBuf>,
    /// How they are written, other than to FILE.mcap (default: csv)
    #[arg(long, value_enum, hide_short_help = true)]
    format: Option<Format>,
    /// How long a gyro tick waits for its accelerometer tick, in the log's time (ms) (default: 50; recordings: as in the service)
    #[arg(long, value_name = "MS", hide_short_help = true)]
    pairing_window_ms: Option<u32>,
    /// A temperature reading takes effect for ticks that end this long after it (ms) (default: 50; recordings: as in the service)
    #[arg(long, value_name = "MS", hide_short_help = true)]
    temperature_delay_ms: Option<u32>,
    /// Ticks that are summed to one navigation step (1…1000) (default: 1; recordings: as in the service)
    #[arg(long, value_name = "TICKS", hide_short_help = true)]
    navigation_ticks: Option<u16>,
    /// Apply coning and sculling terms to navigation steps (recordings: as in the service)
    #[arg(long, hide_short_help = true)]
    coning_sculling: bool,
    /// Leave out the swaps in a recording's journal: what is in force at the beginning stays
    #[arg(long, hide_short_help = true)]
    ignore_swaps: bool,
    /// Correct a recording as if it had no journal: by --calibration alone
    #[arg(long, requires = "calibration", conflicts_with = "ignore_swaps", hide_short_help = true)]
    ignore_journal: bool,
    /// Compare with the corrected ticks in a recording, though something is other than in the service
    #[arg(long, conflicts_with = "no_compare", hide_short_help = true)]
    compare: bool,
    /// Do not compare with the corrected ticks in a recording
    #[arg(long, hide_short_help = true)]
    no_compare: bool,
    /// Threads that correct the units of a recording, beside the one that reads it; 1: one for both (default: as many as cores)
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

/// Runs the command.
pub(super) fn run(args: &CorrectArgs) -> Result<Exit, Error> {
    if args.log.is_recording()? { recording::run(args) } else { text::run(args) }
}
