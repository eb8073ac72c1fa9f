//! Waiting until something is there, by state and with a limit.

use std::collections::BTreeSet;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use isotherm_protocol::codec;
use isotherm_protocol::key::{self, UnitId};
use isotherm_protocol::status::Status;
use tokio::sync::Notify;
use tokio::time::{Instant, timeout_at};
use zenoh::Session;
use zenoh::pubsub::{Publisher, Subscriber};
use zenoh::sample::{Sample, SampleKind};

use crate::BusError;
use crate::inquiry::{is_matched, querier_matched};

/// Waits until a service answers on the status topic of all units.
///
/// A query travels behind every declaration made before on the same session, so that after the answer the service
/// knows of every subscription made before this call: no first tick will be missed.
///
/// # Errors
/// [`BusError::NoService`] after `limit`, [`BusError::Declare`].
pub async fn wait_for_service(session: &Session, limit: Duration) -> Result<(), BusError> {
    wait_for_answer(session, key::ALL_STATUS, limit).await
}

/// The same, on the status topic of one unit, which need not exist yet.
///
/// # Errors
/// As [`wait_for_service`].
pub async fn wait_for_service_of(session: &Session, unit: &UnitId, limit: Duration) -> Result<(), BusError> {
    wait_for_answer(session, &key::status(unit), limit).await
}

async fn wait_for_answer(session: &Session, key: &str, limit: Duration) -> Result<(), BusError> {
    let declare = |source| BusError::Declare { key: key.to_owned(), source };
    let deadline = Instant::now() + limit;
    let Some(querier) = querier_matched(session, key, limit).await? else {
        return Err(missing(session, key, limit).await);
    };
    let replies = querier.get().await.map_err(declare)?;
    // A service without units replies nothing; the end of the replies is the answer.
    loop {
        match timeout_at(deadline, replies.recv_async()).await {
            Ok(Ok(_)) => {}
            Ok(Err(_)) => return Ok(()),
            Err(_) => return Err(missing(session, key, limit).await),
        }
    }
}

/// Nobody answered those who are connected.
async fn missing(session: &Session, key: &str, waited: Duration) -> BusError {
    let peers = session.info().links().await.map(|link| link.dst().to_string()).collect();
    BusError::NoService { key: key.to_owned(), peers, waited }
}

/// The status of a unit, as the service that has it answers; `None` where none answers in time.
pub async fn status(session: &Session, unit: &UnitId, limit: Duration) -> Option<Status> {
    let replies = session.get(key::status(unit)).timeout(limit).await.ok()?;
    while let Ok(reply) = replies.recv_async().await {
        if let Ok(sample) = reply.into_result()
            && let Ok(status) = codec::decode(&sample.payload().to_bytes())
        {
            return Some(status);
        }
    }
    None
}

/// Watches by their tokens which service instances are there.
#[derive(Debug)]
pub struct ServiceWatch {
    /// Told when the last one has gone.
    gone: Arc<Notify>,
    // Dropping it ends the watch.
    _subscriber: Subscriber<()>,
}

impl ServiceWatch {
    /// Begins the watch.
    ///
    /// # Errors
    /// [`BusError::Declare`].
    pub async fn declare(session: &Session) -> Result<Self, BusError> {
        let gone = Arc::new(Notify::new());
        let (told, there) = (Arc::clone(&gone), Mutex::new(BTreeSet::new()));
        let tell = move |sample: Sample| {
            let Some(instance) = key::parse_service_alive(sample.key_expr().as_str()) else { return };
            let mut there = there.lock().unwrap_or_else(PoisonError::into_inner);
            if sample.kind() == SampleKind::Put {
                there.insert(instance.to_owned());
            } else if there.remove(instance) && there.is_empty() {
                told.notify_one();
            }
        };
        let key = key::ALL_SERVICES_ALIVE;
        let subscriber = session.liveliness().declare_subscriber(key).history(true).callback(tell).await;
        let subscriber = subscriber.map_err(|source| BusError::Declare { key: key.to_owned(), source })?;
        Ok(Self { gone, _subscriber: subscriber })
    }

    /// Ends when an instance was there and none is any more: it has ended, or the connection to it.
    pub async fn gone(&self) {
        // A permit is kept where the last one goes before anybody waits.
        self.gone.notified().await;
    }
}

/// Waits until somebody subscribes to what the publisher publishes.
///
/// # Errors
/// [`BusError::NoSubscriber`] after `limit`, [`BusError::Declare`].
pub async fn wait_for_subscriber(publisher: &Publisher<'_>, limit: Duration) -> Result<(), BusError> {
    let key = || publisher.key_expr().to_string();
    let declare = |source| BusError::Declare { key: key(), source };
    let deadline = Instant::now() + limit;
    let listener = publisher.matching_listener().await.map_err(declare)?;
    let status = publisher.matching_status().await.map_err(declare)?;
    if is_matched(&listener, status.matching(), deadline).await {
        Ok(())
    } else {
        Err(BusError::NoSubscriber { key: key(), waited: limit })
    }
}
