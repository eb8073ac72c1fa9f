//! Whether the receive path is alive: the threads that receive, correct and publish.
//!
//! Two things are seen. A message that a thread has in hand is to be done within a limit: a thread that hangs in one unit is noticed
//! although the others go on. And where no message is in hand, one of the threads is asked for a sign, so that a service to which
//! nobody sends counts as alive, and one whose threads hang before they have taken a message does not.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use isotherm_bus::threads::on_receive_thread;
use thiserror::Error;
use zenoh::qos::CongestionControl;

/// Messages that can be seen in hand at a time; Zenoh has two receive threads unless it is told otherwise.
const HANDS: usize = 32;
/// How long a message, or a sign, may take. Batches take milliseconds.
const LIMIT: Duration = Duration::from_secs(2);
/// The same where a message may wait for slow subscribers: Zenoh lets each of them go after 5 s.
const LIMIT_BLOCKING: Duration = Duration::from_secs(30);

/// Why the receive path does not count as alive.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
pub enum Stuck {
    /// A message has been in hand for so long.
    #[error("the receive path hangs: one message has taken {:.1} s", .0.as_secs_f64())]
    Message(Duration),
    /// The receive threads have given no sign for so long.
    #[error("the receive path hangs: its threads have not answered for {:.1} s", .0.as_secs_f64())]
    Threads(Duration),
}

/// What is seen of the receive path. Times are ns since `start`, 0 where there is none.
#[derive(Debug)]
pub(crate) struct Pulse {
    start: Instant,
    limit: Duration,
    /// Since when each message is in hand.
    hands: [AtomicU64; HANDS],
    /// When the sign was asked for that has not been given.
    asked: AtomicU64,
}

impl Pulse {
    /// For a service that publishes like this.
    pub(crate) fn new(congestion: CongestionControl) -> Self {
        let limit = match congestion {
            CongestionControl::Drop => LIMIT,
            _ => LIMIT_BLOCKING,
        };
        Self {
            start: Instant::now(),
            limit,
            hands: [const { AtomicU64::new(0) }; HANDS],
            asked: AtomicU64::new(0),
        }
    }

    /// A message is in hand until what this gives is dropped.
    pub(crate) fn take(&self, arrival: Instant) -> InHand<'_> {
        let since = self.stamp(arrival);
        let free =
            |hand: &&AtomicU64| hand.compare_exchange(0, since, Ordering::Relaxed, Ordering::Relaxed).is_ok();
        // With more threads than that the message is done unseen.
        InHand(self.hands.iter().find(free))
    }

    /// Whether the path is alive; asks its threads for the sign that the next look will want to see.
    ///
    /// # Errors
    /// [`Stuck`]: what takes too long.
    pub(crate) fn look(self: &Arc<Self>) -> Result<(), Stuck> {
        self.look_with(Instant::now(), |pulse| on_receive_thread(move || pulse.sign()))
    }

    fn look_with(self: &Arc<Self>, now: Instant, ask: impl FnOnce(Arc<Self>)) -> Result<(), Stuck> {
        let now = self.stamp(now);
        let since = |stamp: &AtomicU64| match stamp.load(Ordering::Relaxed) {
            0 => None,
            stamp => Some(Duration::from_nanos(now.saturating_sub(stamp))),
        };
        let in_hand = self.hands.iter().filter_map(since).max();
        if let Some(longest) = in_hand.filter(|longest| *longest > self.limit) {
            return Err(Stuck::Message(longest));
        }
        match since(&self.asked) {
            None => {
                self.asked.store(now, Ordering::Relaxed);
                ask(Arc::clone(self));
                Ok(())
            }
            // A thread that is at a message gives its sign behind it.
            Some(waited) if waited > self.limit && in_hand.is_none() => Err(Stuck::Threads(waited)),
            Some(_) => Ok(()),
        }
    }

    /// A receive thread gives the sign.
    fn sign(&self) {
        self.asked.store(0, Ordering::Relaxed);
    }

    fn stamp(&self, at: Instant) -> u64 {
        u64::try_from(at.saturating_duration_since(self.start).as_nanos()).unwrap_or(u64::MAX).max(1)
    }
}

/// A message in hand.
#[derive(Debug)]
pub(crate) struct InHand<'a>(Option<&'a AtomicU64>);

impl Drop for InHand<'_> {
    fn drop(&mut self) {
        if let Some(hand) = self.0 {
            hand.store(0, Ordering::Relaxed);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A pulse, and a look at it so many seconds after its start; whether a thread gives its sign is said.
    fn pulse() -> (Arc<Pulse>, impl Fn(u64, bool) -> Result<(), Stuck>) {
        let pulse = Arc::new(Pulse::new(CongestionControl::Drop));
        let looked = Arc::clone(&pulse);
        let look = move |at_s, signs: bool| {
            let at = looked.start + Duration::from_secs(at_s);
            looked.look_with(at, |pulse| {
                if signs {
                    pulse.sign();
                }
            })
        };
        (pulse, look)
    }

    #[test]
    fn an_idle_path_whose_threads_give_signs_is_alive_for_ever() {
        let (_, look) = pulse();
        for at_s in 1..1000 {
            assert_eq!(look(at_s, true), Ok(()));
        }
    }

    #[test]
    fn threads_without_a_sign_hang() {
        let (pulse, look) = pulse();
        assert_eq!(look(1, false), Ok(()));
        assert_eq!(look(3, false), Ok(()));
        assert_eq!(look(4, false), Err(Stuck::Threads(Duration::from_secs(3))));
        pulse.sign();
        assert_eq!(look(5, true), Ok(()));
    }

    #[test]
    fn a_message_that_stays_in_hand_is_noticed_though_others_are_done() {
        let (pulse, look) = pulse();
        let at = |at_s| pulse.start + Duration::from_secs(at_s);
        let stays = pulse.take(at(1));
        for at_s in 2..4 {
            drop(pulse.take(at(at_s)));
            assert_eq!(look(at_s, true), Ok(()));
        }
        drop(pulse.take(at(4)));
        assert_eq!(look(4, true), Err(Stuck::Message(Duration::from_secs(3))));
        drop(stays);
        assert_eq!(look(4, true), Ok(()));
    }

    #[test]
    fn threads_at_messages_owe_no_sign() {
        let (pulse, look) = pulse();
        assert_eq!(look(1, false), Ok(()));
        let _in_hand = pulse.take(pulse.start + Duration::from_secs(9));
        assert_eq!(look(10, false), Ok(()));
    }

    #[test]
    fn slow_subscribers_are_waited_for_where_they_may_be() {
        let pulse = Arc::new(Pulse::new(CongestionControl::Block));
        let _in_hand = pulse.take(pulse.start);
        let look = |at_s| pulse.look_with(pulse.start + Duration::from_secs(at_s), |pulse| pulse.sign());
        assert_eq!(look(11), Ok(()), "two subscribers, one after the other");
        assert!(matches!(look(31), Err(Stuck::Message(_))));
    }

    #[test]
    fn more_messages_than_can_be_seen_do_no_harm() {
        let (pulse, look) = pulse();
        let many: Vec<_> = (0..=HANDS).map(|_| pulse.take(pulse.start)).collect();
        drop(many);
        assert_eq!(look(100, true), Ok(()));
    }
}
