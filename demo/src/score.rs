//! One unit's account: what was sent, what came back, how far either is from the truth, how long it took.

use std::collections::VecDeque;
use std::time::Instant;

use isotherm_correction::sample::TickFlags;
use isotherm_protocol::corrected::{CorrectedBatch, CorrectedTick};

use isotherm_service::receive::latency::Histogram;

use super::switch::{Switch, SwitchWatch, Tick};
use super::windows::{Mean, Windows};

/// A raw tick that is about to be sent, as far as the account needs it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct SentTick {
    pub(crate) sequence: u64,
    /// End of the tick after the start of the run (s of event time).
    pub(crate) end_s: f64,
    pub(crate) duration_s: f64,
    /// Raw angle increments about the case axes by nominal scale and axes (rad).
    pub(crate) raw: [f64; 3],
    /// True angle increments (rad).
    pub(crate) truth: [f64; 3],
    pub(crate) switch_command: bool,
}

/// Temperatures at one time (°C).
#[derive(Debug, Clone, Copy)]
pub(crate) struct Temperatures {
    pub(crate) time_s: f64,
    pub(crate) chamber: f64,
    /// Mean over the gyros, each at its sensor.
    pub(crate) gyros: f64,
    pub(crate) board: f64,
}

/// A raw batch that is about to be sent.
#[derive(Debug)]
pub(crate) struct SentBatch {
    /// When it is handed to Zenoh.
    pub(crate) at: Instant,
    pub(crate) ticks: Vec<SentTick>,
    /// At the end of the batch.
    pub(crate) temperatures: Option<Temperatures>,
}

/// The account.
#[derive(Debug)]
pub(crate) struct Score {
    pub(crate) sent: u64,
    expected: VecDeque<SentTick>,
    under_way: VecDeque<(u64, Instant)>,
    pub(crate) windows: Windows,
    temperatures: Vec<Temperatures>,
    switches: SwitchWatch,
    end_to_end: Histogram,
}

/// What the account comes to.
#[derive(Debug)]
pub(crate) struct Scored {
    pub(crate) sent: u64,
    pub(crate) means: Vec<Mean>,
    pub(crate) temperatures: Vec<Temperatures>,
    pub(crate) switch: Option<Switch>,
    /// From handing over the raw batch of the oldest tick to receiving the corrected one: median and 99th
    /// percentile over all corrected batches (ns).
    pub(crate) end_to_end_ns: [u64; 2],
}

impl Score {
    /// An empty account with errors averaged over `averaging_s`.
    pub(crate) fn new(averaging_s: f64) -> Self {
        Self {
            sent: 0,
            expected: VecDeque::new(),
            under_way: VecDeque::new(),
            windows: Windows::new(averaging_s),
            temperatures: Vec::new(),
            switches: SwitchWatch::default(),
            end_to_end: Histogram::default(),
        }
    }

    /// Enters a raw batch.
    pub(crate) fn send(&mut self, batch: SentBatch) {
        self.sent += batch.ticks.len() as u64;
        if let Some(last) = batch.ticks.last() {
            self.under_way.push_back((last.sequence, batch.at));
        }
        self.expected.extend(batch.ticks);
        self.temperatures.extend(batch.temperatures);
    }

    /// Enters a corrected batch that was received at `at`.
    pub(crate) fn receive(&mut self, batch: &CorrectedBatch, at: Instant) {
        if let Some(oldest) = batch.ticks.first() {
            while self.under_way.front().is_some_and(|(last, _)| *last < oldest.sequence) {
                self.under_way.pop_front();
            }
            if let Some((_, sent)) = self.under_way.front() {
                let took = at.saturating_duration_since(*sent).as_nanos();
                self.end_to_end.record(u64::try_from(took).unwrap_or(u64::MAX));
            }
        }
        for tick in &batch.ticks {
            while self.expected.front().is_some_and(|sent| sent.sequence < tick.sequence) {
                self.expected.pop_front();
            }
            if self.expected.front().is_some_and(|sent| sent.sequence == tick.sequence)
                && let Some(sent) = self.expected.pop_front()
            {
                self.compare(sent, tick);
            }
        }
    }

    fn compare(&mut self, sent: SentTick, tick: &CorrectedTick) {
        let corrected = tick.delta_angle;
        self.windows.add(
            sent.end_s,
            sent.duration_s,
            minus(sent.raw, sent.truth),
            minus(corrected, sent.truth),
        );
        let interpolated = tick.flags.contains(TickFlags::INTERPOLATED);
        self.switches.push(Tick { sent, corrected, interpolated });
    }

    /// Closes the account.
    pub(crate) fn finish(self) -> Scored {
        Scored {
            sent: self.sent,
            means: self.windows.finish(),
            temperatures: self.temperatures,
            switch: self.switches.finish(),
            end_to_end_ns: [0.5, 0.99].map(|share| self.end_to_end.quantile(share)),
        }
    }
}

pub(crate) fn minus(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

#[cfg(test)]
mod tests {
    use super::*;
    use isotherm_protocol::corrected::Revision;
    use std::time::Duration;

    fn sent(first: u64, count: u64, at: Instant) -> SentBatch {
        let tick = |sequence: u64| SentTick {
            sequence,
            end_s: f64::from(u32::try_from(sequence).unwrap() + 1),
            duration_s: 1.0,
            raw: [5.0; 3],
            truth: [1.0; 3],
            switch_command: false,
        };
        SentBatch { at, ticks: (first..first + count).map(tick).collect(), temperatures: None }
    }

    fn received(sequences: &[u64]) -> CorrectedBatch {
        let tick = |&sequence| CorrectedTick { sequence, delta_angle: [1.5; 3], ..CorrectedTick::default() };
        CorrectedBatch {
            unit: "A".into(),
            series: 0,
            revision: Revision::default(),
            temperatures: std::iter::empty().collect(),
            sigmas: Vec::new(),
            ticks: sequences.iter().map(tick).collect(),
        }
    }

    #[test]
    fn ticks_meet_their_own_truth_over_gaps_and_other_batches() {
        let start = Instant::now();
        let mut score = Score::new(1.0);
        score.send(sent(0, 3, start));
        score.send(sent(3, 3, start + Duration::from_millis(1)));
        score.receive(&received(&[0, 1]), start + Duration::from_millis(2));
        score.receive(&received(&[3, 4, 5]), start + Duration::from_millis(4));
        let scored = score.finish();
        assert_eq!(scored.sent, 6);
        assert_eq!(scored.means.len(), 5, "tick 2 never came back");
        for mean in &scored.means {
            assert!((mean.raw[1] - 4.0).abs() < 1e-12 && (mean.corrected[2] - 0.5).abs() < 1e-12, "{mean:?}");
        }
        let [median, slowest] = scored.end_to_end_ns;
        assert!((2_000_000..2_200_000).contains(&median) && slowest == 3_000_000, "{median} {slowest}");
    }
}
