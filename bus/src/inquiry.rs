//! Asking services, and waiting for what they answer.

use std::collections::BTreeMap;
use std::time::Duration;

use isotherm_protocol::codec;
use isotherm_protocol::journal::JournalPart;
use isotherm_protocol::key;
use isotherm_protocol::pair::PairReport;
use tokio::sync::mpsc::{UnboundedReceiver, unbounded_channel};
use tokio::time::{Instant, timeout, timeout_at};
use zenoh::Session;
use zenoh::handlers::FifoChannelHandler;
use zenoh::matching::{MatchingListener, MatchingStatus};
use zenoh::query::{ConsolidationMode, Querier, QueryTarget, Reply};
use zenoh::sample::Sample;

use crate::BusError;

/// Asks all who answer a question; their replies come until `limit`, and end before where all have answered.
///
/// # Errors
/// [`BusError::Declare`].
pub async fn ask_each(
    session: &Session,
    selector: &str,
    limit: Duration,
) -> Result<UnboundedReceiver<Reply>, BusError> {
    let (sender, replies) = unbounded_channel();
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
    Ok(replies)
}

/// The replies of all who answer a question, and whether their end has come within `limit` too.
///
/// # Errors
/// [`BusError::Declare`].
pub async fn ask_all(
    session: &Session,
    selector: &str,
    limit: Duration,
) -> Result<(Vec<Reply>, bool), BusError> {
    let mut replies = ask_each(session, selector, limit).await?;
    let mut all = Vec::new();
    let collected = timeout(limit, async {
        while let Some(reply) = replies.recv().await {
            all.push(reply);
        }
    });
    let in_time = collected.await.is_ok();
    Ok((all, in_time))
}

/// What every instance that answers within `limit` says of itself and its units; what cannot be read is left out.
///
/// # Errors
/// [`BusError::Declare`].
pub async fn pair_reports(session: &Session, limit: Duration) -> Result<Vec<PairReport>, BusError> {
    let (replies, _) = ask_all(session, key::ALL_PAIRS, limit).await?;
    let samples = replies.into_iter().filter_map(|reply| reply.into_result().ok());
    Ok(samples.filter_map(|sample| serde_json::from_slice(&sample.payload().to_bytes()).ok()).collect())
}

/// A querier of all who answer `key`, each within `limit`, once one of them is there; `None` where nobody is within `limit`.
///
/// # Errors
/// [`BusError::Declare`].
pub(crate) async fn querier_matched(
    session: &Session,
    key: &str,
    limit: Duration,
) -> Result<Option<Querier<'static>>, BusError> {
    let deadline = Instant::now() + limit;
    let declare = |source| BusError::Declare { key: key.to_owned(), source };
    let querier = session
        .declare_querier(key.to_owned())
        .target(QueryTarget::All)
        .consolidation(ConsolidationMode::None)
        .timeout(limit)
        .await
        .map_err(declare)?;
    let listener = querier.matching_listener().await.map_err(declare)?;
    let status = querier.matching_status().await.map_err(declare)?;
    Ok(is_matched(&listener, status.matching(), deadline).await.then_some(querier))
}

/// Whether somebody is there, or comes before the deadline; the listener is older than the status, so that one of them sees it.
pub(crate) async fn is_matched(
    listener: &MatchingListener<FifoChannelHandler<MatchingStatus>>,
    mut matching: bool,
    deadline: Instant,
) -> bool {
    while !matching {
        let Ok(Ok(status)) = timeout_at(deadline, listener.recv_async()).await else { return false };
        matching = status.matching();
    }
    true
}

/// Why a question has no answer.
#[derive(Debug)]
pub enum Unanswered {
    /// It cannot be asked.
    Bus(BusError),
    /// Nobody answered in time.
    Silence,
    /// The service answers with an error: its words.
    Refused(String),
}

/// Every answer to a question, once somebody is there to answer it; all within `limit`. Of a pair one may answer what the other refuses:
/// then the answer counts.
///
/// # Errors
/// [`Unanswered`].
pub async fn ask(
    session: &Session,
    key: &str,
    parameters: &str,
    payload: Option<&[u8]>,
    limit: Duration,
) -> Result<Vec<Vec<u8>>, Unanswered> {
    let deadline = Instant::now() + limit;
    let declare = |source| Unanswered::Bus(BusError::Declare { key: key.to_owned(), source });
    let querier = querier_matched(session, key, limit).await.map_err(Unanswered::Bus)?;
    let querier = querier.ok_or(Unanswered::Silence)?;
    let mut get = querier.get().parameters(parameters);
    if let Some(payload) = payload {
        get = get.payload(payload);
    }
    let replies = get.await.map_err(declare)?;
    let (mut answers, mut refusal) = (Vec::new(), None);
    let in_time = loop {
        match timeout_at(deadline, replies.recv_async()).await {
            Ok(Ok(reply)) => match reply.into_result() {
                Ok(sample) => answers.push(sample.payload().to_bytes().into_owned()),
                Err(error) => {
                    refusal = Some(String::from_utf8_lossy(&error.payload().to_bytes()).into_owned());
                }
            },
            // The end of the answers, or of the time for them.
            ended => break ended.is_ok(),
        }
    };
    match refusal.filter(|_| answers.is_empty()) {
        Some(words) => Err(Unanswered::Refused(words)),
        None if answers.is_empty() && !in_time => Err(Unanswered::Silence),
        None => Ok(answers),
    }
}

/// How many parts a memory has, and those that came.
type Parts = (u32, BTreeMap<u32, Vec<u8>>);

/// The frames of each memory among the answers of journals, whole and in the order of their parts, with the key that they came on.
#[must_use]
pub fn memories(samples: &[Sample]) -> Vec<(String, Vec<Vec<u8>>)> {
    let mut memories: BTreeMap<(String, String, u64), Parts> = BTreeMap::new();
    for sample in samples {
        let frame = sample.payload().to_bytes().into_owned();
        let Ok(part) = codec::decode::<JournalPart>(&frame) else { continue };
        let place = (sample.key_expr().to_string(), part.instance, part.number);
        let (parts, frames) = memories.entry(place).or_default();
        *parts = part.parts;
        frames.insert(part.part, frame);
    }
    // Half an answer is of no use.
    let is_whole = |parts: u32, frames: &BTreeMap<_, _>| usize::try_from(parts) == Ok(frames.len());
    let whole = memories.into_iter().filter(|(_, (parts, frames))| is_whole(*parts, frames));
    whole.map(|((key, ..), (_, frames))| (key, frames.into_values().collect())).collect()
}
