//! The command line: arguments in, exit code out.

mod cat;
mod convert;
mod correct;
mod diff;
mod import;
mod info;
mod list;
mod log_args;
mod play;
mod plot;
mod record;
mod recover;
mod show;
mod simulate;
mod step;

use std::io::Write;
use std::path::Path;

use clap::{Parser, Subcommand};
use isotherm_cli::{Common, Exit, coloured, failed_lines, parse};
use isotherm_log::file::{refuse_overwriting, refuse_replacing};

use crate::error::Error;
use crate::stop::without_traces;
use log_args::LogArgs;

/// Records, plays, corrects, compares, plots, converts and simulates logs.
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
    Record(record::RecordArgs),
    Recover(recover::RecoverArgs),
    Play(play::PlayArgs),
    Correct(correct::CorrectArgs),
    Diff(diff::DiffArgs),
    Step(step::StepArgs),
    Import(import::ImportArgs),
    Info(info::InfoArgs),
    List(list::ListArgs),
    Cat(cat::CatArgs),
    Plot(plot::PlotArgs),
    Convert(convert::ConvertArgs),
    Simulate(simulate::SimulateArgs),
    #[command(flatten)]
    Common(Common),
}

/// Runs the command that the arguments name.
fn run(cli: Cli) -> Result<Exit, Error> {
    if let Command::Correct(_) | Command::Convert(_) | Command::Simulate(_) = &cli.command {
        without_traces()?;
    }
    match cli.command {
        Command::Record(args) => record::run(&args),
        Command::Recover(args) => recover::run(&args),
        Command::Play(args) => play::run(&args),
        Command::Correct(args) => correct::run(&args),
        Command::Diff(args) => diff::run(&args),
        Command::Step(args) => step::run(&args),
        Command::Import(args) => import::run(&args),
        Command::Info(args) => info::run(&args),
        Command::List(args) => list::run(&args),
        Command::Cat(args) => cat::run(&args),
        Command::Plot(args) => plot::run(&args),
        Command::Convert(args) => convert::run(&args),
        Command::Simulate(args) => simulate::run(&args),
        Command::Common(common) => Ok(common.run::<Cli>()),
    }
}

/// Writes one of many results; what nobody reads any more ends the command.
fn put(stdout: &mut impl Write, text: &str) -> Result<(), Error> {
    stdout.write_all(coloured(text).as_bytes()).map_err(Error::Stdout)
}

/// Refuses outputs that would fall on an input or on one another, and those that are there already unless they may be replaced.
fn check_outputs<'a>(
    outputs: impl IntoIterator<Item = &'a Path>,
    inputs: impl IntoIterator<Item = &'a Path>,
    overwrite: bool,
) -> Result<(), Error> {
    let mut others: Vec<_> = inputs.into_iter().collect();
    for output in outputs {
        refuse_overwriting(output, &others)?;
        refuse_replacing(output, overwrite)?;
        others.push(output);
    }
    Ok(())
}

/// Runs the program and says how it ended.
#[must_use]
pub fn main() -> Exit {
    match run(parse()) {
        Ok(exit) => exit,
        Err(error) if error.is_reader_gone() => Exit::Ok,
        Err(error) => failed_lines(&error, error.exit()),
    }
}
