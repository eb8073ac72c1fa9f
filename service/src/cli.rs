//! The commands.

use std::ffi::OsString;
use std::os::unix::process::CommandExt;
use std::path::PathBuf;

use clap::{Args, Parser, Subcommand};
use isotherm_document::advanced;
use isotherm_document::program::Common;

use crate::check::CheckArgs;
use crate::demo::DemoArgs;
use crate::exit::Exit;
use crate::logging::{FinishLog, LogArgs, start_writer};
use crate::observe::web::WebArgs;
use crate::operator::{self, CommandArgs, Console, HistoryArgs, RollbackArgs, StatusArgs, SwapArgs, TopArgs};
use crate::signing::{KeygenArgs, SignArgs};
use crate::words::{print, say};

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
    /// Show what units and services are doing, once
    Status(StatusArgs),
    /// Show what units are doing, live
    Top(TopArgs),
    /// Swap a unit's calibration: show the difference, ask, swap
    Swap(SwapArgs),
    /// Go back to an earlier calibration
    Rollback(RollbackArgs),
    /// Show a unit's calibrations and commands: what, when, by whom
    History(HistoryArgs),
    /// Command a unit: standby, run, self-test, pre-launch calibration, rest
    #[command(name = "command")]
    Give(CommandArgs),
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
        say(format_args!("isotherm: cannot run {}: {error}; install it beside isotherm", program.display()));
        Exit::Failed
    }
}

/// Arguments of `serve`.
#[derive(Debug, Clone, Args)]
#[command(after_help = "\
Examples:
  isotherm serve --config config/service.toml
  isotherm serve --calibration config/calibration
  isotherm serve --calibration units --listen 127.0.0.1:0 --announce | head -1

Without a configuration it listens where the other commands look for it, on 127.0.0.1:7447.")]
pub struct ServeArgs {
    /// Service configuration (TOML)
    #[arg(long, value_name = "FILE")]
    pub config: Option<PathBuf>,
    /// Folder of calibration documents (default: as configured)
    #[arg(long = "calibration", alias = "calibrations", value_name = "FOLDER")]
    pub calibrations: Option<PathBuf>,
    /// Folder for the audit file and every accepted document (default: as configured)
    #[arg(long, value_name = "FOLDER")]
    pub state: Option<PathBuf>,
    /// Address for metrics and health over HTTP (default: as configured)
    #[arg(long, value_name = "ADDRESS:PORT")]
    pub metrics: Option<std::net::SocketAddr>,
    /// Serve the console in the browser too (default: as configured); `isotherm web` prints its address
    #[arg(long)]
    pub web: bool,
    /// How to reach others; each option replaces the configured one
    #[command(flatten)]
    pub session: isotherm_bus::SessionOptions,
    /// When ready, print one line of JSON on stdout: {"ready":true,"locators":[…],"metrics":"http://…"}
    #[arg(long, hide_short_help = true)]
    pub announce: bool,
    /// When ready, write the same line to this file
    #[arg(long, value_name = "FILE", hide_short_help = true)]
    pub ready_file: Option<PathBuf>,
    /// Print the totals at the end as JSON on stdout instead of a table
    #[arg(long)]
    pub json: bool,
    /// Logging
    #[command(flatten)]
    pub log: LogArgs,
}

/// Runs the command line and says how it ended.
#[must_use]
pub fn run() -> Exit {
    match advanced::parse::<Cli>().command {
        Command::Log(sibling) => sibling.exec("isotherm-replay"),
        Command::Calibrate(sibling) => sibling.exec("isotherm-calibrate"),
        Command::Serve(args) => unheld(&args.log.clone(), crate::serve::run(args)),
        Command::Status(args) => operate(Console::Status(args)),
        Command::Top(args) => operate(Console::Top(args)),
        Command::Swap(args) => operate(Console::Swap(args)),
        Command::Rollback(args) => operate(Console::Rollback(args)),
        Command::History(args) => operate(Console::History(args)),
        Command::Give(args) => operate(Console::Command(args)),
        Command::Web(args) => crate::observe::web::show(&args),
        Command::Check(args) => crate::check::run(&args),
        Command::Sign(args) => crate::signing::sign(&args),
        Command::Keygen(args) => crate::signing::keygen(&args),
        Command::Demo(args) => unheld(&LogArgs::quiet(), demo(args)),
        Command::Common(common) => match common.run::<Cli>() {
            Ok(printed) => print(&String::from_utf8_lossy(&printed), Exit::Ok),
            Err((folder, error)) => {
                say(format_args!("isotherm: cannot write manual pages into {}: {error}", folder.display()));
                Exit::Failed
            }
        },
    }
}

async fn demo(args: DemoArgs) -> Exit {
    crate::demo::run(args).await.unwrap_or_else(|error| {
        say(format_args!("isotherm: {error}"));
        Exit::Failed
    })
}

/// Runs a command of the operator's side.
fn operate(console: Console) -> Exit {
    logged(&LogArgs::silent(), operator::run(console))
}

/// Runs a command that a blocked stderr must not hold up: what it says there goes through a queue.
pub fn unheld(log: &LogArgs, command: impl Future<Output = Exit>) -> Exit {
    // However this ends, by a panic too.
    let _finish = FinishLog;
    if let Err(error) = start_writer() {
        say(format_args!("isotherm: cannot start the thread of the log: {error}"));
        return Exit::Failed;
    }
    logged(log, command)
}

/// Runs a command that logs and needs a runtime.
fn logged(log: &LogArgs, command: impl Future<Output = Exit>) -> Exit {
    if let Err(words) = log.start() {
        say(format_args!("isotherm: {words}"));
        return Exit::Usage;
    }
    let runtime = match tokio::runtime::Builder::new_multi_thread().worker_threads(2).enable_all().build() {
        Ok(runtime) => runtime,
        Err(error) => {
            say(format_args!("isotherm: cannot start the runtime: {error}"));
            return Exit::Failed;
        }
    };
    let exit = runtime.block_on(command);
    // A stop that was cut short may have left something hanging: it must not hold the process up.
    runtime.shutdown_background();
    exit
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
