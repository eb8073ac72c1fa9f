//! Waiting until something is there, by state and with a limit.

use std::time::Duration;

use isotherm_protocol::key;
use tokio::time::{Instant, timeout_at};
use zenoh::Session;
use zenoh::pubsub::Publisher;
use zenoh::query::{ConsolidationMode, QueryTarget};

use crate::BusError;

/// Waits until a service answers on the status topic of all units.
///
/// A query travels behind every declaration made before on the same session, so that after the answer the service
/// knows of every subscription made before this call: no first tick will be missed.
///
/// # Errors
/// [`BusError::NoService`] after `limit`, [`BusError::Declare`].
pub async fn wait_for_service(session: &Session, limit: Duration) -> Result<(), BusError> {
    let key = key::ALL_STATUS;
    let declare = |source| BusError::Declare { key: key.to_owned(), source };
    let missing = || BusError::NoService { key: key.to_owned(), waited: limit };
    let deadline = Instant::now() + limit;

    let querier = session
        .declare_querier(key)
        .target(QueryTarget::All)
        .consolidation(ConsolidationMode::None)
        .timeout(limit)
        .await
        .map_err(declare)?;
    let listener = querier.matching_listener().await.map_err(declare)?;
    if !querier.matching_status().await.map_err(declare)?.matching() {
        loop {
            match timeout_at(deadline, listener.recv_async()).await {
                Ok(Ok(status)) if status.matching() => break,
                Ok(Ok(_)) => {}
                Ok(Err(_)) | Err(_) => return Err(missing()),
            }
        }
    }
    let replies = querier.get().await.map_err(declare)?;
    // A service without units replies nothing; the end of the replies is the answer.
    loop {
        match timeout_at(deadline, replies.recv_async()).await {
            Ok(Ok(_)) => {}
            Ok(Err(_)) => return Ok(()),
            Err(_) => return Err(missing()),
        }
    }
}

/// Waits until somebody subscribes to what the publisher publishes.
pub(crate) async fn wait_for_subscriber(publisher: &Publisher<'_>, limit: Duration) -> Result<(), BusError> {
    let key = || publisher.key_expr().to_string();
    let declare = |source| BusError::Declare { key: key(), source };
    let deadline = Instant::now() + limit;
    // The listener first: a subscriber that comes between the two calls is seen by one of them.
    let listener = publisher.matching_listener().await.map_err(declare)?;
    if publisher.matching_status().await.map_err(declare)?.matching() {
        return Ok(());
    }
    loop {
        match timeout_at(deadline, listener.recv_async()).await {
            Ok(Ok(status)) if status.matching() => return Ok(()),
            Ok(Ok(_)) => {}
            Ok(Err(_)) | Err(_) => {
                return Err(BusError::NoSubscriber { key: key(), waited: limit });
            }
        }
    }
}
