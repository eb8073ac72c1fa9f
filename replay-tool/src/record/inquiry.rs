//! Asking services for what a log needs beside the messages.

use std::time::Duration;

use isotherm_bus::BusError;
use isotherm_bus::inquiry::{ask_all, memories};
use isotherm_log::recording::{Attachment, Documents};
use isotherm_protocol::key::{self, UnitId};
use zenoh::Session;
use zenoh::sample::Sample;

use super::queue::{Queue, now_ns};
use super::topics::of_units;

/// Entries of a history that are attached.
const HISTORY_ENTRIES: u32 = 10_000;

/// What is asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Question {
    /// The memory of units.
    Memory,
    /// Everything that a file needs.
    Everything,
}

impl Question {
    /// The keys of the answers, memories first.
    const fn keys(self) -> &'static [&'static str] {
        match self {
            Self::Memory => &[key::ALL_JOURNALS],
            Self::Everything => {
                &[key::ALL_JOURNALS, key::ALL_CALIBRATION, key::ALL_CONFIGURATIONS, key::ALL_HISTORY]
            }
        }
    }
}

/// Asks for the memory of units, and with [`Question::Everything`] for their documents and histories and the configurations
/// of services; what was not answered in time, in words.
pub(super) async fn ask(
    session: &Session,
    question: Question,
    units: &[UnitId],
    limit: Duration,
    queue: &Queue,
) -> Result<Vec<String>, BusError> {
    let mut unanswered = Vec::new();
    for &keys in question.keys() {
        for expression in of_units(keys, units) {
            let history = if expression.ends_with("/history") {
                format!("?limit={HISTORY_ENTRIES}")
            } else {
                String::new()
            };
            let (replies, in_time) = ask_all(session, &format!("{expression}{history}"), limit).await?;
            // A unit without a document, or a service that has no history, says so.
            let samples: Vec<_> = replies.into_iter().filter_map(|reply| reply.into_result().ok()).collect();
            if !in_time {
                unanswered.push(format!("{expression}: no complete answer within {limit:?}"));
            }
            if keys == key::ALL_JOURNALS {
                for (key, frames) in memories(&samples) {
                    queue.memory(&key, frames);
                }
            } else {
                attach(queue, keys, &samples);
            }
        }
    }
    Ok(unanswered)
}

/// Hands files on.
fn attach(queue: &Queue, keys: &str, samples: &[Sample]) {
    for sample in samples {
        let bytes = sample.payload().to_bytes().into_owned();
        let key = sample.key_expr().as_str();
        let file = |name: String, media_type: &str, bytes| Attachment {
            name,
            media_type: media_type.to_owned(),
            attached_ns: now_ns(),
            bytes,
        };
        let attachment = match keys {
            key::ALL_CALIBRATION => Some(Documents::attachment(bytes, now_ns())),
            key::ALL_CONFIGURATIONS => key::parse_configuration(key)
                .map(|instance| file(format!("{instance}.toml"), "application/toml", bytes)),
            _ => key::parse_history(key)
                .map(|unit| file(format!("{unit}.history.json"), "application/json", bytes)),
        };
        if let Some(attachment) = attachment {
            queue.attachment(attachment);
        }
    }
}
