//! From single ticks and readings to frames, in the order that the service needs.

use std::collections::VecDeque;

use isotherm_correction::sample::{AccelTick, GyroTick, OutputKind, TemperatureReading};
use isotherm_correction::units::Timestamp;
use thiserror::Error;

use super::temperature::ticks;
use super::{AccelBatch, GyroBatch, RawBatch, RawTick, TemperatureBatch};
use crate::codec::{self, CodecError, MAX_TICKS, Message};
use crate::key::{Input, RawStream};

/// A batch that no frame can carry: it is given up, and nothing else.
#[derive(Debug, Error)]
#[error("{} ticks from {first_sequence} on: {source}", Input::Raw(*stream).name())]
pub struct BatchError {
    /// Its topic.
    pub stream: RawStream,
    /// Sequence number of its first tick; 0 for temperatures.
    pub first_sequence: u64,
    /// What the codec refuses.
    pub source: CodecError,
}

/// A raw batch as a frame.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RawFrame {
    /// Its topic.
    pub stream: RawStream,
    /// The frame.
    pub frame: Vec<u8>,
    /// End of its last tick, or time of its last reading.
    pub time: Timestamp,
    /// Sequence number of its first tick; 0 for temperatures.
    pub first_sequence: u64,
    /// Ticks in it.
    pub ticks: u64,
}

/// Puts ticks and readings into batches.
///
/// They are handed over in the order of their times, at equal times temperatures before accelerometer before gyro ticks.
/// A gyro batch is ready when it is full; the temperatures and accelerometer ticks handed over before it are ready before
/// it. What is ready is taken with [`Batcher::next_frame`].
#[derive(Debug)]
pub struct Batcher {
    batch_ticks: usize,
    gyro: GyroBatch,
    accel: AccelBatch,
    temperature: Vec<TemperatureReading>,
    ready: VecDeque<Result<RawFrame, BatchError>>,
}

impl Batcher {
    /// Nothing handed over; gyro batches of this many ticks (1…4096, held to that).
    #[must_use]
    pub fn new(batch_ticks: usize) -> Self {
        Self {
            batch_ticks: batch_ticks.clamp(1, MAX_TICKS),
            gyro: RawBatch::empty(),
            accel: RawBatch::empty(),
            temperature: Vec::new(),
            ready: VecDeque::new(),
        }
    }

    /// Takes one gyro tick.
    pub fn gyro(&mut self, output: OutputKind, tick: GyroTick) {
        if !self.gyro.continues(output, &tick) {
            self.flush();
        }
        self.gyro.push(output, tick);
        if self.gyro.ticks.len() >= self.batch_ticks {
            self.flush();
        }
    }

    /// Takes one accelerometer tick.
    pub fn accel(&mut self, output: OutputKind, tick: AccelTick) {
        if !self.accel.continues(output, &tick) || self.accel.ticks.len() == MAX_TICKS {
            self.flush_accel();
        }
        self.accel.push(output, tick);
    }

    /// Takes one temperature reading.
    pub fn temperature(&mut self, reading: TemperatureReading) {
        self.temperature.push(reading);
        if self.temperature.len() >= MAX_TICKS {
            self.flush_temperatures();
        }
    }

    /// Makes everything ready that was handed over, full batch or not.
    pub fn flush(&mut self) {
        self.flush_temperatures();
        self.flush_accel();
        let batch = std::mem::replace(&mut self.gyro, RawBatch::empty());
        self.push_ticks(RawStream::Gyro, &batch);
    }

    /// Takes the next frame that is ready, or what is wrong with the batch in its place.
    pub fn next_frame(&mut self) -> Option<Result<RawFrame, BatchError>> {
        self.ready.pop_front()
    }

    fn flush_temperatures(&mut self) {
        let readings = std::mem::take(&mut self.temperature);
        for batch in temperature_batches(&readings) {
            let time = batch.readings.last().map_or_else(Timestamp::default, |reading| reading.time);
            self.push(RawStream::Temperature, &batch, time, 0, batch.ticks().count());
        }
    }

    fn flush_accel(&mut self) {
        let RawBatch { output, ticks } = std::mem::replace(&mut self.accel, RawBatch::empty());
        for part in ticks.chunks(self.batch_ticks) {
            self.push_ticks(RawStream::Accel, &RawBatch { output, ticks: part.to_vec() });
        }
    }

    fn push_ticks<T: RawTick>(&mut self, stream: RawStream, batch: &RawBatch<T>) {
        if let (Some(first), Some(last)) = (batch.ticks.first(), batch.ticks.last()) {
            let (sequence, (time, _)) = (first.parts().sequence, last.parts().times);
            self.push(stream, batch, time, sequence, batch.ticks.len());
        }
    }

    fn push(
        &mut self,
        stream: RawStream,
        batch: &impl Message,
        time: Timestamp,
        first_sequence: u64,
        ticks: usize,
    ) {
        self.ready.push_back(match codec::encode(batch) {
            Ok(frame) => Ok(RawFrame { stream, frame, time, first_sequence, ticks: ticks as u64 }),
            Err(source) => Err(BatchError { stream, first_sequence, source }),
        });
    }
}

/// Consecutive ticks of one kind and number of readings, while they are gathered.
impl<T: RawTick> RawBatch<T> {
    fn empty() -> Self {
        Self { output: OutputKind::Counts, ticks: Vec::new() }
    }

    /// Whether such a tick can stand in the same batch as those that wait.
    fn continues(&self, output: OutputKind, tick: &T) -> bool {
        self.ticks.last().is_none_or(|last| {
            let (last, tick) = (last.parts(), tick.parts());
            self.output == output
                && last.sequence.checked_add(1) == Some(tick.sequence)
                && last.readings.len() == tick.readings.len()
        })
    }

    fn push(&mut self, output: OutputKind, tick: T) {
        self.output = output;
        self.ticks.push(tick);
    }
}

/// Batches of the readings in their order, each of ticks of the same channels.
fn temperature_batches(readings: &[TemperatureReading]) -> Vec<TemperatureBatch> {
    let mut batches: Vec<TemperatureBatch> = Vec::new();
    // A tick of the last batch, and how many it has.
    let mut last: (&[TemperatureReading], usize) = (&[], 0);
    for tick in ticks(readings) {
        let alike =
            last.0.iter().map(|reading| reading.channel).eq(tick.iter().map(|reading| reading.channel));
        match batches.last_mut() {
            Some(batch) if last.1 < MAX_TICKS && alike => batch.readings.extend_from_slice(tick),
            _ => {
                batches.push(TemperatureBatch { readings: tick.to_vec() });
                last.1 = 0;
            }
        }
        last = (tick, last.1 + 1);
    }
    batches
}

#[cfg(test)]
mod tests {
    use super::*;
    use isotherm_correction::sample::ChannelName;

    fn reading(channel: &str, time_ns: i64, raw: f64) -> TemperatureReading {
        TemperatureReading {
            channel: ChannelName::from(channel).unwrap(),
            time: Timestamp::from_ns(time_ns),
            raw,
        }
    }

    #[test]
    fn readings_of_one_time_make_a_tick_and_equal_channels_a_batch() {
        let readings = [
            reading("body", 1, 20.0),
            reading("coil", 1, 21.0),
            reading("body", 2, 20.5),
            reading("coil", 2, 21.5),
            reading("coil", 3, 22.0),
            reading("coil", 3, 22.5),
        ];
        let batches = temperature_batches(&readings);
        let shape: Vec<_> =
            batches.iter().map(|batch| batch.ticks().map(<[_]>::len).collect::<Vec<_>>()).collect();
        assert_eq!(shape, [vec![2, 2], vec![1, 1]]);
        let back: Vec<_> = batches.into_iter().flat_map(|batch| batch.readings).collect();
        assert_eq!(back, readings);
        assert!(temperature_batches(&[]).is_empty());
    }

    #[test]
    fn a_jump_of_the_sequence_or_another_kind_ends_a_batch() {
        let tick = |sequence, sensors: usize| AccelTick {
            sequence,
            readings: (0..sensors).map(|_| 0.0).collect(),
            ..AccelTick::default()
        };
        let mut pending = RawBatch::empty();
        assert!(pending.continues(OutputKind::Counts, &tick(9, 3)));
        pending.push(OutputKind::Counts, tick(9, 0));
        assert!(pending.continues(OutputKind::Counts, &tick(10, 0)));
        assert!(!pending.continues(OutputKind::Counts, &tick(11, 0)), "jump");
        assert!(!pending.continues(OutputKind::Mean, &tick(10, 0)), "kind");
        assert!(!pending.continues(OutputKind::Counts, &tick(10, 3)), "sensors");
    }

    #[test]
    fn a_batch_that_no_frame_can_carry_is_named_and_nothing_else_is_lost() {
        let mut batcher = Batcher::new(2);
        for (sequence, reading) in [(7, 1.0), (8, 0.5), (9, 2.0), (10, 3.0)] {
            let readings = || [reading].into_iter().collect();
            batcher.accel(
                OutputKind::Counts,
                AccelTick { sequence, readings: readings(), ..AccelTick::default() },
            );
            // The first of another batch comes while the one before cannot go out.
            let sequence = if sequence > 7 { sequence + 10 } else { sequence };
            batcher
                .gyro(OutputKind::Counts, GyroTick { sequence, readings: readings(), ..GyroTick::default() });
        }
        batcher.flush();
        let told = std::iter::from_fn(|| batcher.next_frame()).map(|ready| match ready {
            Ok(RawFrame { stream, first_sequence, ticks, .. }) => {
                format!("{stream:?} {first_sequence}, {ticks} ticks")
            }
            Err(error) => error.to_string(),
        });
        insta::assert_snapshot!(told.collect::<Vec<_>>().join("\n"));
    }
}
