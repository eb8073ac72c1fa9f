//! The command line: arguments in, exit code out.

mod bar;
mod drift;
mod impact;

use std::io::{self, Write};
use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Args, CommandFactory, Parser, Subcommand};
use isotherm_correction::units::Span;
use isotherm_log::mapping::Mapping;
use isotherm_log::source::{Log, TextOptions, is_recording};
use isotherm_protocol::key::UnitId;

use crate::error::Error;
use crate::series::Series;

/// Makes calibration documents from logs, and judges them.
#[derive(Debug, Parser)]
#[command(
    name = "isotherm-calibrate",
    version,
    after_help = "Exit codes: 0 ok, 1 failed, or the data do not allow what was asked for, 2 usage, 3 finished with data loss, \
        78 bad mapping or calibration document."
)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    Drift(drift::DriftArgs),
    Impact(impact::ImpactArgs),
    /// Print a completion script for a shell
    #[command(after_help = "Example:\n  isotherm-calibrate completions bash > isotherm-calibrate.bash")]
    Completions {
        /// The shell
        shell: clap_complete::Shell,
    },
}

/// The log of one unit.
#[derive(Debug, Clone, Args)]
pub(crate) struct LogArgs {
    /// Recordings (.mcap), or the files of a text log in the order of its mapping
    #[arg(required = true, value_name = "LOG")]
    pub(crate) log: Vec<PathBuf>,
    /// Column mapping of a text log (TOML); ready ones are in config/mappings
    #[arg(long, short, value_name = "FILE")]
    pub(crate) mapping: Option<PathBuf>,
    /// The unit, where a recording has several, or the serial of a text log's
    #[arg(long, short, value_name = "SERIAL")]
    pub(crate) unit: Option<String>,
}

impl LogArgs {
    /// The serial that was given.
    pub(crate) fn serial(&self) -> Result<Option<UnitId>, Error> {
        Ok(self.unit.as_deref().map(isotherm_log::offline::unit_id).transpose()?)
    }

    /// Opens the log.
    pub(crate) fn open(&self) -> Result<Log, Error> {
        let recordings = self.log.iter().filter(|path| is_recording(path)).count();
        if recordings == self.log.len() {
            return Ok(Log::recordings(&self.log)?);
        }
        if recordings > 0 {
            return Err(Error::Usage("recordings and text logs cannot be read as one log".to_owned()));
        }
        let mapping = self.mapping.as_deref();
        let mapping = mapping.ok_or_else(|| Error::Usage("a text log needs --mapping".to_owned()))?;
        let unit = match self.serial()? {
            Some(unit) => unit,
            None => isotherm_log::offline::unit_id("UNIT")?,
        };
        let mapping = Mapping::load(mapping)?;
        let options = TextOptions {
            mapping: &mapping,
            unit: &unit,
            batch_ticks: 512,
            start: Span::ZERO,
            duration: None,
        };
        Ok(Log::text(&self.log, options)?)
    }

    /// Reads all of the unit.
    pub(crate) fn read(&self) -> Result<Series, Error> {
        let unit = self.serial()?;
        let mut log = self.open()?;
        let mut bar = bar::Bar::over_log(log.progress());
        let series = Series::read(&mut log, unit.as_ref(), |_| bar.step());
        bar.finish();
        series
    }
}

/// Runs the command that the arguments name.
fn run(cli: Cli) -> Result<(), Error> {
    match cli.command {
        Command::Drift(args) => args.run(),
        Command::Impact(args) => args.run(),
        Command::Completions { shell } => {
            let mut script = Vec::new();
            clap_complete::generate(shell, &mut Cli::command(), "isotherm-calibrate", &mut script);
            print(&script)
        }
    }
}

/// Writes to standard output; a reader that has gone away is no error.
pub(crate) fn print(text: &[u8]) -> Result<(), Error> {
    let mut stdout = io::stdout().lock();
    match stdout.write_all(text).and_then(|()| stdout.flush()) {
        Err(source) if source.kind() != io::ErrorKind::BrokenPipe => Err(Error::Stdout { source }),
        _ => Ok(()),
    }
}

/// Runs the program and maps what came of it to its exit code.
#[must_use]
pub fn main() -> ExitCode {
    match run(Cli::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            let _ = writeln!(io::stderr(), "isotherm-calibrate: {error}");
            ExitCode::from(error.exit_code())
        }
    }
}
