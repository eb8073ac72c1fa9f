//! The command line: arguments in, exit code out.

mod board;
mod diff;
mod drift;
mod driver;
mod files;
mod impact;
mod merge;
mod modes;
mod output;
mod place;
mod positions;
mod rates;
mod runs;
mod show;
mod thermal;
mod tumble;
mod units;
mod validate;

use clap::{Parser, Subcommand};
use isotherm_cli::{Common, Exit, failed_lines, parse};

use crate::error::Error;

/// Makes calibration documents from logs, judges and compares them.
#[derive(Debug, Parser)]
#[command(
    name = "isotherm-calibrate",
    version,
    after_help = "Exit codes: 0 ok, 1 failed, or the data do not allow the fit, 2 usage, 3 finished with data loss, \
                  78 bad mapping or calibration document."
)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    Board(board::BoardArgs),
    Diff(diff::DiffArgs),
    Drift(drift::DriftArgs),
    Impact(impact::ImpactArgs),
    Merge(merge::MergeArgs),
    Modes(modes::ModesArgs),
    Positions(Box<positions::PositionsArgs>),
    Rates(rates::RatesArgs),
    Show(show::ShowArgs),
    Thermal(thermal::ThermalArgs),
    Tumble(tumble::TumbleArgs),
    Validate(validate::ValidateArgs),
    #[command(flatten)]
    Common(Common),
}

/// Runs the command that the arguments name.
fn run(cli: Cli) -> Result<Exit, Error> {
    match cli.command {
        Command::Board(args) => args.run(),
        Command::Diff(args) => args.run(),
        Command::Drift(args) => args.run(),
        Command::Impact(args) => args.run(),
        Command::Merge(args) => args.run(),
        Command::Modes(args) => args.run(),
        Command::Positions(args) => args.run(),
        Command::Rates(args) => args.run(),
        Command::Show(args) => args.run(),
        Command::Thermal(args) => args.run(),
        Command::Tumble(args) => args.run(),
        Command::Validate(args) => args.run(),
        Command::Common(common) => return Ok(common.run::<Cli>()),
    }
    .map(|()| Exit::Ok)
}

/// Runs the program and says how it ended.
pub fn main() -> Exit {
    run(parse()).unwrap_or_else(|error| failed_lines(&error, error.exit()))
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use clap::CommandFactory;
    use isotherm_protocol::document::Document;

    use super::*;

    #[test]
    fn rare_options_are_in_the_advanced_help() {
        let help = |command: &str, flag: &str| {
            let program = isotherm_cli::advanced::command::<Cli>();
            program.try_get_matches_from(["isotherm-calibrate", command, flag]).unwrap_err().to_string()
        };
        for (command, rare) in
            [("thermal", "--fit-window"), ("positions", "--still-rate"), ("merge", "--created")]
        {
            let (short, long) = (help(command, "--help"), help(command, "--help-advanced"));
            assert!(short.contains("--help-advanced") && !short.contains(rare), "{command}: {short}");
            assert!(long.contains(rare) && long.contains("--out"), "{command}: {long}");
        }
    }

    #[test]
    fn every_option_is_explained() {
        let mut all = Cli::command();
        all.build();
        for part in all.get_subcommands() {
            for argument in part.get_arguments() {
                let explained = argument.get_help().is_some() || argument.get_long_help().is_some();
                assert!(explained, "{} {}", part.get_name(), argument.get_id());
            }
        }
    }

    #[test]
    fn the_full_example_names_a_command_and_files_that_there_are() {
        let root = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/.."));
        let text = std::fs::read_to_string(root.join("config/calibration/example-full.toml")).unwrap();
        let origin = Document::parse(&text, None).unwrap().document.origin.unwrap();
        let command = origin.command.unwrap();
        Cli::command().debug_assert();
        let arguments = Cli::try_parse_from(command.split_whitespace()).unwrap();
        assert!(matches!(arguments.command, Command::Thermal(_)), "{command}");
        for file in command.split_whitespace().filter(|word| word.contains('/')) {
            assert!(root.join(file).is_file(), "{file}");
        }
        // The logs are those that the shipped documents rest on.
        let shipped = ["chamber-mems.toml", "rlg-static.toml"].map(|name| {
            let text = std::fs::read_to_string(root.join("config/calibration").join(name)).unwrap();
            Document::parse(&text, None).unwrap().document.origin.unwrap().log
        });
        assert_eq!(origin.log, shipped.concat());
    }
}
