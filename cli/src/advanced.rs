//! `--help` with the options that most calls need, `--help-advanced` with all of them, for every command of a program.

use std::io;

use clap::error::{ContextKind, ContextValue, ErrorKind};
use clap::{Arg, ArgAction, Command, CommandFactory, Error, FromArgMatches};

use crate::exit::Exit;
use crate::stderr::{PROGRAM, failed};

/// Reads the command line of a program; options with `hide_short_help` are rare ones.
#[must_use]
pub fn parse<P: CommandFactory + FromArgMatches>() -> P {
    let mut command = command::<P>();
    // A second command line in one process is a test's.
    let _ = PROGRAM.set(command.get_name().to_owned());
    let matches = command.clone().try_get_matches();
    // An argument that is no text is none of a command's name.
    let arguments = std::env::args_os().filter_map(|argument| argument.into_string().ok());
    let matches = matches.unwrap_or_else(|error| end(&listing_commands(error, &command, arguments)));
    P::from_arg_matches(&matches).unwrap_or_else(|error| end(&error.format(&mut command)))
}

/// Prints help or what is wrong with a command line, and ends the program.
fn end(error: &Error) -> ! {
    let code = match error.print() {
        Err(full) if !error.use_stderr() && full.kind() != io::ErrorKind::BrokenPipe => {
            failed(format_args!("cannot write to standard output: {full}"), Exit::Failed) as i32
        }
        _ => error.exit_code(),
    };
    std::process::exit(code)
}

/// The command line with both kinds of help.
#[must_use]
pub fn command<P: CommandFactory>() -> Command {
    with_help(P::command())
}

/// An error about a command that there is not, with those that there are.
fn listing_commands(mut error: Error, command: &Command, arguments: impl Iterator<Item = String>) -> Error {
    let within = arguments.fold(command, |command, name| command.find_subcommand(name).unwrap_or(command));
    let names: Vec<_> = within.get_subcommands().map(Command::get_name).collect();
    // Behind a positional argument, clap takes it for one argument too many.
    let kinds = [ErrorKind::InvalidSubcommand, ErrorKind::UnknownArgument];
    let is_option =
        error.get(ContextKind::InvalidArg).is_some_and(|given| given.to_string().starts_with('-'));
    if kinds.contains(&error.kind()) && !is_option && !names.is_empty() {
        let words = format!("the commands are {}", names.join(", "));
        error.insert(ContextKind::Suggested, ContextValue::StyledStrs(vec![words.into()]));
    }
    error
}

fn with_help(command: Command) -> Command {
    let names: Vec<String> = command.get_subcommands().map(|sub| sub.get_name().to_owned()).collect();
    let command = names.into_iter().fold(command, |command, name| command.mut_subcommand(name, with_help));
    // A command that hands all its arguments on has no help of its own.
    if command.is_disable_help_flag_set() {
        return command;
    }
    let rare = command.get_arguments().any(Arg::is_hide_short_help_set);
    let help = Arg::new("help").short('h').long("help").action(ArgAction::HelpShort).help("Print help");
    let all = Arg::new("help-advanced").long("help-advanced").action(ArgAction::HelpLong);
    // Where no option is rare, it is taken and says the same.
    let all = all.help("Print help with rare options").hide(!rare);
    command.disable_help_flag(true).arg(help).arg(all)
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::*;

    #[derive(Debug, Parser)]
    #[command(name = "program")]
    struct Cli {
        #[command(subcommand)]
        command: Sub,
    }

    #[derive(Debug, clap::Subcommand)]
    enum Sub {
        /// Orders something
        Order {
            unit: String,
            #[command(subcommand)]
            action: Action,
        },
        /// Does something
        Run {
            /// How often
            #[arg(long)]
            often: bool,
            /// How rarely
            #[arg(long, hide_short_help = true)]
            rarely: bool,
        },
    }

    #[derive(Debug, clap::Subcommand)]
    enum Action {
        Rest,
        Go,
    }

    #[test]
    fn rare_options_are_in_the_advanced_help_alone() {
        let help = |flag: &str| {
            command::<Cli>().try_get_matches_from(["program", "run", flag]).unwrap_err().to_string()
        };
        for flag in ["-h", "--help"] {
            let text = help(flag);
            assert!(text.contains("--often") && text.contains("--help-advanced"), "{text}");
            assert!(!text.contains("--rarely"), "{text}");
        }
        assert!(help("--help-advanced").contains("--rarely"));
        let order = command::<Cli>().try_get_matches_from(["program", "order", "--help-advanced"]);
        let order = order.unwrap_err();
        assert!(order.kind() == ErrorKind::DisplayHelp && !order.to_string().contains("advanced"), "{order}");
        command::<Cli>().debug_assert();
    }

    #[test]
    fn an_unknown_command_is_told_those_that_there_are() {
        let told = |arguments: &[&str]| {
            let arguments = [&["program"], arguments].concat().into_iter().map(str::to_owned);
            let command = command::<Cli>();
            let error = command.clone().try_get_matches_from(arguments.clone()).unwrap_err();
            listing_commands(error, &command, arguments).to_string()
        };
        let wrong = [&["stop"][..], &["order", "A-1", "stop"], &["--stop"], &["run", "stop"]];
        insta::assert_snapshot!(wrong.map(told).join("\n"));
    }
}
