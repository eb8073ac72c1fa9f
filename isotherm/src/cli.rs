//! The commands.

use std::ffi::OsString;
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};

use clap::{Args, Parser, Subcommand};
use isotherm_cli::{Common, Exit, failed, parse, print, say};
use isotherm_demo::DemoArgs;
use isotherm_operator::{HistoryArgs, Operation};
use isotherm_service::check::{self, CheckArgs};
use isotherm_service::logging::{LogArgs, logged, unheld};
use isotherm_service::observe::web::{self, WebArgs};
use isotherm_service::serve::{self, ServeArgs};
use isotherm_service::signing::{self, KeygenArgs, SignArgs};

/// Corrects the raw increments of inertial units in a stream, over Zenoh
#[derive(Debug, Parser)]
#[command(name = "isotherm", version, arg_required_else_help = true, after_help = EXIT_CODES)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

const EXIT_CODES: &str = "\
Exit codes:
  0   done
  1   failed
  2   usage
  3   finished, but data was lost
  78  a configuration or calibration document is bad or refused";

#[derive(Debug, Subcommand)]
enum Command {
    /// Correct raw topics until stopped
    Serve(ServeArgs),
    #[command(flatten)]
    Operate(Operation),
    /// Print the address and token of the console in the browser
    Web(WebArgs),
    /// Validate calibration documents, service configurations and Zenoh configurations
    Check(CheckArgs),
    /// Sign calibration documents
    Sign(SignArgs),
    /// Make a key pair for signing calibration documents
    Keygen(KeygenArgs),
    /// Correct three simulated units: a live table and a report
    Demo(DemoArgs),
    /// Record, replay, correct, plot, convert logs: isotherm-replay
    #[command(disable_help_flag = true)]
    Log(Sibling),
    /// Fit and judge calibration documents: isotherm-calibrate
    #[command(disable_help_flag = true)]
    Calibrate(Sibling),
    #[command(flatten)]
    Common(Common),
}

/// Arguments for another program.
#[derive(Debug, Args)]
struct Sibling {
    /// Its arguments, as it takes them
    #[arg(value_name = "ARGUMENT", trailing_var_arg = true, allow_hyphen_values = true)]
    arguments: Vec<OsString>,
}

impl Sibling {
    /// Goes on as the program of this name: the one beside this one, else the one in the path.
    fn exec(&self, name: &str) -> Exit {
        let beside = std::env::current_exe().ok().and_then(|own| Some(own.parent()?.join(name)));
        let program = beside.filter(|path| path.is_file()).unwrap_or_else(|| PathBuf::from(name));
        let error = std::process::Command::new(&program).args(&self.arguments).exec();
        let program = program.display();
        failed(format_args!("cannot run {program}: {error}; install it beside isotherm"), Exit::Failed)
    }
}

/// Runs the command line and says how it ended.
#[must_use]
pub(crate) fn run() -> Exit {
    match parse::<Cli>().command {
        Command::Log(sibling) => sibling.exec("isotherm-replay"),
        Command::Calibrate(sibling) => sibling.exec("isotherm-calibrate"),
        Command::Serve(args) => unheld(&args.log.clone(), serve::run(args)),
        Command::Operate(Operation::History(args)) if args.verify.is_some() => verify(&args),
        Command::Operate(operation) => logged(&LogArgs::silent(), operation.run()),
        Command::Web(args) => web::show(&args),
        Command::Check(args) => check::run(&args),
        Command::Sign(args) => signing::sign(&args),
        Command::Keygen(args) => signing::keygen(&args),
        Command::Demo(args) => unheld(&LogArgs::quiet(), isotherm_demo::run(args)),
        Command::Common(common) => common.run::<Cli>(),
    }
}

/// Says whether the audit files of a folder are what was written.
fn verify(args: &HistoryArgs) -> Exit {
    let folder = args.verify.as_deref().unwrap_or(Path::new(""));
    let found = match isotherm_service::control::store::verify(folder, args.noted) {
        Ok(found) => found,
        Err(error) => return failed(error, Exit::Failed),
    };
    let exit = if found.holds { Exit::Ok } else { Exit::Failed };
    if args.json {
        return print(&isotherm_cli::json(&found), exit);
    }
    found.breaks.iter().for_each(say);
    found.lost.iter().for_each(say);
    print(&found.to_string(), exit)
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    use super::*;

    #[test]
    fn the_command_line_is_consistent() {
        Cli::command().debug_assert();
    }

    #[test]
    fn the_two_configurations_are_told_apart() {
        let parse =
            |arguments: &[&str]| match Cli::try_parse_from([&["isotherm", "serve"], arguments].concat()) {
                Ok(Cli { command: Command::Serve(args) }) => (args.config, args.session.config),
                other => panic!("{other:?}"),
            };
        let [service, zenoh] = ["s.toml", "z.json5"].map(|path| Some(PathBuf::from(path)));
        assert_eq!(parse(&["--config", "s.toml"]), (service.clone(), None));
        assert_eq!(parse(&["--zenoh-config", "z.json5"]), (None, zenoh.clone()));
        assert_eq!(parse(&["--config", "s.toml", "--zenoh-config", "z.json5"]), (service, zenoh));
    }
}
