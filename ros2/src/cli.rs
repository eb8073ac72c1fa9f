//! The commands.

use std::path::PathBuf;
use std::time::Duration;

use clap::{Args, Parser, Subcommand};
use isotherm_bus::{ClientOptions, Role, SessionOptions, close, endpoint, locators, open, open_config};
use isotherm_cli::{Common, Exit, failed, parse, print, print_within, say};
use isotherm_service::logging::{LogArgs, unheld};
use isotherm_service::{RunningService, Settings};
use tokio::signal::unix::{SignalKind, signal};
use zenoh::Session;

use crate::check::{self, CheckArgs};
use crate::session::RosOptions;
use crate::totals::Totals;
use crate::{Bridge, Error, Mapping};

/// How long the end waits for a stdout that takes nothing.
const PRINT_LIMIT: Duration = Duration::from_secs(1);
/// How long a service is waited for before the bridge says that it goes on without.
const SERVICE: Duration = Duration::from_secs(5);
/// How long the service may be out of reach at the start.
const REACH: Duration = Duration::from_secs(30);
/// Where the service in this process listens if its configuration does not say.
const ANY_PORT: &str = "tcp/127.0.0.1:0";

#[derive(Debug, Parser)]
#[command(
    name = "isotherm-ros",
    about = "Corrects Imu topics of ROS 2 (rmw_zenoh: jazzy, kilted, lyrical, rolling), without ROS",
    version,
    arg_required_else_help = true,
    after_help = "Exit codes: 0 done, 1 failed, 2 usage, 3 finished, but data was lost, 78 bad mapping, configuration or document."
)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Correct Imu topics until stopped
    Bridge(BridgeArgs),
    /// Validate mappings
    Check(CheckArgs),
    #[command(flatten)]
    Common(Common),
}

/// Arguments of `bridge`.
#[derive(Debug, Clone, Args)]
#[command(after_help = "\
Examples:
  isotherm-ros bridge config/ros2.toml --calibration config/calibration
  isotherm-ros bridge config/ros2.toml --listen 0.0.0.0:7447 --calibration units
  isotherm-ros bridge config/ros2.toml --connect 10.0.0.5:7447 --service 10.0.0.6:7447

The first corrects in this process and joins the router of `ros2 run rmw_zenoh_cpp rmw_zenohd`, the second is the router
itself, the third leaves the correction to `isotherm serve` elsewhere.")]
pub struct BridgeArgs {
    /// Mapping of topics to units (TOML)
    #[arg(value_name = "MAPPING")]
    pub mapping: PathBuf,
    /// The session with ROS 2
    #[command(flatten)]
    pub ros: RosOptions,
    /// Domain of ROS 2
    #[arg(long, env = "ROS_DOMAIN_ID", default_value_t = 0, value_name = "NUMBER")]
    pub domain: u32,
    /// Correct in this process: folder of calibration documents
    #[arg(long, value_name = "FOLDER", conflicts_with = "service")]
    pub calibration: Option<PathBuf>,
    /// Correct in this process: service configuration (TOML)
    #[arg(long, value_name = "FILE", conflicts_with = "service")]
    pub config: Option<PathBuf>,
    /// Correct in this process: folder for the audit file and every accepted document
    #[arg(long, value_name = "FOLDER", conflicts_with = "service")]
    pub state: Option<PathBuf>,
    /// Address of the service that corrects (default: as other commands find it)
    #[arg(long, value_name = "HOST:PORT", value_parser = endpoint)]
    pub service: Vec<String>,
    /// When ready, print one line of JSON on stdout: {"ready":true,"ros":[…],"service":[…]}
    #[arg(long, hide_short_help = true)]
    pub announce: bool,
    /// Print the totals at the end as JSON on stdout instead of a table
    #[arg(long)]
    pub json: bool,
    /// What is logged, and how
    #[command(flatten)]
    pub log: LogArgs,
}

/// Runs the command line and says how it ended.
#[must_use]
pub fn run() -> Exit {
    match parse::<Cli>().command {
        Command::Bridge(args) => unheld(&args.log.clone(), bridge(args)),
        Command::Check(args) => check::run(&args),
        Command::Common(common) => common.run::<Cli>(),
    }
}

async fn bridge(args: BridgeArgs) -> Exit {
    match serve(&args).await {
        Ok(Some(totals)) => {
            let text =
                if args.json { serde_json::to_string(&totals).unwrap_or_default() } else { totals.table() };
            print_within(PRINT_LIMIT, text + "\n", totals.exit())
        }
        Ok(None) => {
            tracing::error!("stopped immediately by a second signal");
            Exit::DataLoss
        }
        Err(error) => {
            error.problems().iter().for_each(say);
            failed(&error, error.exit())
        }
    }
}

/// Bridges between its start and a signal; `None` where a second signal came before it had stopped.
async fn serve(args: &BridgeArgs) -> Result<Option<Totals>, Error> {
    let mapping = Mapping::load(&args.mapping)?;
    let mut interrupt = signal(SignalKind::interrupt()).map_err(Error::Signals)?;
    let mut terminate = signal(SignalKind::terminate()).map_err(Error::Signals)?;
    let mut stop_asked = async || {
        tokio::select! {
            _ = interrupt.recv() => "SIGINT",
            _ = terminate.recv() => "SIGTERM",
        }
    };
    let starting = async {
        let (service, bus) = correct(args).await?;
        let ros = open_config(args.ros.to_config()?).await?;
        Ok::<_, Error>((service, Bridge::start(&mapping, args.domain, ros, bus).await?))
    };
    let (service, bridge) = tokio::select! {
        started = starting => started?,
        // There is nothing to flush.
        _ = stop_asked() => return Ok(Some(Totals::default())),
    };
    if let Err(error) = bridge.wait_for_service(SERVICE).await {
        tracing::warn!("nothing is corrected yet: {error}");
    }
    let of_service = service.as_ref().map(|service| locators(service.session())).unwrap_or_default();
    let (ros, operators) = (bridge.locators().join(" "), of_service.join(" "));
    tracing::info!(version = env!("CARGO_PKG_VERSION"), ros, operators, "ready");
    if args.announce {
        let ready = serde_json::json!({ "ready": true, "ros": bridge.locators(), "service": of_service });
        // Nobody reading is nobody waiting.
        let _ = print(&format!("{ready}\n"), Exit::Ok);
    }
    let name = stop_asked().await;
    tracing::info!(signal = name, "stopping");
    let stopping = async {
        let totals = bridge.stop().await;
        if let Some(service) = service {
            service.stop().await;
        }
        totals
    };
    tokio::select! {
        totals = stopping => Ok(Some(totals)),
        _ = stop_asked() => Ok(None),
    }
}

/// What corrects: a service in this process, if asked for, and a session with it.
async fn correct(args: &BridgeArgs) -> Result<(Option<RunningService>, Session), Error> {
    if args.config.is_none() && args.calibration.is_none() && args.state.is_none() {
        let options = ClientOptions { connect: args.service.clone(), ..ClientOptions::default() };
        let way = options.way(Role::Listener)?;
        return Ok((None, way.open_patiently(REACH, |words| tracing::warn!("{words}")).await?));
    }
    let (calibrations, state) = (args.calibration.as_ref(), args.state.as_ref());
    let mut settings = Settings::given(args.config.as_deref(), calibrations, state, None)?;
    let session = &mut settings.zenoh.session;
    if session.config.is_none() && session.connect.is_empty() && session.listen.is_empty() {
        // The default port is that of the router of ROS 2.
        session.listen = vec![ANY_PORT.to_owned()];
    }
    let namespace = session.namespace.clone();
    let session = open(&settings.zenoh.session).await?;
    let connect = locators(&session);
    let service = match isotherm_service::start(settings, session.clone()).await {
        Ok(service) => service,
        Err(error) => {
            let _ = close(session, Duration::from_secs(1)).await;
            return Err(error.into());
        }
    };
    let options = SessionOptions { connect, namespace, ..SessionOptions::default() };
    Ok((Some(service), open(&options).await?))
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    use super::*;

    #[test]
    fn the_command_line_is_consistent() {
        Cli::command().debug_assert();
    }
}
