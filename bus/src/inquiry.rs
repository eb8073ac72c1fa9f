//! Asking every service at once, and waiting for all that is answered.

use std::collections::BTreeMap;
use std::time::Duration;

use isotherm_protocol::codec;
use isotherm_protocol::journal::JournalPart;
use tokio::sync::mpsc::unbounded_channel;
use tokio::time::timeout;
use zenoh::Session;
use zenoh::query::{ConsolidationMode, QueryTarget, Reply};
use zenoh::sample::Sample;

use crate::BusError;

/// The replies of all who answer a question, and whether their end has come within `limit` too.
///
/// # Errors
/// [`BusError::Declare`].
pub async fn ask_all(
    session: &Session,
    selector: &str,
    limit: Duration,
) -> Result<(Vec<Reply>, bool), BusError> {
    let (sender, mut replies) = unbounded_channel();
    // Not Zenoh's own queue: it holds the receive thread up where it is full.
    let callback = move |reply| drop(sender.send(reply));
    session
        .get(selector)
        .target(QueryTarget::All)
        .consolidation(ConsolidationMode::None)
        .timeout(limit)
        .callback(callback)
        .await
        .map_err(|source| BusError::Declare { key: selector.to_owned(), source })?;
    let mut all = Vec::new();
    let collected = timeout(limit, async {
        while let Some(reply) = replies.recv().await {
            all.push(reply);
        }
    });
    let in_time = collected.await.is_ok();
    Ok((all, in_time))
}

/// The frames of each memory among the answers of journals, whole and in the order of their parts, with the key that they came on.
#[must_use]
pub fn memories(samples: &[Sample]) -> Vec<(String, Vec<Vec<u8>>)> {
    let mut parts: BTreeMap<(String, String, u64), BTreeMap<u32, Vec<u8>>> = BTreeMap::new();
    let mut whole = BTreeMap::new();
    for sample in samples {
        let frame = sample.payload().to_bytes().into_owned();
        let Ok(part) = codec::decode::<JournalPart>(&frame) else { continue };
        let place = (sample.key_expr().to_string(), part.instance, part.number);
        whole.insert(place.clone(), part.parts);
        parts.entry(place).or_default().insert(part.part, frame);
    }
    // Half an answer is of no use.
    let is_whole = |place: &(String, String, u64), frames: &BTreeMap<u32, Vec<u8>>| {
        whole.get(place).is_some_and(|parts| usize::try_from(*parts) == Ok(frames.len()))
    };
    let memories = parts.into_iter().filter(|(place, frames)| is_whole(place, frames));
    memories.map(|((key, ..), frames)| (key, frames.into_values().collect())).collect()
}
