//! When the messages of a stream were received, against when they happened.

use isotherm_correction::units::Span;
use serde::Serialize;

use super::histogram::{Histogram, Spread};
use crate::date::seconds;

/// Messages that are looked at together, at most.
const BLOCK_MESSAGES: usize = 4096;
/// Fewest of them, where they come that seldom: one alone says nothing.
const FEWEST_MESSAGES: usize = 16;
/// Time that they cover, where they are no fewer (ns).
const BLOCK_NS: i64 = 10_000_000_000;

/// How the times of reception scatter against those of the producer's clock.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Jitter {
    /// Delay of a message's reception behind the end of its last tick, over the smallest such delay of the same 10 s, or of
    /// 16 messages where these take longer; a drift of the clocks is taken out.
    pub delay: Spread,
    /// How much faster the recorder's clock ran than the producer's, by the smallest delays at both ends (1e-6); a log that
    /// was recorded from a replay shows the replay's speed here. `None` for less than 10 s and
    /// for fewer than 64 messages.
    pub clock_drift_ppm: Option<f64>,
}

/// The smallest delay of a block.
#[derive(Debug, Clone, Copy)]
struct Smallest {
    /// End of the block (ns on the producer's clock).
    at_ns: i64,
    delay_ns: i64,
}

/// Follows the delays of one stream.
#[derive(Debug, Clone, Default)]
pub(super) struct Delays {
    /// Times (ns on the producer's clock) and delays of the present block.
    block: Vec<(i64, i64)>,
    /// The producer's time at its beginning.
    begun_ns: Option<i64>,
    last_ns: i64,
    spread: Histogram,
    first: Option<Smallest>,
    last: Option<Smallest>,
}

impl Delays {
    /// Takes one message: when it was received, and when its last tick ended.
    pub(super) fn take(&mut self, received_ns: u64, event_ns: i64) {
        let Ok(received) = i64::try_from(received_ns) else { return };
        let begun = *self.begun_ns.get_or_insert(event_ns);
        let since = event_ns.saturating_sub(begun);
        // Time that goes back belongs to another run of the producer, which has a clock of its own.
        let other_clock = since < -BLOCK_NS;
        if other_clock
            || (since >= BLOCK_NS && self.block.len() >= FEWEST_MESSAGES)
            || self.block.len() >= BLOCK_MESSAGES
        {
            self.close();
            self.begun_ns = Some(event_ns);
        }
        if other_clock {
            (self.first, self.last) = (None, None);
        }
        self.block.push((event_ns, received.saturating_sub(event_ns)));
        self.last_ns = event_ns;
    }

    /// What it comes to; `None` where there is no message.
    pub(super) fn jitter(mut self) -> Option<Jitter> {
        self.close();
        let enough = self.spread.count() >= 4 * FEWEST_MESSAGES as u64;
        let drift = |first: Smallest, last: Smallest| {
            let (delay, time) = (last.delay_ns.saturating_sub(first.delay_ns), last.at_ns - first.at_ns);
            (time >= BLOCK_NS && enough).then(|| seconds(delay) / seconds(time) * 1e6)
        };
        let clock_drift_ppm = self.first.zip(self.last).and_then(|(first, last)| drift(first, last));
        self.spread.spread().map(|delay| Jitter { delay, clock_drift_ppm })
    }

    /// Ends the block.
    fn close(&mut self) {
        let smallest = |part: &[(i64, i64)]| part.iter().copied().min_by_key(|&(_, delay)| delay);
        let Some((_, least)) = smallest(&self.block) else { return };
        // A clock that drifts, or a replay at another speed, tilts all delays alike: a line through the smallest of both
        // halves takes that out.
        let (early, late) = self.block.split_at(self.block.len() / 2);
        let line = smallest(early).zip(smallest(late)).filter(|((from, _), (to, _))| to > from);
        let tilt = line.map_or(0.0, |((from, first), (to, last))| {
            seconds(last.saturating_sub(first)) / seconds(to.saturating_sub(from))
        });
        let begun = self.begun_ns.unwrap_or(0);
        let level = |&(at, delay): &(i64, i64)| {
            let by = Span::from_s((tilt * seconds(at.saturating_sub(begun))).abs()).as_ns();
            delay.saturating_sub(if tilt < 0.0 { -by } else { by })
        };
        let lowest = self.block.iter().map(level).min().unwrap_or(0);
        for message in &self.block {
            self.spread.add(level(message).saturating_sub(lowest).max(0).unsigned_abs());
        }
        self.block.clear();
        let smallest = Smallest { at_ns: self.last_ns, delay_ns: least };
        self.first.get_or_insert(smallest);
        self.last = Some(smallest);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn delays_are_told_over_the_smallest_though_the_clocks_drift() {
        let mut delays = Delays::default();
        // 100 messages a second for 200 s; every 50th is 3 ms late; the recorder's clock gains 20 ppm.
        for index in 0..20_000_i64 {
            let event = index * 10_000_000;
            let late = if index % 50 == 49 { 3_000_000 } else { 100_000 };
            let received = 1_700_000_000_000_000_000 + event + event / 50_000 + late;
            delays.take(received.unsigned_abs(), event);
        }
        let jitter = delays.jitter().unwrap();
        assert!(jitter.delay.p50_ns <= 1000, "{jitter:?}");
        assert!((2_900_000..3_100_000).contains(&jitter.delay.p99_ns), "{jitter:?}");
        assert!((2_900_000..3_100_000).contains(&jitter.delay.max_ns), "{jitter:?}");
        assert!((jitter.clock_drift_ppm.unwrap() - 20.0).abs() < 0.5, "{jitter:?}");
    }

    #[test]
    fn a_replay_at_another_speed_is_no_jitter() {
        for speed in [2, 30] {
            let mut delays = Delays::default();
            (0..5000).for_each(|index: i64| {
                let event = index * 50_000_000;
                let late = if index % 10 == 3 { 400_000 } else { 0 };
                delays.take((event / speed + late).unsigned_abs(), event);
            });
            let jitter = delays.jitter().unwrap();
            assert!(jitter.delay.p50_ns < 1000 && jitter.delay.max_ns.abs_diff(400_000) < 1000, "{jitter:?}");
        }
    }

    #[test]
    fn a_clock_that_loses_has_a_negative_drift() {
        let mut delays = Delays::default();
        (0..2000).for_each(|index: i64| {
            let event = index * 50_000_000;
            delays.take((event - event / 100_000).unsigned_abs() + 1_000_000_000, event);
        });
        let drift = delays.jitter().unwrap().clock_drift_ppm.unwrap();
        assert!((drift + 10.0).abs() < 0.5, "{drift}");
    }

    #[test]
    fn another_run_of_the_producer_is_no_jitter() {
        let mut delays = Delays::default();
        for index in 0..5000_u32 {
            let event = i64::from(index % 2500) * 10_000_000;
            delays.take(10_000_000_000 + u64::from(index) * 10_000_000, event);
        }
        let jitter = delays.jitter().unwrap();
        assert!(jitter.delay.max_ns == 0, "{jitter:?}");
    }
}
