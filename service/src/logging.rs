//! Structured logs on stderr.

use std::io::{self, IsTerminal, Write};

use clap::{Args, ValueEnum};
use tracing_subscriber::EnvFilter;

use crate::words::coloured;

/// Zenoh warns of every peer without gossip, which here is how peers are meant to be.
const QUIET_ZENOH: &str =
    "zenoh=warn,zenoh_transport=warn,zenoh_link_commons=warn,zenoh::net::routing::hat::peer=error";

/// Standard error, for events: each is one line, whatever is in it. What a file name or a document has of line breaks,
/// control characters and marks of direction is shown by its code.
struct Lines;

impl Write for Lines {
    fn write(&mut self, event: &[u8]) -> io::Result<usize> {
        let text = String::from_utf8_lossy(event);
        let (text, end) = text.strip_suffix('\n').map_or((&*text, ""), |line| (line, "\n"));
        // An event comes as a whole; of its line breaks only the last is its own.
        let line = coloured(text).replace('\n', "\\n").replace('\t', "\\t") + end;
        io::stderr().write_all(line.as_bytes())?;
        Ok(event.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        io::stderr().flush()
    }
}

/// How the log is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum LogFormat {
    /// A line of text per event.
    Human,
    /// A JSON object per event.
    Json,
}

/// Options of the log.
#[derive(Debug, Clone, Args)]
pub struct LogArgs {
    /// Form of the log on stderr
    #[arg(long, value_enum, default_value = "human", value_name = "FORM")]
    pub log_format: LogFormat,
    /// What is logged: a level (error, warn, info, debug, trace), or filters such as info,zenoh=debug
    #[arg(long, env = "ISOTHERM_LOG", default_value = "info", value_name = "FILTER")]
    pub log_level: String,
}

impl LogArgs {
    /// Warnings only, unless the environment says otherwise: for commands that have no options for it.
    pub(crate) fn quiet() -> Self {
        let log_level = std::env::var("ISOTHERM_LOG").unwrap_or_else(|_| "warn".to_owned());
        Self { log_format: LogFormat::Human, log_level }
    }

    /// Nothing, unless the environment says otherwise: for commands that say themselves what went wrong.
    pub(crate) fn silent() -> Self {
        let log_level = std::env::var("ISOTHERM_LOG").unwrap_or_else(|_| "off,zenoh=off".to_owned());
        Self { log_format: LogFormat::Human, log_level }
    }

    /// Starts logging; a second start in one process changes nothing.
    ///
    /// # Errors
    /// What is wrong with the filter, in words.
    pub fn start(&self) -> Result<(), String> {
        // Zenoh reports at "info" what concerns its developers; whoever names it in a filter gets it.
        let directives = if self.log_level.contains("zenoh") {
            self.log_level.clone()
        } else {
            format!("{},{QUIET_ZENOH}", self.log_level)
        };
        let filter = EnvFilter::try_new(directives).map_err(|error| {
            format!("log filter {:?} (--log-level, ISOTHERM_LOG): {error}", self.log_level)
        })?;
        let builder = tracing_subscriber::fmt()
            .with_env_filter(filter)
            .with_writer(|| Lines)
            // It would be told on stderr itself, with a panic: a full disk must not stop the service for its log.
            .log_internal_errors(false)
            .with_ansi(io::stderr().is_terminal());
        // An error means that somebody in this process logs already.
        let _ = match self.log_format {
            LogFormat::Human => builder.with_target(false).try_init(),
            LogFormat::Json => builder.json().flatten_event(true).try_init(),
        };
        Ok(())
    }
}
