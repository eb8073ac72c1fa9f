//! What the service published, on its way to the comparison with what is made again.

use std::collections::VecDeque;

use isotherm_correction::units::Timestamp;
use isotherm_protocol::codec;
use isotherm_protocol::corrected::CorrectedBatch;
use isotherm_protocol::key::{Input, RawStream};

use crate::diff::{Comparison, Side, ticks_of};
use crate::streams::decoded::Decoded;

/// How many ticks the published ones are kept ahead of those made again; more than the comparison looks ahead.
const AHEAD: usize = 4096;
/// Most bytes of frames that wait; beyond them the oldest are compared with what there is.
const MOST_BYTES: usize = 1 << 28;

/// Published frames whose turn has not come.
///
/// A replica waits where the place of an entry is not known yet, some seconds by the recorder's clock. In a log that was
/// played as fast as it went these are a million ticks, of which the comparison would give up most.
#[derive(Debug, Default)]
pub(super) struct Published {
    frames: VecDeque<Vec<u8>>,
    bytes: usize,
}

impl Published {
    pub(super) fn push(&mut self, frame: Vec<u8>) {
        self.bytes += frame.len();
        self.frames.push_back(frame);
    }

    /// Compares what can be compared; where the log is over, everything.
    pub(super) fn compare(&mut self, comparison: &mut Comparison, over: bool) {
        loop {
            while let (made, published) = comparison.waiting()
                && (over || published < made + AHEAD || self.bytes > MOST_BYTES)
                && let Some(frame) = self.frames.pop_front()
            {
                self.bytes -= frame.len();
                // What cannot be read is missing.
                let batch = codec::decode::<CorrectedBatch>(&frame).ok();
                let ticks = batch.and_then(|batch| ticks_of(batch).ok());
                ticks
                    .into_iter()
                    .flat_map(|ticks| ticks.ticks)
                    .for_each(|tick| comparison.push(Side::B, tick));
                if over {
                    comparison.advance();
                }
            }
            let before = comparison.waiting();
            comparison.advance();
            if self.frames.is_empty() || comparison.waiting() == before {
                break;
            }
        }
    }
}

/// The last raw frames of gyros and accelerometers in a recording: what was published behind them cannot be made again.
#[derive(Debug, Default)]
pub(super) struct RawEnd {
    gyro: Vec<u8>,
    accel: Vec<u8>,
}

impl RawEnd {
    pub(super) fn note(&mut self, stream: RawStream, frame: &[u8]) {
        let last = match stream {
            RawStream::Gyro => &mut self.gyro,
            RawStream::Accel => &mut self.accel,
            RawStream::Temperature | RawStream::Health => return,
        };
        last.clear();
        last.extend_from_slice(frame);
    }

    /// Whether the recording has what a tick is made of, that ends then; `made` is the end of the last tick that was made.
    pub(super) fn reaches(&self, end_time: Timestamp, made: Option<Timestamp>) -> bool {
        let last = |stream, frame| Some(Decoded::of_input(Input::Raw(stream), frame).ok()?.times()?[1]);
        let (gyro, accel) = (last(RawStream::Gyro, &self.gyro), last(RawStream::Accel, &self.accel));
        gyro != made
            && gyro.is_some_and(|gyro| gyro >= end_time)
            && accel.is_none_or(|accel| accel >= end_time)
    }
}

#[cfg(test)]
mod tests {
    use isotherm_correction::sample::CorrectedTick;
    use isotherm_correction::units::Timestamp;
    use isotherm_protocol::corrected::Revision;

    use super::*;
    use crate::diff::{DiffOptions, LogTick};

    const TICKS: u64 = 100_000;

    fn tick(sequence: u64) -> CorrectedTick {
        let end_time = Timestamp::from_ns(i64::try_from(sequence).unwrap() * 5_000_000);
        CorrectedTick { sequence, end_time, revision: 1, ..CorrectedTick::default() }
    }

    fn published() -> Published {
        published_but(TICKS)
    }

    /// Without the batch that begins there.
    fn published_but(missed: u64) -> Published {
        let mut published = Published::default();
        for first in (0..TICKS).step_by(100).filter(|first| *first != missed) {
            let batch = CorrectedBatch {
                unit: "A-1".to_owned(),
                series: 0,
                revision: Revision { counter: 1, digest: [7; 8] },
                temperatures: std::iter::empty().collect(),
                sigmas: Vec::new(),
                ticks: (first..first + 100).map(tick).collect(),
            };
            published.push(codec::encode(&batch).unwrap());
        }
        published
    }

    fn make(comparison: &mut Comparison, ticks: std::ops::Range<u64>) {
        ticks.for_each(|sequence| {
            comparison.push(Side::A, LogTick { tick: tick(sequence), digest: None, event: None });
        });
    }

    #[test]
    fn a_replica_that_is_far_behind_is_compared_all_the_same() {
        for stride in [50_000, 20_000, 1000] {
            let mut comparison = Comparison::new(DiffOptions::default(), false);
            let mut published = published();
            published.compare(&mut comparison, false);
            assert!(comparison.waiting().1 < 2 * AHEAD, "{:?}", comparison.waiting());
            for first in (0..TICKS).step_by(stride) {
                make(&mut comparison, first..(first + stride as u64).min(TICKS));
                published.compare(&mut comparison, false);
            }
            published.compare(&mut comparison, true);
            let account = comparison.finish();
            assert!(account.is_identical() && account.ticks == TICKS, "{account:#?}");
        }
    }

    #[test]
    fn what_only_the_recorder_missed_is_no_difference() {
        for (missed, reproduced) in [(5000, TICKS), (5000, 90_000), (TICKS, 90_000)] {
            let mut comparison = Comparison::new(DiffOptions::default(), false);
            let mut published = published_but(missed);
            for first in (0..reproduced).step_by(1000) {
                make(&mut comparison, first..first + 1000);
                published.compare(&mut comparison, false);
            }
            published.compare(&mut comparison, true);
            let account = comparison.finish();
            let alone = missed < TICKS && reproduced == TICKS;
            assert_eq!((account.unrecorded(), account.agrees()), (if alone { 100 } else { 0 }, false));
        }
    }

    #[test]
    fn what_was_not_made_again_is_missing_and_said_to_be() {
        let mut comparison = Comparison::new(DiffOptions::default(), false);
        let mut published = published();
        make(&mut comparison, 0..40_000);
        published.compare(&mut comparison, false);
        make(&mut comparison, 60_000..90_000);
        published.compare(&mut comparison, true);
        let account = comparison.finish();
        assert_eq!((account.ticks, account.only_b.between, account.only_b.behind), (70_000, 20_000, 10_000));
        assert_eq!((account.different, account.only_a.all()), (0, 0));
    }
}
