//! One stream of a unit: rate, gaps, jitter.

use isotherm_protocol::codec::CodecError;
use serde::Serialize;

use super::histogram::{Histogram, Spread};
use super::sequence::{Order, Place, Run, Sequence};
use super::timing::{Delays, Jitter};
use crate::date::seconds;

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
    /// As far as it is known before the end.
    info: TopicInfo,
    /// Sum of the steps from tick to tick (ns).
    covered_ns: i64,
    steps: u64,
    intervals: Histogram,
    durations: Histogram,
    sequence: Option<Sequence>,
    delays: Delays,
}

/// A tick's end and duration (ns); for readings without duration 0.
pub(super) type TickTime = (i64, u64);

impl TopicSurvey {
    pub(super) fn new(key: String) -> Self {
        Self { info: TopicInfo { key, ..TopicInfo::default() }, ..Self::default() }
    }

    /// Counts a message.
    pub(super) fn message(&mut self, frame: &[u8]) {
        self.info.messages += 1;
        self.info.bytes += frame.len() as u64;
    }

    /// Counts a message that cannot be read.
    pub(super) fn unreadable(&mut self, error: &CodecError) {
        self.info.unreadable += 1;
        self.info.first_unreadable.get_or_insert_with(|| error.to_string());
    }

    /// Takes the consecutive ticks of a message.
    pub(super) fn ticks(
        &mut self,
        series: Option<u64>,
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
        for (_, duration) in times.clone() {
            self.durations.add(duration);
        }
        let place = self.run(run, count, ends());
        self.delays.take(received_ns, last_end_ns);
        place
    }

    /// Takes one output, which stands for so many raw ticks.
    pub(super) fn outputs(&mut self, series: u64, first: u64, ticks: u64, (end_ns, duration_ns): TickTime) {
        let run = Run { series: Some(series), first, ticks, first_end_ns: end_ns, last_end_ns: end_ns };
        self.durations.add(duration_ns);
        self.run(run, 1, std::iter::once(end_ns));
    }

    /// Takes ticks or an output, which end at these times.
    fn run(&mut self, run: Run, count: u64, ends: impl Iterator<Item = i64>) -> Place {
        self.info.ticks += count;
        let place = self.sequence.get_or_insert_default().take(run);
        match place {
            Place::Old => {}
            Place::Start => self.steps_of(None, false, ends),
            Place::Next => self.steps_of(self.info.last_ns, true, ends),
            Place::BehindGap => self.steps_of(self.info.last_ns, false, ends),
        }
        place
    }

    /// Notes when a message was received whose last tick ended then.
    pub(super) fn received(&mut self, received_ns: u64, event_ns: i64) {
        self.delays.take(received_ns, event_ns);
    }

    /// Takes times of readings, which have no sequence.
    pub(super) fn readings(&mut self, received_ns: u64, times: impl Iterator<Item = i64> + Clone) {
        let Some(last) = times.clone().last() else { return };
        self.info.ticks += times.clone().count() as u64;
        self.steps_of(self.info.last_ns, true, times);
        self.delays.take(received_ns, last);
    }

    /// Enters the steps from each tick to the next, beginning with the one from `before`.
    fn steps_of(&mut self, before: Option<i64>, contiguous: bool, ends: impl Iterator<Item = i64>) {
        let (mut before, mut contiguous) = (before, contiguous);
        for end in ends {
            self.info.first_ns.get_or_insert(end);
            if let Some(before) = before {
                let step = end.saturating_sub(before);
                if step <= 0 {
                    self.info.time_went_back += 1;
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
        self.info.last_ns = before;
    }

    fn enter(&mut self, ns: u64, after_ns: i64) {
        self.intervals.add(ns);
        if self.info.longest_interval.is_none_or(|longest| ns > longest.ns) {
            self.info.longest_interval = Some(LongestInterval { ns, after_ns });
        }
    }

    /// Ticks so far.
    pub(super) fn count(&self) -> u64 {
        self.info.ticks
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
            duration_s,
            rate,
            intervals: self.intervals.spread(),
            tick_durations: self.durations.spread().filter(|spread| spread.max_ns > 0),
            order: self.sequence.map(|sequence| sequence.order()),
            jitter: if recording { self.delays.jitter() } else { None },
            ..self.info
        }
    }
}

/// A count as a number to divide.
#[expect(clippy::cast_precision_loss, reason = "counts far below 2⁵³")]
fn as_f64(count: u64) -> f64 {
    count as f64
}
