//! Following the status of a unit.

use isotherm_protocol::codec;
use isotherm_protocol::key::{self, UnitId};
use isotherm_protocol::status::Status;
use tokio::sync::mpsc::{UnboundedReceiver, unbounded_channel};
use tokio::time::{Duration, Instant, timeout_at};
use zenoh::pubsub::Subscriber;

use super::ConsoleError;
use super::client::Client;

/// A unit's statuses as they come.
#[derive(Debug)]
pub(super) struct Follow {
    /// The status when the watch began; `None` where the unit had not appeared.
    pub(super) first: Option<Status>,
    statuses: UnboundedReceiver<Status>,
    // Dropping it ends the subscription.
    _subscriber: Subscriber<()>,
}

impl Follow {
    /// Subscribes, then asks for the status, so that nothing is missed between the two.
    pub(super) async fn start(client: &Client, unit: &UnitId) -> Result<Self, ConsoleError> {
        let key = key::status(unit);
        let (sender, statuses) = unbounded_channel();
        let asked = sender.clone();
        let subscriber = client
            .session
            .declare_subscriber(key.clone())
            .callback(move |sample| {
                if let Ok(status) = codec::decode(&sample.payload().to_bytes()) {
                    // The receiver may be gone already.
                    let _ = sender.send(status);
                }
            })
            .await
            .map_err(Client::declare(&key))?;
        let first = client.status(unit).await?;
        if let Some(status) = first.clone() {
            let _ = asked.send(status);
        }
        Ok(Self { first, statuses, _subscriber: subscriber })
    }

    /// The next status; `None` once the session is gone.
    pub(super) async fn next(&mut self) -> Option<Status> {
        self.statuses.recv().await
    }

    /// The first thing that `find` finds in a status, within a time.
    pub(super) async fn until<T>(
        &mut self,
        within: Duration,
        mut find: impl FnMut(&Status) -> Option<T>,
    ) -> Option<T> {
        let deadline = Instant::now() + within;
        while let Ok(Some(status)) = timeout_at(deadline, self.next()).await {
            if let Some(found) = find(&status) {
                return Some(found);
            }
        }
        None
    }
}
