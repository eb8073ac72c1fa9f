//! What was sent and has not come back, and the account of what did.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use isotherm_protocol::codec;
use isotherm_protocol::corrected::CorrectedBatch;
use isotherm_protocol::key::{self, UnitId};
use tokio::sync::Notify;
use zenoh::Session;
use zenoh::pubsub::Subscriber;

use super::tally::{Sent, TickTally};
use super::{Account, GyroTicks};
use crate::BusError;

/// The gyro ticks of a unit under way.
///
/// What comes back is matched by sequence number, not counted: where an acknowledging message is lost, the next one
/// passes over its ticks, and ticks that the service has announced as missing count as done.
#[derive(Debug, Default)]
pub(super) struct InFlight {
    tally: Mutex<TickTally>,
    /// Batches that came back.
    batches: AtomicU64,
    progress: Notify,
}

impl InFlight {
    /// Subscribes to what comes back for `unit`.
    pub(super) async fn declare(
        session: &Session,
        unit: &UnitId,
    ) -> Result<(Arc<Self>, Subscriber<()>), BusError> {
        let in_flight = Arc::new(Self::default());
        let key = key::corrected(unit);
        let back = Arc::clone(&in_flight);
        let subscriber = session
            .declare_subscriber(&key)
            .callback(move |sample| {
                // A frame that does not decode acknowledges nothing.
                if let Ok(batch) = codec::decode::<CorrectedBatch>(&sample.payload().to_bytes()) {
                    back.came_back(&batch);
                }
            })
            .await
            .map_err(|source| BusError::Declare { key, source })?;
        Ok((in_flight, subscriber))
    }

    fn tally(&self) -> MutexGuard<'_, TickTally> {
        self.tally.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Enters what is about to be sent.
    pub(super) fn sent(&self, ticks: GyroTicks) -> Sent {
        self.tally().sent(ticks)
    }

    /// Enters what came back.
    fn came_back(&self, batch: &CorrectedBatch) {
        let mut tally = self.tally();
        batch.ticks.iter().for_each(|tick| tally.came_back(tick));
        drop(tally);
        self.batches.fetch_add(1, Ordering::Relaxed);
        self.progress.notify_waiters();
    }

    /// Ticks under way.
    pub(super) fn ticks(&self) -> u64 {
        self.tally().under_way()
    }

    /// Batches that came back so far: where it stands still, nothing comes.
    pub(super) fn batches(&self) -> u64 {
        self.batches.load(Ordering::Relaxed)
    }

    pub(super) fn account(&self) -> Account {
        self.tally().account()
    }

    /// Waits until fewer than `limit` ticks are under way; gives their number where nothing came back for `patience`.
    pub(super) async fn wait_below(&self, limit: u64, patience: Duration) -> Result<(), u64> {
        loop {
            // Registered before the look, so that progress between the two is not missed.
            let progress = self.progress.notified();
            let ticks = self.ticks();
            if ticks < limit {
                return Ok(());
            }
            if tokio::time::timeout(patience, progress).await.is_err() {
                return Err(self.ticks());
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test]
    async fn waiting_ends_with_the_number_under_way() {
        let in_flight = InFlight::default();
        in_flight.sent(GyroTicks { series: 1, first: 0, count: 8 });
        assert_eq!(in_flight.wait_below(9, Duration::ZERO).await, Ok(()));
        assert_eq!(in_flight.wait_below(8, Duration::from_millis(1)).await, Err(8));
    }
}
