//! When a stream counts as stopped. The one place where a clock decides anything, and only about a stream's tail.

use std::time::{Duration, Instant};

/// Distance of messages that is assumed before two have been heard.
const ASSUMED_INTERVAL: Duration = Duration::from_millis(250);
/// A stream is stopped after this many times its usual distance of messages.
const INTERVALS: u32 = 4;
/// Longest distance of messages that is followed; what is longer was a pause.
const LONGEST_INTERVAL: Duration = Duration::from_millis(2500);

/// Limits of a stream that may have stopped.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct StreamTimeoutSettings {
    /// Shortest silence that counts as a stop.
    pub tail_flush: Duration,
    /// Pairing window of the unit; twice as long must pass.
    pub pairing_window: Duration,
}

/// Follows the arrival of one stream's messages.
///
/// A producer that sends a batch of 64 ticks every 640 ms has not stopped 500 ms after the last one. The silence that
/// counts as a stop therefore grows with the distance of the messages, so that a flush by the clock never meets a
/// stream that goes on.
#[derive(Debug)]
pub(super) struct StreamTimeout {
    settings: StreamTimeoutSettings,
    last: Option<Instant>,
    interval: Duration,
}

impl StreamTimeout {
    pub(super) fn new(settings: StreamTimeoutSettings) -> Self {
        Self { settings, last: None, interval: ASSUMED_INTERVAL }
    }

    /// A message has arrived.
    pub(super) fn heard(&mut self, now: Instant) {
        if let Some(last) = self.last {
            let interval = now.saturating_duration_since(last).min(LONGEST_INTERVAL);
            // Up at once, down slowly: bursts do not make the stream look faster than it is.
            self.interval = interval.max(self.interval * 15 / 16);
        }
        self.last = Some(now);
    }

    /// Whether nothing was heard for longer than a stated time; not before the first message.
    pub(super) fn is_silent_for(&self, now: Instant, longest: Duration) -> bool {
        self.last.is_some_and(|last| now.saturating_duration_since(last) > longest)
    }

    /// Whether the stream has been silent for long enough to be called stopped.
    pub(super) fn is_over(&self, now: Instant) -> bool {
        let shortest =
            self.settings.tail_flush.max(self.settings.pairing_window * 2).max(self.interval * INTERVALS);
        self.last.is_none_or(|last| now.saturating_duration_since(last) >= shortest)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: Duration = Duration::from_millis(1);

    /// Silence (ms) after which a stream counts as stopped, when its messages came at these distances (ms).
    fn silence(tail_flush: u32, pairing_window: u32, distances: &[u32]) -> u32 {
        let settings =
            StreamTimeoutSettings { tail_flush: MS * tail_flush, pairing_window: MS * pairing_window };
        let mut stream_timeout = StreamTimeout::new(settings);
        let mut now = Instant::now();
        stream_timeout.heard(now);
        for distance in distances {
            now += MS * *distance;
            stream_timeout.heard(now);
        }
        (0..20_000).find(|ms| stream_timeout.is_over(now + MS * *ms)).unwrap()
    }

    #[test]
    fn the_silence_that_counts_as_a_stop_grows_with_the_distance_of_messages() {
        let fast = [5; 200];
        assert_eq!(silence(100, 50, &fast), 100, "the configured silence");
        assert_eq!(silence(100, 300, &fast), 600, "twice the pairing window");
        assert_eq!(silence(100, 50, &[640; 10]), 2560, "four times the distance");
        assert_eq!(silence(100, 50, &[]), 1000, "nothing is known of the distance yet");
        assert_eq!(silence(100, 50, &[3_600_000]), 10_000, "a pause is not a distance");
    }
}
