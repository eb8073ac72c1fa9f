//! The `serve` command: from arguments to a running service, and from a signal to its end.

use std::io::{IsTerminal, Write};
use std::net::SocketAddr;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use clap::Args;
use isotherm_bus::{BoxFuture, SessionOptions};
use isotherm_cli::{Exit, print_within};
use isotherm_document::file::write_over;
use tokio::signal::unix::{SignalKind, signal};
use zenoh::Session;

use crate::config::Settings;
use crate::control::revision::Calibrations;
use crate::logging::LogArgs;
use crate::service::{open_state, start_on, tell_state};
use crate::supervisor;
use crate::{ServiceError, Totals};

/// How long the end waits for a stdout that takes nothing.
const PRINT_LIMIT: Duration = Duration::from_secs(1);

/// How long a session may take to open before it is said what it waits for, and how often it is said again.
const FIRST_WORD: Duration = Duration::from_secs(2);
const FURTHER_WORDS: Duration = Duration::from_secs(60);

/// SIGXFSZ, sent where a write would make a file longer than the process may (`ulimit -f`, `LimitFSIZE=`).
const FILE_TOO_LONG: SignalKind = SignalKind::from_raw(25);

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
    pub metrics: Option<SocketAddr>,
    /// Serve the console in the browser too (default: as configured); `isotherm web` prints its address
    #[arg(long)]
    pub web: bool,
    /// How to reach others; each option replaces the configured one
    #[command(flatten)]
    pub session: SessionOptions,
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

/// Serves until a signal comes.
#[must_use]
pub fn run(args: ServeArgs) -> BoxFuture<'static, Exit> {
    Box::pin(async move {
        let json = args.json;
        match serve(args).await {
            Ok(Some(totals)) => report(&totals, json),
            Ok(None) => {
                tracing::error!("stopped immediately by a second signal");
                Exit::DataLoss
            }
            Err(error) => error.tell(),
        }
    })
}

/// Says what was done.
fn report(totals: &Totals, json: bool) -> Exit {
    let text = if json { serde_json::to_string(totals).unwrap_or_default() } else { totals.table() };
    print_within(PRINT_LIMIT, text + "\n", totals.exit())
}

/// The configuration with the command line's options put over it.
fn settings(args: &ServeArgs) -> Result<Settings, ServiceError> {
    let (calibrations, state) = (args.calibrations.as_ref(), args.state.as_ref());
    let mut settings = Settings::given(args.config.as_deref(), calibrations, state, args.metrics)?;
    settings.web.enabled |= args.web;
    settings.listen_for_web();
    let (configured, given) = (&mut settings.zenoh.session, &args.session);
    if given.config.is_some() {
        configured.config.clone_from(&given.config);
    }
    if !given.connect.is_empty() {
        configured.connect.clone_from(&given.connect);
    }
    if !given.listen.is_empty() {
        configured.listen.clone_from(&given.listen);
    }
    if given.namespace.is_some() {
        configured.namespace.clone_from(&given.namespace);
    }
    configured.listen_by_default();
    // No unit waits for a router or for the other half of a pair.
    configured.keeps_trying = true;
    settings.check_other().map_err(ServiceError::Other)?;
    Ok(settings)
}

/// Runs the service between its start and a signal; `None` where a second signal came before it had stopped.
async fn serve(args: ServeArgs) -> Result<Option<Totals>, ServiceError> {
    let settings = settings(&args)?;
    let mut interrupt = signal(SignalKind::interrupt()).map_err(ServiceError::Thread)?;
    let mut terminate = signal(SignalKind::terminate()).map_err(ServiceError::Thread)?;
    // Caught, it no longer ends the process: the write fails, and is told as on a full disk.
    let _file_too_long = signal(FILE_TOO_LONG).map_err(ServiceError::Thread)?;
    let mut hangup = signal(SignalKind::hangup()).map_err(ServiceError::Thread)?;
    let mut reload = signal(SignalKind::hangup()).map_err(ServiceError::Thread)?;
    // A terminal that is closed ends what runs in it; a daemon is asked to read its documents again.
    let in_terminal = std::io::stdin().is_terminal();
    let mut stop_asked = async || {
        tokio::select! {
            _ = interrupt.recv() => "SIGINT",
            _ = terminate.recv() => "SIGTERM",
            _ = hangup.recv(), if in_terminal => "SIGHUP",
        }
    };

    tell_state(&settings);
    let awaited = settings.zenoh.session.awaited()?;
    let (state, metrics) = open_state(&settings, awaited.clone()).await?;
    let start = async {
        let session = open_session(settings.zenoh.session.clone(), &awaited).await?;
        let locators = isotherm_bus::locators(&session);
        tokio::spawn(tell_connection(session.clone(), settings.zenoh.session.clone()));
        let service = start_on(settings, Calibrations::default(), state, metrics, session).await?;
        Ok::<_, ServiceError>((service, locators))
    };
    let (service, locators) = tokio::select! {
        started = start => started?,
        // There is nothing to flush.
        _ = stop_asked() => return Ok(Some(Totals { stopped_in_time: true, ..Totals::default() })),
    };
    tracing::info!(version = env!("CARGO_PKG_VERSION"), locators = locators.join(" "), "ready");
    announce(&args, &locators, service.metrics())?;
    let ready = format!("correcting, on {}", locators.join(" "));
    supervisor::ready(&ready);
    let pulse = service.pulse();
    // Through the stop too: it has a limit of its own.
    tokio::spawn(supervisor::watch(ready, move || pulse.look()));

    let name = loop {
        tokio::select! {
            name = stop_asked() => break name,
            _ = reload.recv(), if !in_terminal => service.reload(),
        }
    };
    tracing::info!(signal = name, "stopping");
    supervisor::stopping();
    tokio::select! {
        totals = service.stop() => Ok(Some(totals)),
        _ = stop_asked() => Ok(None),
    }
}

/// Opens the session, and says what it waits for where that takes long.
async fn open_session(options: SessionOptions, awaited: &str) -> Result<Session, ServiceError> {
    // A task of its own: opening may hold its thread.
    let mut opening = tokio::spawn(async move { isotherm_bus::open(&options).await });
    let (mut pause, start) = (FIRST_WORD, Instant::now());
    loop {
        match tokio::time::timeout(pause, &mut opening).await {
            Ok(Ok(opened)) => return Ok(opened?),
            Ok(Err(join)) => return Err(ServiceError::Thread(std::io::Error::other(join))),
            Err(_) => {
                let waited_s = start.elapsed().as_secs();
                tracing::warn!(waited_s, "{}", supervisor::waiting_for(awaited));
                pause = FURTHER_WORDS;
            }
        }
    }
}

/// Says that a session is not connected where it is to connect, until it is.
async fn tell_connection(session: Session, options: SessionOptions) {
    let (mut pause, start) = (FIRST_WORD, Instant::now());
    while !session.is_closed() {
        tokio::time::sleep(pause).await;
        // Options that make no sense have opened no session.
        if isotherm_bus::connected(&session, &options, Duration::ZERO).await.unwrap_or(true) {
            break;
        }
        let endpoints = options.connects_to().unwrap_or_default().join(", ");
        let waited_s = start.elapsed().as_secs();
        tracing::warn!(
            waited_s,
            "not connected to {endpoints}: check the address, or start what is to listen there; tried again"
        );
        pause = FURTHER_WORDS;
    }
}

/// Tells scripts that the service is ready and where.
fn announce(args: &ServeArgs, locators: &[String], metrics: Option<SocketAddr>) -> Result<(), ServiceError> {
    let mut ready = serde_json::json!({ "ready": true, "locators": locators });
    if let Some(address) = metrics {
        ready["metrics"] = format!("http://{address}").into();
    }
    let line = ready.to_string();
    if args.announce {
        let mut stdout = std::io::stdout().lock();
        // Nobody reading is nobody waiting.
        let _ = writeln!(stdout, "{line}").and_then(|()| stdout.flush());
    }
    let Some(path) = &args.ready_file else { return Ok(()) };
    write_over(path, (line + "\n").as_bytes())
        .map_err(|source| ServiceError::Write { path: path.clone(), source })
}
