//! What comes in for a unit, by the clock: how much, whether its gyro stream has stopped, and whether one producer sends it.
//!
//! Here alone a clock decides anything, and only about a stream's tail.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use isotherm_protocol::key::{Input, RawStream};
use isotherm_protocol::status::{Counter, InputRates};

use super::account::value_of;

/// Distance of messages that is assumed before two have been heard.
const ASSUMED_INTERVAL: Duration = Duration::from_millis(250);
/// A stream is stopped after this many times its usual distance of messages.
const INTERVALS: u32 = 4;
/// Longest distance of messages that is followed.
const LONGEST_INTERVAL: Duration = Duration::from_millis(2500);

/// Counters of what comes in, in the order of [`InputRates`].
const COUNTERS: [&str; 3] = ["gyro_ticks_in", "accel_ticks_in", "temperature_readings_in"];

/// How long a run that another one has followed is remembered.
const REMEMBERED: Duration = Duration::from_secs(10);
/// Returns to such a run from which on two producers are at work: one is what a late message does.
const RETURNS: u32 = 3;
/// Fewest ticks in an interval, and their smallest share, that contradict the others.
const FEWEST: u64 = 20;
const ONE_IN: u64 = 5;
/// Counters of ticks that a second producer's become.
const CONTRADICTING: [&str; 3] = ["gyro_late", "gyro_implausible", "gyro_duplicates"];
/// Gyro frames of which a repeat is the network's doing.
const REPEATED: usize = 8;

/// Follows the messages of one unit.
///
/// A producer that sends a batch of 64 ticks every 640 ms has not stopped 500 ms after the last one. The silence that
/// counts as a stop therefore grows with the distance of the messages, so that a flush by the clock never meets a
/// stream that goes on. A pause is no such distance, unless the one before it was as long and not many messages ago.
#[derive(Debug)]
pub(super) struct Arrivals {
    /// Shortest silence that counts as a stop.
    shortest: Duration,
    /// When the last gyro message came, and the distance of such messages.
    last: Option<Instant>,
    interval: Duration,
    /// The last silence that counted as a stop; it fades with each message after it.
    pause: Duration,
    messages: u64,
    /// The counters at the last look, and the rates between the last two looks.
    looked: (Instant, [u64; 4]),
    pub(super) rates: InputRates,
    /// The runs of the producer that were heard last.
    series: Option<u64>,
    previous: Option<(u64, Instant)>,
    returns: u32,
    /// Ticks that contradict others, at the last look.
    contradicting: u64,
    /// Length and checksum of the gyro frames that were heard last, and ticks since the last look that were in repeats of them.
    frames: VecDeque<(usize, [u8; 4])>,
    pub(super) repeated: u64,
}

impl Arrivals {
    /// A stream has stopped after `tail_flush`, and not before twice the unit's pairing window has passed.
    pub(super) fn new(tail_flush: Duration, pairing_window: Duration, now: Instant) -> Self {
        Self {
            shortest: tail_flush.max(pairing_window * 2),
            last: None,
            interval: ASSUMED_INTERVAL,
            pause: Duration::ZERO,
            messages: 0,
            looked: (now, [0; 4]),
            rates: InputRates::default(),
            series: None,
            previous: None,
            returns: 0,
            contradicting: 0,
            frames: VecDeque::with_capacity(REPEATED),
            repeated: 0,
        }
    }

    /// Whether a gyro frame is one of the last once more, to the bit.
    pub(super) fn is_repeat(&mut self, frame: &[u8]) -> bool {
        let Some(checksum) = frame.last_chunk() else { return false };
        let mark = (frame.len(), *checksum);
        let is_repeat = self.frames.contains(&mark);
        if !is_repeat {
            self.frames.truncate(REPEATED - 1);
            self.frames.push_front(mark);
        }
        is_repeat
    }

    /// A message has come; `series` is the producer's run that gyro ticks are of, where they could be read.
    pub(super) fn note(&mut self, input: Input, series: Option<u64>, now: Instant) {
        self.messages += 1;
        if input != Input::Raw(RawStream::Gyro) {
            return;
        }
        let was_over = self.is_over(now);
        if let Some(last) = self.last.replace(now) {
            let mut interval = now.saturating_duration_since(last);
            let pause =
                if was_over && interval <= LONGEST_INTERVAL { interval } else { self.pause * 15 / 16 };
            if was_over {
                interval = interval.min(self.pause);
            }
            self.pause = pause;
            // Up at once, down slowly: bursts do not make the stream look faster than it is.
            self.interval = interval.min(LONGEST_INTERVAL).max(self.interval * 15 / 16);
        }
        if series.is_some() && series != self.series {
            let before = std::mem::replace(&mut self.series, series);
            (self.interval, self.pause) = (ASSUMED_INTERVAL, Duration::ZERO);
            if let (Some(series), Some(before)) = (series, before) {
                let remembered = |at: Instant| now.saturating_duration_since(at) < REMEMBERED;
                let returns =
                    self.previous.is_some_and(|(previous, at)| previous == series && remembered(at));
                self.returns = if returns { self.returns.saturating_add(1) } else { 0 };
                self.previous = Some((before, now));
            }
        }
    }

    /// Whether no gyro message came for longer than a stated time; not before the first one.
    pub(super) fn is_silent_for(&self, now: Instant, longest: Duration) -> bool {
        self.last.is_some_and(|last| now.saturating_duration_since(last) > longest)
    }

    /// Whether the gyro stream has been silent for long enough to be called stopped.
    pub(super) fn is_over(&self, now: Instant) -> bool {
        let shortest = self.shortest.max(self.interval * INTERVALS);
        self.last.is_none_or(|last| now.saturating_duration_since(last) >= shortest)
    }

    /// Goes on from other counters: what they had before did not come since.
    pub(super) fn go_on_from(&mut self, now: Instant, counters: &[Counter]) {
        self.looked = (now, self.counts(counters));
        self.contradicting = contradicting(counters);
    }

    fn counts(&self, counters: &[Counter]) -> [u64; 4] {
        let [gyro, accel, temperature] = COUNTERS.map(|name| value_of(counters, name));
        [gyro, accel, temperature, self.messages]
    }

    /// Looks at what has come since the last look: measures the rates; in words where two producers are at work, which looks like an
    /// input of twice the rate and is none.
    #[expect(clippy::cast_precision_loss, reason = "fewer than 2⁵³ messages")]
    pub(super) fn look(&mut self, now: Instant, counters: &[Counter]) -> Option<String> {
        let counts = self.counts(counters);
        let (then, before) = std::mem::replace(&mut self.looked, (now, counts));
        let came: [u64; 4] = std::array::from_fn(|i| counts[i].saturating_sub(before[i]));
        let elapsed_s = now.saturating_duration_since(then).as_secs_f64();
        if elapsed_s > 0.0 {
            let [gyro_ticks_per_s, accel_ticks_per_s, temperature_readings_per_s, messages_per_s] =
                came.map(|count| count as f64 / elapsed_s);
            self.rates = InputRates {
                gyro_ticks_per_s,
                accel_ticks_per_s,
                temperature_readings_per_s,
                messages_per_s,
            };
        }
        self.two_producers(came[0], contradicting(counters))
    }

    /// Whether two producers are at work, in words; `ticks` came since the last look, and so many contradicted others so far.
    fn two_producers(&mut self, ticks: u64, contradicting: u64) -> Option<String> {
        let before = std::mem::replace(&mut self.contradicting, contradicting);
        let contradicting = contradicting.saturating_sub(before + std::mem::take(&mut self.repeated));
        if std::mem::take(&mut self.returns) >= RETURNS {
            let (one, other) = (self.previous.map_or(0, |(series, _)| series), self.series.unwrap_or(0));
            return Some(format!(
                "two producers: ticks of series {one} and {other} alternate; stop one of them"
            ));
        }
        let two = contradicting >= FEWEST && contradicting * ONE_IN >= ticks;
        two.then(|| {
            format!(
                "probably two producers: {contradicting} of {ticks} gyro ticks were late, contradictory or \
                 duplicates; stop one of them"
            )
        })
    }
}

/// Ticks that contradict others.
fn contradicting(counters: &[Counter]) -> u64 {
    CONTRADICTING.iter().map(|name| value_of(counters, name)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: Duration = Duration::from_millis(1);
    const GYRO: Input = Input::Raw(RawStream::Gyro);

    fn arrivals(tail_flush: u32, pairing_window: u32, now: Instant) -> Arrivals {
        let [tail_flush, pairing_window] = [tail_flush, pairing_window].map(|ms| MS * ms);
        Arrivals::new(tail_flush, pairing_window, now)
    }

    fn counters(ticks: u64, late: u64) -> [Counter; 2] {
        let counter = |name: &str, value| Counter { name: name.to_owned(), value };
        [counter("gyro_ticks_in", ticks), counter("gyro_late", late)]
    }

    /// Silence (ms) after which a stream counts as stopped, when its messages came at these distances (ms).
    fn silence(tail_flush: u32, pairing_window: u32, distances: &[u32]) -> u32 {
        let mut now = Instant::now();
        let mut arrivals = arrivals(tail_flush, pairing_window, now);
        arrivals.note(GYRO, Some(1), now);
        for distance in distances {
            now += MS * *distance;
            arrivals.note(GYRO, Some(1), now);
        }
        let silence =
            |arrivals: &Arrivals, now| (0..20_000).find(|ms| arrivals.is_over(now + MS * *ms)).unwrap();
        let of_this = silence(&arrivals, now);
        arrivals.note(GYRO, Some(2), now + MS);
        assert_eq!(
            silence(&arrivals, now + MS),
            1000.max(2 * pairing_window),
            "of a new series nothing is known"
        );
        of_this
    }

    #[test]
    fn the_silence_that_counts_as_a_stop_grows_with_the_distance_of_messages() {
        let fast = [5; 200];
        assert_eq!(silence(100, 50, &fast), 100, "the configured silence");
        assert_eq!(silence(100, 300, &fast), 600, "twice the pairing window");
        assert_eq!(silence(100, 50, &[640; 10]), 2560, "four times the distance");
        assert_eq!(silence(100, 50, &[]), 1000, "nothing is known of the distance yet");
        assert_eq!(silence(100, 50, &[2000, 1, 2000, 1, 2000]), 8000, "bursts every 2 s");
        assert_eq!(silence(100, 50, &[3000; 4]), 773, "pauses are no distance: four messages in a row");
        assert_eq!(silence(100, 50, &[&fast[..], &[2000, 5]].concat()), 100, "a pause is no distance");
    }

    #[test]
    fn rates_are_those_since_the_last_look() {
        let start = Instant::now();
        let mut arrivals = arrivals(100, 50, start);
        (0..50).for_each(|_| arrivals.note(Input::Reference, None, start));
        arrivals.look(start + Duration::from_millis(500), &counters(100, 0));
        assert_eq!((arrivals.rates.gyro_ticks_per_s, arrivals.rates.messages_per_s), (200.0, 100.0));
        arrivals.look(start + Duration::from_millis(1500), &counters(110, 0));
        assert_eq!((arrivals.rates.gyro_ticks_per_s, arrivals.rates.messages_per_s), (10.0, 0.0));
        // What the counters of another instance had before did not come here.
        arrivals.go_on_from(start + Duration::from_millis(1500), &counters(9000, 50));
        assert_eq!(arrivals.look(start + Duration::from_millis(2500), &counters(9020, 50)), None);
        assert_eq!((arrivals.rates.gyro_ticks_per_s, arrivals.rates.messages_per_s), (20.0, 0.0));
    }

    #[test]
    fn one_producer_is_one_though_it_restarts_and_sends_a_late_message() {
        let now = Instant::now();
        let mut arrivals = arrivals(100, 50, now);
        for series in [1, 1, 2, 2, 1, 2, 2, 3, 3] {
            arrivals.note(GYRO, Some(series), now);
        }
        assert_eq!(arrivals.look(now, &counters(400, 19)), None);
        assert_eq!(arrivals.look(now, &counters(800, 60)), None, "41 of 400 is below a fifth");
    }

    #[test]
    fn runs_by_turns_and_late_ticks_galore_are_two() {
        let now = Instant::now();
        let mut arrivals = arrivals(100, 50, now);
        for series in [1, 2, 1, 2, 1] {
            arrivals.note(GYRO, Some(series), now);
        }
        let by_turns = arrivals.look(now, &counters(400, 0)).unwrap();
        assert_eq!(arrivals.look(now, &counters(800, 0)), None, "it is over");
        let late = arrivals.look(now, &counters(1200, 200)).unwrap();
        insta::assert_snapshot!([by_turns, late].join("\n"));
    }
}
