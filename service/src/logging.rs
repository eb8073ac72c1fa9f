//! Structured logs on stderr.

use std::io::{self, IsTerminal, Write};

use clap::{Args, ValueEnum};
use isotherm_cli::stderr::{queue_lines, to_stderr};
use isotherm_cli::{Exit, coloured, failed};
use tracing_subscriber::EnvFilter;
use tracing_subscriber::filter::LevelFilter;

/// Zenoh warns of every peer without gossip, which here is how peers are meant to be.
const QUIET_ZENOH: &str =
    "zenoh=warn,zenoh_transport=warn,zenoh_link_commons=warn,zenoh::net::routing::hat::peer=error";

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
    #[must_use]
    pub fn quiet() -> Self {
        Self::unless_said("warn")
    }

    /// Nothing, unless the environment says otherwise: for commands that say themselves what went wrong.
    #[must_use]
    pub fn silent() -> Self {
        Self::unless_said("off,zenoh=off")
    }

    fn unless_said(level: &str) -> Self {
        let said = std::env::var("ISOTHERM_LOG").ok().filter(|said| !said.trim().is_empty());
        let log_level = said.unwrap_or_else(|| level.to_owned());
        Self { log_format: LogFormat::Human, log_level }
    }

    /// Starts logging; a second start in one process changes nothing.
    ///
    /// # Errors
    /// What is wrong with the filter, in words.
    pub fn start(&self) -> Result<(), String> {
        let filter = directives(&self.log_level)
            .and_then(|directives| EnvFilter::try_new(directives).map_err(|error| error.to_string()));
        let filter = filter.map_err(|words| {
            format!("log filter {:?} (--log-level, ISOTHERM_LOG): {words}", self.log_level)
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

/// What targets of events begin with.
const TARGETS: [&str; 2] = ["isotherm", "zenoh"];

/// The filter that was asked for, with a level for everything that it does not name: a filter of targets alone would silence the rest.
///
/// # Errors
/// A word that is neither a level nor a target, in words: it would silence everything.
fn directives(filter: &str) -> Result<String, String> {
    let given = || filter.split(',').map(str::trim).filter(|directive| !directive.is_empty());
    let is_level = |directive: &str| directive.parse::<LevelFilter>().is_ok();
    let is_target = |word: &str| word.starts_with('[') || TARGETS.iter().any(|known| word.starts_with(known));
    let mut words = given().filter(|directive| !directive.contains('=') && !is_level(directive));
    if let Some(word) = words.find(|word| !is_target(word)) {
        return Err(format!("{word:?} is no level: error, warn, info, debug, trace or off"));
    }
    let level = if given().any(is_level) { "" } else { "info" };
    // Zenoh reports at "info" what concerns its developers; whoever names it in a filter gets it.
    let zenoh = if filter.contains("zenoh") { "" } else { QUIET_ZENOH };
    let all = std::iter::once(level).chain(given()).chain([zenoh]);
    Ok(all.filter(|directive| !directive.is_empty()).collect::<Vec<_>>().join(","))
}

/// Runs a command that a blocked stderr must not hold up: what it says there goes through a queue.
pub fn unheld(log: &LogArgs, command: impl Future<Output = Exit>) -> Exit {
    let report = |count| {
        tracing::warn!(count, "log lines were dropped: stderr was blocked (a stopped terminal, a full pipe)");
    };
    // Drained however this ends, by a panic too.
    match queue_lines(report) {
        Ok(_drained) => logged(log, command),
        Err(error) => failed(format_args!("cannot start the thread of the log: {error}"), Exit::Failed),
    }
}

/// Runs a command that logs and needs a runtime.
pub fn logged(log: &LogArgs, command: impl Future<Output = Exit>) -> Exit {
    if let Err(words) = log.start() {
        return failed(words, Exit::Usage);
    }
    let runtime = match tokio::runtime::Builder::new_multi_thread().worker_threads(2).enable_all().build() {
        Ok(runtime) => runtime,
        Err(error) => return failed(format_args!("cannot start the runtime: {error}"), Exit::Failed),
    };
    let exit = runtime.block_on(command);
    // A stop that was cut short may have left something hanging: it must not hold the process up.
    runtime.shutdown_background();
    exit
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_filter_silences_what_it_does_not_name() {
        for (filter, expected) in [
            ("", Some("info,zenoh=warn")),
            (" , ", Some("info,zenoh=warn")),
            (" warn ", Some("warn,zenoh=warn")),
            ("off,zenoh=off", Some("off,zenoh=off")),
            ("zenoh=debug", Some("info,zenoh=debug")),
            ("isotherm_service=trace", Some("info,isotherm_service=trace,zenoh=warn")),
            ("DEBUG, zenoh", Some("DEBUG,zenoh")),
            ("warning", None),
            ("info,verbose", None),
        ] {
            let quiet = QUIET_ZENOH.split_once(',').unwrap().1;
            let found = directives(filter).map(|found| found.replace(&format!(",{quiet}"), ""));
            assert_eq!(found.ok().as_deref(), expected, "{filter:?}");
        }
    }

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
