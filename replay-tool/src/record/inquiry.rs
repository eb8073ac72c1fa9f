//! Asking services for what a log needs beside the messages.

use std::collections::BTreeMap;
use std::time::Duration;

use isotherm_bus::BusError;
use isotherm_log::recording::{Attachment, Documents};
use isotherm_protocol::codec;
use isotherm_protocol::journal::JournalPart;
use isotherm_protocol::key::{self, UnitId};
use tokio::sync::mpsc::unbounded_channel;
use tokio::time::timeout;
use zenoh::Session;
use zenoh::query::{ConsolidationMode, QueryTarget, Reply};
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
        let expressions =
            if keys == key::ALL_CONFIGURATIONS { of_units(keys, &[]) } else { of_units(keys, units) };
        for expression in expressions {
            let (replies, in_time) = get(session, expression.as_str(), limit).await?;
            let mut samples = Vec::new();
            for reply in replies {
                // A unit without a document, or a service that has no history, says so.
                samples.extend(reply.into_result().ok());
            }
            if !in_time {
                unanswered.push(format!("{expression}: no answer, or only a part of it, within {limit:?}"));
            }
            if keys == key::ALL_JOURNALS { memories(queue, samples) } else { attach(queue, keys, &samples) }
        }
    }
    Ok(unanswered)
}

/// The replies to one query, and whether their end has come too.
async fn get(session: &Session, keys: &str, limit: Duration) -> Result<(Vec<Reply>, bool), BusError> {
    let selector =
        if keys.ends_with("/history") { format!("{keys}?limit={HISTORY_ENTRIES}") } else { keys.to_owned() };
    let (sender, mut replies) = unbounded_channel();
    // Not Zenoh's own queue: it holds the receive thread up where it is full.
    let callback = move |reply| drop(sender.send(reply));
    session
        .get(&selector)
        .target(QueryTarget::All)
        .consolidation(ConsolidationMode::None)
        .timeout(limit)
        .callback(callback)
        .await
        .map_err(|source| BusError::Declare { key: selector, source })?;
    let mut all = Vec::new();
    let collected = timeout(limit, async {
        while let Some(reply) = replies.recv().await {
            all.push(reply);
        }
    });
    let in_time = collected.await.is_ok();
    Ok((all, in_time))
}

/// Hands answers of journals on, the parts of each together and in their order.
fn memories(queue: &Queue, samples: Vec<Sample>) {
    let mut parts: BTreeMap<(String, String, u64), BTreeMap<u32, Vec<u8>>> = BTreeMap::new();
    let mut whole = BTreeMap::new();
    for sample in samples {
        let frame = sample.payload().to_bytes().into_owned();
        let Ok(part) = codec::decode::<JournalPart>(&frame) else { continue };
        let place = (sample.key_expr().to_string(), part.instance, part.number);
        whole.insert(place.clone(), part.parts);
        parts.entry(place).or_default().insert(part.part, frame);
    }
    for (place, frames) in parts {
        // Half an answer is of no use.
        if whole.get(&place).is_some_and(|parts| usize::try_from(*parts) == Ok(frames.len())) {
            queue.memory(&place.0, frames.into_values().collect());
        }
    }
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
