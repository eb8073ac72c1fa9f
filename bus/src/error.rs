//! What can go wrong between a program and Zenoh.

use std::path::PathBuf;
use std::time::Duration;

use isotherm_protocol::codec::CodecError;
use isotherm_protocol::key::UnitId;
use isotherm_protocol::raw::BatchError;
use thiserror::Error;

/// Why something on the bus did not work.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum BusError {
    /// The Zenoh configuration is not valid.
    #[error("cannot use the Zenoh configuration {path}: {words}; `isotherm check {path}` shows the place", path = path.display(), words = words(source))]
    Configuration {
        /// The file.
        path: PathBuf,
        /// What Zenoh says.
        source: zenoh::Error,
    },
    /// The Zenoh configuration file cannot be read.
    #[error("cannot read the Zenoh configuration {}: {source}", path.display())]
    ConfigurationFile {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// An option is not valid, e.g. an endpoint that is none.
    #[error("{option} = {value} is not valid: {words}", words = words(source))]
    Option {
        /// Name of the option.
        option: &'static str,
        /// Its value, as JSON.
        value: String,
        /// What Zenoh says.
        source: zenoh::Error,
    },
    /// An endpoint is none.
    #[error("{option} is {value:?}, {reason}")]
    Endpoint {
        /// Where it was given.
        option: &'static str,
        /// The endpoint.
        value: String,
        /// What it must be.
        reason: String,
    },
    /// The user's file is bad, one problem per line.
    #[error("{}", .0.join("\n"))]
    UserFile(Vec<String>),
    /// An endpoint cannot be listened on.
    #[error("cannot listen on {endpoint}: {reason}")]
    Listen {
        /// The endpoint.
        endpoint: String,
        /// Why, and what to do.
        reason: String,
    },
    /// No endpoint can be reached.
    #[error("cannot reach a service at {}; {next}", reasons.join("; "))]
    Unreachable {
        /// Each endpoint, and why.
        reasons: Vec<String>,
        /// What to do.
        next: String,
    },
    /// The session cannot be opened.
    #[error("cannot open the Zenoh session: {words}", words = words(.0))]
    Open(#[source] zenoh::Error),
    /// A publisher, subscriber or querier cannot be declared.
    #[error("cannot declare {key}: {words}", words = words(source))]
    Declare {
        /// The key.
        key: String,
        /// What Zenoh says.
        source: zenoh::Error,
    },
    /// A message cannot be handed to Zenoh.
    #[error("cannot publish on {key}: {words}", words = words(source))]
    Put {
        /// The key.
        key: String,
        /// What Zenoh says.
        source: zenoh::Error,
    },
    /// A message cannot be encoded.
    #[error("cannot encode a message for {key}: {source}")]
    Encode {
        /// The key.
        key: String,
        /// What the codec says.
        source: CodecError,
    },
    /// A batch that no frame can carry.
    #[error("unit {unit}: {source}")]
    Batch {
        /// Serial of the unit.
        unit: UnitId,
        /// Which, and why.
        source: BatchError,
    },
    /// An option of the producer is outside its range.
    #[error("{option} is {got}, must be {min} to {max}")]
    Range {
        /// Name of the option.
        option: &'static str,
        /// Its value.
        got: u64,
        /// Smallest value allowed.
        min: u64,
        /// Largest value allowed.
        max: u64,
    },
    /// Nobody subscribed to a raw topic in time.
    #[error(
        "nobody subscribes to {key} after {}: check that the service runs and is connected to this session",
        seconds(*waited)
    )]
    NoSubscriber {
        /// The key.
        key: String,
        /// How long was waited.
        waited: Duration,
    },
    /// The service did not answer in time.
    #[error(
        "no service{} answers on {key} within {}: start one there, check --namespace, or give its address with \
         --connect HOST:PORT or ISOTHERM_CONNECT",
        at(peers), seconds(*waited)
    )]
    NoService {
        /// The key.
        key: String,
        /// Addresses that the session is connected to.
        peers: Vec<String>,
        /// How long was waited.
        waited: Duration,
    },
    /// The service has gone while it was needed.
    #[error(
        "the service at {tried} is gone: it has stopped, or the connection to it is lost; see `isotherm status`"
    )]
    ServiceGone {
        /// Where it was.
        tried: String,
    },
    /// Nothing comes back on the corrected topic.
    #[error(
        "unit {unit}: nothing came back on {key} for {} while {in_flight} ticks were in flight: the service \
         holds the unit (uncalibrated = \"hold\"), has stopped, or refuses its messages; see its log and the unit's \
         status",
        seconds(*waited)
    )]
    NoAcknowledgement {
        /// Serial of the unit.
        unit: UnitId,
        /// The key.
        key: String,
        /// How long nothing came.
        waited: Duration,
        /// Ticks sent and not come back.
        in_flight: u64,
    },
    /// A subscriber has not taken what was published for it.
    #[error(
        "a subscriber has not read everything within {} ({key}): it, or the link to it, is slow or hangs",
        seconds(*waited)
    )]
    NotTaken {
        /// Key expression of the receipts.
        key: &'static str,
        /// How long was waited.
        waited: Duration,
    },
    /// The session did not close in time; it is left to itself.
    #[error("the Zenoh session did not close within {}", seconds(*.0))]
    CloseTimeout(Duration),
    /// The session did not close in order.
    #[error("cannot close the Zenoh session: {words}", words = words(.0))]
    Close(#[source] zenoh::Error),
}

impl BusError {
    /// Whether a configuration file is to blame, rather than the network or the command line.
    #[must_use]
    pub fn is_configuration(&self) -> bool {
        matches!(self, Self::Configuration { .. } | Self::UserFile(_))
    }

    /// Whether the command line is.
    #[must_use]
    pub fn is_usage(&self) -> bool {
        matches!(self, Self::Option { .. } | Self::Endpoint { .. } | Self::Range { .. })
    }
}

/// A time for people: `5.0 s`, `500 ms`.
pub(crate) fn seconds(time: Duration) -> String {
    let ms = time.as_millis();
    if ms < 1000 { format!("{ms} ms") } else { format!("{:.1} s", time.as_secs_f64()) }
}

/// Where somebody was looked for, in words.
fn at(peers: &[String]) -> String {
    if peers.is_empty() { String::new() } else { format!(" at {}", peers.join(", ")) }
}

/// What Zenoh says, on one line, without the places in Zenoh's own source that it names in between.
#[must_use]
pub fn words(error: &zenoh::Error) -> String {
    Json5Problem::of(error).message
}

/// What is wrong with a text that Zenoh was given.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Json5Problem {
    /// Line and column, from 1, where they are known.
    pub place: Option<(usize, usize)>,
    /// What is wrong.
    pub message: String,
}

impl Json5Problem {
    /// Reads what Zenoh says: a `Message { msg: "…", location: … }`, or a place with an excerpt of the text below it.
    #[must_use]
    pub fn of(error: &zenoh::Error) -> Self {
        let text = without_places(&error.to_string());
        let number = |text: &str| {
            text.trim_start().chars().take_while(char::is_ascii_digit).collect::<String>().parse().ok()
        };
        if let Some((_, rest)) = text.split_once("Message { msg: \"") {
            let (message, location) = rest.split_once("\", location: ").unwrap_or((rest, ""));
            let column = |rest: &str| rest.split_once("column: ").and_then(|(_, column)| number(column));
            let place =
                location.split_once("line: ").and_then(|(_, rest)| Some((number(rest)?, column(rest)?)));
            let message = message.replace("\\\"", "\"");
            return Self { place, message: message.trim_end_matches('.').to_owned() };
        }
        if let Some((_, rest)) = text.split_once("--> ") {
            let place = rest.split_once(':').and_then(|(line, rest)| Some((number(line)?, number(rest)?)));
            // The parser quotes the whole line, however long, and whatever is in it; its own words stand behind the last `=`.
            let message = rest.rsplit_once("= ").map_or(rest, |(_, message)| message);
            let message = message.split_whitespace().collect::<Vec<_>>().join(" ");
            return Self { place, message: message.trim_end_matches('.').to_owned() };
        }
        Self { place: None, message: text.split_whitespace().collect::<Vec<_>>().join(" ") }
    }
}

/// A text of Zenoh's without the places in its source: "no luck at /a/b.rs:388." is "no luck.".
#[must_use]
pub fn without_places(text: &str) -> String {
    let mut kept = String::with_capacity(text.len());
    let mut rest = text;
    while let Some((before, place)) = rest.split_once(" at ") {
        kept.push_str(before);
        let end = place.find(char::is_whitespace).unwrap_or(place.len());
        let (place, after) = place.split_at(end);
        let line = place.rsplit_once(".rs:").map(|(_, line)| line);
        match line {
            // What stands behind the line number closes a bracket or a sentence.
            Some(line) => kept.push_str(line.trim_start_matches(|c: char| c.is_ascii_digit())),
            None => kept.extend([" at ", place]),
        }
        rest = after;
    }
    kept.push_str(rest);
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_wrong_with_a_text_is_told_without_its_wrapping() {
        let option = zenoh::Config::default().insert_json5("namespace", "\"a//b\"").unwrap_err();
        let word = zenoh::Config::from_json5("{\n  mode: \"peerx\" }").unwrap_err();
        let syntax = zenoh::Config::from_json5("{bad: ").unwrap_err();
        insta::assert_debug_snapshot!([option, word, syntax].map(|error| Json5Problem::of(&error)));
    }

    #[test]
    fn places_in_foreign_source_are_left_out() {
        for (text, expected) in [
            ("no luck at /a/b-1.2/src/c.rs:388.", "no luck."),
            (
                "x: [in use (os error 98) at /a/tcp.rs:61.] at /a/unicast.rs:338.",
                "x: [in use (os error 98).].",
            ),
            ("met at noon at /a.rs:1", "met at noon"),
            ("plain", "plain"),
        ] {
            assert_eq!(words(&text.into()), expected);
        }
    }
}
