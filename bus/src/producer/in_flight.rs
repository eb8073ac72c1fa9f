//! What was sent and has not come back.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use isotherm_protocol::codec;
use isotherm_protocol::corrected::CorrectedBatch;
use isotherm_protocol::key::{self, UnitId};
use tokio::sync::Notify;
use zenoh::Session;
use zenoh::pubsub::Subscriber;

use crate::BusError;

/// The batches under way, oldest first.
///
/// What comes back is matched by sequence number, not counted: where an acknowledging message is lost, the next one
/// acknowledges its ticks too, and ticks that the service has announced as missing count as done.
#[derive(Debug, Default)]
pub(super) struct InFlight {
    batches: Mutex<VecDeque<Range>>,
    progress: Notify,
}

/// Consecutive sequence numbers.
#[derive(Debug, Clone, Copy)]
struct Range {
    first: u64,
    count: u64,
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
                // Only the last number matters; a frame that does not decode acknowledges nothing.
                if let Ok(batch) = codec::decode::<CorrectedBatch>(&sample.payload().to_bytes())
                    && let Some(tick) = batch.ticks.last()
                {
                    back.came_back(tick.sequence);
                }
            })
            .await
            .map_err(|source| BusError::Declare { key, source })?;
        Ok((in_flight, subscriber))
    }

    pub(super) fn sent(&self, first: u64, count: u64) {
        self.batches.lock().unwrap_or_else(PoisonError::into_inner).push_back(Range { first, count });
    }

    /// Everything up to the oldest tick of this number has come back.
    pub(super) fn came_back(&self, sequence: u64) {
        let mut batches = self.batches.lock().unwrap_or_else(PoisonError::into_inner);
        let holds =
            |range: &Range| sequence.checked_sub(range.first).is_some_and(|index| index < range.count);
        let Some(index) = batches.iter().position(holds) else {
            return;
        };
        batches.drain(..index);
        if let Some(range) = batches.front_mut() {
            let done = sequence - range.first + 1;
            range.count -= done;
            range.first = range.first.saturating_add(done);
            if range.count == 0 {
                batches.pop_front();
            }
        }
        drop(batches);
        self.progress.notify_waiters();
    }

    pub(super) fn ticks(&self) -> u64 {
        self.batches.lock().unwrap_or_else(PoisonError::into_inner).iter().map(|range| range.count).sum()
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

    #[test]
    fn a_number_acknowledges_everything_sent_before_it() {
        let in_flight = InFlight::default();
        in_flight.sent(10, 4);
        in_flight.sent(14, 4);
        in_flight.came_back(11);
        assert_eq!(in_flight.ticks(), 6);
        in_flight.came_back(15);
        assert_eq!(in_flight.ticks(), 2, "the first batch's last message was lost");
        in_flight.came_back(11);
        assert_eq!(in_flight.ticks(), 2, "an old number acknowledges nothing");
        in_flight.came_back(17);
        assert_eq!(in_flight.ticks(), 0);
    }

    #[test]
    fn numbers_that_start_anew_are_told_apart_by_their_order() {
        let in_flight = InFlight::default();
        in_flight.sent(0, 4);
        in_flight.sent(0, 4);
        in_flight.came_back(3);
        assert_eq!(in_flight.ticks(), 4);
        in_flight.came_back(1);
        assert_eq!(in_flight.ticks(), 2);
    }

    #[tokio::test]
    async fn waiting_ends_with_the_number_under_way() {
        let in_flight = InFlight::default();
        in_flight.sent(0, 8);
        assert_eq!(in_flight.wait_below(9, Duration::ZERO).await, Ok(()));
        assert_eq!(in_flight.wait_below(8, Duration::from_millis(1)).await, Err(8));
    }
}
