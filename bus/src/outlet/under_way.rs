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

use super::tally::TickTally;
use crate::BusError;

/// The gyro ticks of a unit under way.
///
/// What comes back is matched by sequence number, not counted: where an acknowledging message is lost, the next one
/// passes over its ticks, and ticks that the service has announced as missing count as done.
#[derive(Debug)]
pub struct UnderWay {
    unit: UnitId,
    tally: Mutex<TickTally>,
    /// Batches that came back.
    batches: AtomicU64,
    progress: Notify,
}

impl UnderWay {
    fn of(unit: &UnitId) -> Self {
        let (tally, batches, progress) = Default::default();
        Self { unit: unit.clone(), tally, batches, progress }
    }

    /// Subscribes to what comes back for `unit`.
    pub(super) async fn declare(
        session: &Session,
        unit: &UnitId,
    ) -> Result<(Arc<Self>, Subscriber<()>), BusError> {
        let under_way = Arc::new(Self::of(unit));
        let key = key::corrected(unit);
        let back = Arc::clone(&under_way);
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
        Ok((under_way, subscriber))
    }

    /// The account of the ticks.
    pub(super) fn tally(&self) -> MutexGuard<'_, TickTally> {
        self.tally.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Enters what came back.
    fn came_back(&self, batch: &CorrectedBatch) {
        let mut tally = self.tally();
        batch.ticks.iter().for_each(|tick| tally.came_back(tick));
        drop(tally);
        self.batches.fetch_add(1, Ordering::Relaxed);
        self.progress.notify_waiters();
    }

    /// The unit.
    #[must_use]
    pub fn unit(&self) -> &UnitId {
        &self.unit
    }

    /// Gyro ticks under way.
    #[must_use]
    pub fn ticks(&self) -> u64 {
        self.tally().under_way()
    }

    /// Batches that came back so far: where it stands still, nothing comes.
    #[must_use]
    pub fn batches(&self) -> u64 {
        self.batches.load(Ordering::Relaxed)
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
    use crate::outlet::GyroTicks;

    #[tokio::test]
    async fn waiting_ends_with_the_number_under_way() {
        let under_way = UnderWay::of(&UnitId::new("ZLG-0001").unwrap());
        under_way.tally().sent(GyroTicks { series: 1, first: 0, count: 8 });
        assert_eq!(under_way.wait_below(9, Duration::ZERO).await, Ok(()));
        assert_eq!(under_way.wait_below(8, Duration::from_millis(1)).await, Err(8));
    }
}
