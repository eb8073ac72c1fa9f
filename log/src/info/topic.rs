//! One stream of a unit: rate, gaps, jitter.

use isotherm_protocol::codec::CodecError;
use serde::Serialize;

use super::histogram::{Histogram, Spread};
use super::sequence::{Order, Place, Run, Sequence};
use super::timing::{Delays, Jitter, seconds};

/// How often ticks come.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Rate {
    /// By the median time between ticks (Hz).
    pub nominal_hz: f64,
    /// By the number of ticks and the time they cover, gaps included (Hz).
    pub mean_hz: f64,
}

/// The longest time between two consecutive ticks.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct LongestInterval {
    /// How long (ns).
    pub ns: u64,
    /// End of the tick before it (ns on the producer's clock).
    pub after_ns: i64,
}

/// What a topic holds.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct TopicInfo {
    /// Its key.
    pub key: String,
    /// Messages, unreadable ones included.
    pub messages: u64,
    /// Bytes of their frames.
    pub bytes: u64,
    /// Messages that cannot be read.
    pub unreadable: u64,
    /// Why the first of them cannot.
    pub first_unreadable: Option<String>,
    /// Ticks, or times with readings.
    pub ticks: u64,
    /// End of the first tick, or time of the first reading (ns on the producer's clock).
    pub first_ns: Option<i64>,
    /// The same of the last.
    pub last_ns: Option<i64>,
    /// Time covered from the first to the last, jumps of the clock left out (s).
    pub duration_s: f64,
    /// How often they come; `None` for fewer than two.
    pub rate: Option<Rate>,
    /// Time between consecutive ticks, those around gaps left out.
    pub intervals: Option<Spread>,
    /// The longest of these.
    pub longest_interval: Option<LongestInterval>,
    /// Measured durations of the ticks.
    pub tick_durations: Option<Spread>,
    /// Times that the producer's clock did not go on from a tick to the next.
    pub time_went_back: u64,
    /// Gaps, duplicates, late ones; `None` for topics without sequence numbers.
    pub order: Option<Order>,
    /// Reception against the producer's clock; `None` for text logs.
    pub jitter: Option<Jitter>,
}

/// Follows one topic.
#[derive(Debug, Clone, Default)]
pub(super) struct TopicSurvey {
    key: String,
    messages: u64,
    bytes: u64,
    unreadable: u64,
    first_unreadable: Option<String>,
    ticks: u64,
    first_ns: Option<i64>,
    last_ns: Option<i64>,
    /// Sum of the steps from tick to tick (ns).
    covered_ns: i64,
    steps: u64,
    intervals: Histogram,
    longest: Option<LongestInterval>,
    durations: Histogram,
    time_went_back: u64,
    sequence: Option<Sequence>,
    delays: Delays,
}

/// A tick's end and duration (ns); for readings without duration 0.
pub(super) type TickTime = (i64, u64);

impl TopicSurvey {
    pub(super) fn new(key: String) -> Self {
        Self { key, ..Self::default() }
    }

    /// Counts a message.
    pub(super) fn message(&mut self, frame: &[u8]) {
        self.messages += 1;
        self.bytes += frame.len() as u64;
    }

    /// Counts a message that cannot be read.
    pub(super) fn unreadable(&mut self, error: &CodecError) {
        self.unreadable += 1;
        self.first_unreadable.get_or_insert_with(|| error.to_string());
    }

    /// Takes the consecutive ticks of a message.
    pub(super) fn ticks(
        &mut self,
        series: u64,
        first: u64,
        received_ns: u64,
        times: &(impl Iterator<Item = TickTime> + Clone),
    ) -> Place {
        let ends = || times.clone().map(|(end, _)| end);
        let (Some(first_end_ns), Some(last_end_ns)) = (ends().next(), ends().last()) else {
            return Place::Old;
        };
        let count = times.clone().count() as u64;
        let run = Run { series, first, ticks: count, first_end_ns, last_end_ns };
        let place = self.sequence.get_or_insert_default().take(run);
        self.ticks += count;
        for (_, duration) in times.clone() {
            self.durations.add(duration);
        }
        match place {
            Place::Old => {}
            Place::Start => self.steps_of(None, false, ends()),
            Place::Next => self.steps_of(self.last_ns, true, ends()),
            Place::BehindGap => self.steps_of(self.last_ns, false, ends()),
        }
        self.delays.take(received_ns, last_end_ns);
        place
    }

    /// Takes one output, which stands for so many raw ticks.
    pub(super) fn outputs(&mut self, first: u64, ticks: u64, end_ns: i64, duration_ns: u64) {
        let run = Run { series: 0, first, ticks, first_end_ns: end_ns, last_end_ns: end_ns };
        self.ticks += 1;
        self.durations.add(duration_ns);
        let ends = std::iter::once(end_ns);
        match self.sequence.get_or_insert_default().take(run) {
            Place::Old => {}
            Place::Start => self.steps_of(None, false, ends),
            Place::Next => self.steps_of(self.last_ns, true, ends),
            Place::BehindGap => self.steps_of(self.last_ns, false, ends),
        }
    }

    /// Notes when a message was received whose last tick ended then.
    pub(super) fn received(&mut self, received_ns: u64, event_ns: i64) {
        self.delays.take(received_ns, event_ns);
    }

    /// Takes times of readings, which have no sequence.
    pub(super) fn readings(&mut self, received_ns: u64, times: impl Iterator<Item = i64> + Clone) {
        let Some(last) = times.clone().last() else { return };
        self.ticks += times.clone().count() as u64;
        self.steps_of(self.last_ns, true, times);
        self.delays.take(received_ns, last);
    }

    /// Enters the steps from each tick to the next, beginning with the one from `before`.
    fn steps_of(&mut self, before: Option<i64>, contiguous: bool, ends: impl Iterator<Item = i64>) {
        let (mut before, mut contiguous) = (before, contiguous);
        for end in ends {
            self.first_ns.get_or_insert(end);
            if let Some(before) = before {
                let step = end.saturating_sub(before);
                if step <= 0 {
                    self.time_went_back += 1;
                } else {
                    self.covered_ns = self.covered_ns.saturating_add(step);
                    self.steps += 1;
                    if contiguous {
                        self.enter(step.unsigned_abs(), before);
                    }
                }
            }
            (before, contiguous) = (Some(end), true);
        }
        self.last_ns = before;
    }

    fn enter(&mut self, ns: u64, after_ns: i64) {
        self.intervals.add(ns);
        if self.longest.is_none_or(|longest| ns > longest.ns) {
            self.longest = Some(LongestInterval { ns, after_ns });
        }
    }

    /// Ticks so far.
    pub(super) fn count(&self) -> u64 {
        self.ticks
    }

    /// What it comes to; receive times say something only in recordings.
    pub(super) fn finish(self, recording: bool) -> TopicInfo {
        let duration_s = seconds(self.covered_ns);
        let nominal = self.intervals.median().filter(|&ns| ns > 0);
        let rate = nominal.filter(|_| self.covered_ns > 0).map(|ns| Rate {
            nominal_hz: 1.0 / seconds(i64::try_from(ns).unwrap_or(i64::MAX)),
            mean_hz: as_f64(self.steps) / duration_s,
        });
        TopicInfo {
            key: self.key,
            messages: self.messages,
            bytes: self.bytes,
            unreadable: self.unreadable,
            first_unreadable: self.first_unreadable,
            ticks: self.ticks,
            first_ns: self.first_ns,
            last_ns: self.last_ns,
            duration_s,
            rate,
            intervals: self.intervals.spread(),
            longest_interval: self.longest,
            tick_durations: self.durations.spread().filter(|spread| spread.max_ns > 0),
            time_went_back: self.time_went_back,
            order: self.sequence.map(|sequence| sequence.order()),
            jitter: if recording { self.delays.jitter() } else { None },
        }
    }
}

/// A count as a number to divide.
#[expect(clippy::cast_precision_loss, reason = "counts far below 2⁵³")]
fn as_f64(count: u64) -> f64 {
    count as f64
}
