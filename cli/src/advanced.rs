//! `--help` with the options that most calls need, `--help-advanced` with all of them, for every command of a program.

use clap::{Arg, ArgAction, Command, CommandFactory, FromArgMatches};

use crate::stderr::PROGRAM;

/// Reads the command line of a program; options with `hide_short_help` are rare ones.
#[must_use]
pub fn parse<P: CommandFactory + FromArgMatches>() -> P {
    let mut command = command::<P>();
    // A second command line in one process is a test's.
    let _ = PROGRAM.set(command.get_name().to_owned());
    let matches = command.clone().get_matches();
    P::from_arg_matches(&matches).unwrap_or_else(|error| error.format(&mut command).exit())
}

/// The command line with both kinds of help.
#[must_use]
pub fn command<P: CommandFactory>() -> Command {
    with_help(P::command())
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
    let command = command.disable_help_flag(true).arg(help);
    if !rare {
        return command;
    }
    let all = Arg::new("help-advanced").long("help-advanced").action(ArgAction::HelpLong);
    command.arg(all.help("Print help with rare options"))
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
        command::<Cli>().debug_assert();
    }
}
