//! Structured logs on stderr.

mod queue;

use std::io::{self, IsTerminal, Write};
use std::sync::OnceLock;
use std::time::Duration;

use clap::{Args, ValueEnum};
use tracing_subscriber::EnvFilter;

use crate::words::coloured;
use queue::Queue;

/// Zenoh warns of every peer without gossip, which here is how peers are meant to be.
const QUIET_ZENOH: &str =
    "zenoh=warn,zenoh_transport=warn,zenoh_link_commons=warn,zenoh::net::routing::hat::peer=error";

/// How long the end of the program waits for a log that takes no line.
const PATIENCE: Duration = Duration::from_millis(500);

/// The lines of this process, once it logs.
static QUEUE: OnceLock<Queue> = OnceLock::new();

/// Puts a line on standard error: through the queue where this process logs, else at once.
pub(crate) fn to_stderr(line: String) {
    match QUEUE.get() {
        Some(queue) => queue.push(line.into_bytes()),
        // Where stderr is gone or full, the exit code says the rest.
        None => drop(io::stderr().write_all(line.as_bytes())),
    }
}

/// Log lines that were dropped because standard error took none.
pub(crate) fn dropped_lines() -> u64 {
    QUEUE.get().map_or(0, Queue::dropped)
}

/// Waits when it is dropped until the log is written, unless nobody takes it.
pub(crate) struct FinishLog;

impl Drop for FinishLog {
    fn drop(&mut self) {
        if let Some(queue) = QUEUE.get() {
            queue.drain(PATIENCE);
        }
    }
}

/// Has lines for standard error go through a queue, and starts the thread that writes it.
///
/// # Errors
/// Where the system gives no thread.
pub(crate) fn start_writer() -> io::Result<()> {
    if QUEUE.get().is_some() {
        return Ok(());
    }
    let write = || {
        let Some(queue) = QUEUE.get() else { return };
        queue.write_to(io::stderr(), |count| {
            tracing::warn!(
                count,
                "log lines were dropped: stderr was blocked (a stopped terminal, a full pipe)"
            );
        });
    };
    // Before the thread, which would end without it.
    let _ = QUEUE.set(Queue::default());
    std::thread::Builder::new().name("isotherm-log".to_owned()).spawn(write)?;
    // A panic is caught where it happens; its words must not wait for stderr either.
    std::panic::set_hook(Box::new(|panic| to_stderr(format!("isotherm: {panic}\n"))));
    Ok(())
}

/// Standard error, for events: each is one line, whatever is in it. What a file name or a document has of line breaks,
/// control characters and marks of direction is shown by its code.
struct Lines;

impl Write for Lines {
    fn write(&mut self, event: &[u8]) -> io::Result<usize> {
        let text = plain(&String::from_utf8_lossy(event));
        let (text, end) = text.strip_suffix('\n').map_or((&*text, ""), |line| (line, "\n"));
        // An event comes as a whole; of its line breaks only the last is its own.
        let line = coloured(text).replace('\n', "\\n").replace('\t', "\\t") + end;
        to_stderr(line);
        Ok(event.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// What Zenoh says of every connection that it cannot accept, whatever the reason.
const WRONG_HINT: &str = " Hint: increase the system open file limit.";
/// What the system says where that is the reason: too many open files, of the process and of the system.
const OPEN_FILES: [&str; 2] = ["os error 24", "os error 23"];

/// An event without what only the developers of a library understand: places in its source, a hint that does not fit.
fn plain(event: &str) -> String {
    let text = isotherm_bus::without_places(event);
    let fits = OPEN_FILES.iter().any(|words| text.contains(words));
    if fits { text } else { text.replace(WRONG_HINT, "") }
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
    /// Log level (error, warn, info, debug, trace), or filters such as info,zenoh=debug
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_library_says_to_its_developers_is_left_out() {
        let refused = "WARN invalid peer certificate: UnknownIssuer at /r/zenoh-link-tls/src/unicast.rs:583.. Hint: increase the \
                       system open file limit.\n";
        assert_eq!(plain(refused), "WARN invalid peer certificate: UnknownIssuer..\n");
        let full = "Too many open files (os error 24). Hint: increase the system open file limit.\n";
        assert_eq!(plain(full), full);
        assert_eq!(plain("INFO ready at noon\n"), "INFO ready at noon\n");
    }
}
