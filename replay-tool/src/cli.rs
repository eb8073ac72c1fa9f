//! The command line: arguments in, exit code out.

mod correct;
mod play;
mod show;
mod simulate;

use std::io::{self, Write};
use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Args, CommandFactory, Parser, Subcommand};
use isotherm_correction::units::Span;

use crate::error::Error;
use isotherm_log::mapping::Mapping;
use isotherm_log::text::{LogReader, Window};

/// Plays recorded logs into the service, corrects them offline, simulates new ones.
#[derive(Debug, Parser)]
#[command(
    name = "isotherm-replay",
    version,
    after_help = "Exit codes: 0 ok, 1 failed, 2 usage, 3 finished with data loss, 78 bad mapping, calibration document or scenario."
)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    Play(play::PlayArgs),
    Correct(correct::CorrectArgs),
    Simulate(simulate::SimulateArgs),
    /// Print a completion script for a shell
    #[command(after_help = "Example:\n  isotherm-replay completions bash > isotherm-replay.bash")]
    Completions {
        /// The shell
        shell: clap_complete::Shell,
    },
}

/// Which log, and which part of it.
#[derive(Debug, Args)]
struct LogArgs {
    /// Files of the log in the order of the mapping, or the folder that has them
    #[arg(required = true, value_name = "LOG")]
    log: Vec<PathBuf>,
    /// Column mapping (TOML); ready ones are in config/mappings
    #[arg(long, short, value_name = "FILE")]
    mapping: PathBuf,
    /// Begin this long after the log's beginning (s)
    #[arg(long, value_name = "SECONDS", default_value = "0", value_parser = seconds)]
    start: Span,
    /// Take this much of the log (s); without it, all
    #[arg(long, value_name = "SECONDS", value_parser = seconds)]
    duration: Option<Span>,
}

impl LogArgs {
    /// Opens the log's part.
    fn open(&self) -> Result<Window<LogReader>, Error> {
        let mapping = Mapping::load(&self.mapping)?;
        Ok(Window::new(LogReader::open(&mapping, &self.log)?, self.start, self.duration))
    }
}

/// Reads seconds.
fn seconds(text: &str) -> Result<Span, String> {
    match text.parse::<f64>() {
        Ok(seconds) if (0.0..=1e9).contains(&seconds) => Ok(Span::from_s(seconds)),
        _ => Err("must be a number of seconds from 0 to 1000000000".into()),
    }
}

/// How a command that ran to its end went.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Outcome {
    /// Everything is there.
    Complete,
    /// Something was lost on the way, and said so.
    DataLoss,
}

/// Runs the command that the arguments name.
fn run(cli: Cli) -> Result<Outcome, Error> {
    match cli.command {
        Command::Play(args) => play::run(args),
        Command::Correct(args) => correct::run(&args),
        Command::Simulate(args) => simulate::run(&args),
        Command::Completions { shell } => {
            let mut script = Vec::new();
            clap_complete::generate(shell, &mut Cli::command(), "isotherm-replay", &mut script);
            print(&script)?;
            Ok(Outcome::Complete)
        }
    }
}

/// Writes to standard output; a reader that has gone away is no error.
fn print(text: &[u8]) -> Result<(), Error> {
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
        Ok(Outcome::Complete) => ExitCode::SUCCESS,
        Ok(Outcome::DataLoss) => ExitCode::from(3),
        Err(error) => {
            let _ = writeln!(io::stderr(), "isotherm-replay: {error}");
            ExitCode::from(error.exit_code())
        }
    }
}
