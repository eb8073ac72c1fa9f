//! From single ticks and readings to frames, in the order that the service needs.

use std::collections::VecDeque;

use isotherm_correction::sample::{AccelTick, GyroTick, OutputKind, TemperatureReading};
use isotherm_correction::units::Timestamp;
use thiserror::Error;

use super::temperature::ticks;
use super::{RawBatch, RawTick, TemperatureBatch};
use crate::codec::{self, CodecError, MAX_TICKS, Message};
use crate::key::RawStream;

/// A tick that no frame can carry.
#[derive(Debug, Error)]
pub enum BatchError {
    /// A reading that is said to be a count and is none.
    #[error("tick {sequence}: its readings are not counts of 32 bits")]
    NotCounts {
        /// Sequence number of the first tick of the batch.
        sequence: u64,
    },
    /// What the codec refuses.
    #[error(transparent)]
    Codec(#[from] CodecError),
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
    gyro: Pending<GyroTick>,
    accel: Pending<AccelTick>,
    temperature: Vec<TemperatureReading>,
    ready: VecDeque<RawFrame>,
}

impl Batcher {
    /// Nothing handed over; gyro batches of this many ticks (1…4096, held to that).
    #[must_use]
    pub fn new(batch_ticks: usize) -> Self {
        Self {
            batch_ticks: batch_ticks.clamp(1, MAX_TICKS),
            gyro: Pending::default(),
            accel: Pending::default(),
            temperature: Vec::new(),
            ready: VecDeque::new(),
        }
    }

    /// Takes one gyro tick.
    ///
    /// # Errors
    /// [`BatchError`]: the batch that cannot be a frame is given up.
    pub fn gyro(&mut self, output: OutputKind, tick: GyroTick) -> Result<(), BatchError> {
        if !self.gyro.continues(output, &tick) {
            self.flush()?;
        }
        self.gyro.push(output, tick);
        if self.gyro.ticks.len() >= self.batch_ticks { self.flush() } else { Ok(()) }
    }

    /// Takes one accelerometer tick.
    ///
    /// # Errors
    /// As [`Batcher::gyro`].
    pub fn accel(&mut self, output: OutputKind, tick: AccelTick) -> Result<(), BatchError> {
        if !self.accel.continues(output, &tick) || self.accel.ticks.len() == MAX_TICKS {
            self.flush_accel()?;
        }
        self.accel.push(output, tick);
        Ok(())
    }

    /// Takes one temperature reading.
    ///
    /// # Errors
    /// As [`Batcher::gyro`].
    pub fn temperature(&mut self, reading: TemperatureReading) -> Result<(), BatchError> {
        self.temperature.push(reading);
        if self.temperature.len() >= MAX_TICKS { self.flush_temperatures() } else { Ok(()) }
    }

    /// Makes everything ready that was handed over, full batch or not.
    ///
    /// # Errors
    /// As [`Batcher::gyro`].
    pub fn flush(&mut self) -> Result<(), BatchError> {
        self.flush_temperatures()?;
        self.flush_accel()?;
        self.flush_gyro()
    }

    /// Takes the next frame that is ready.
    pub fn next_frame(&mut self) -> Option<RawFrame> {
        self.ready.pop_front()
    }

    fn flush_temperatures(&mut self) -> Result<(), BatchError> {
        let readings = std::mem::take(&mut self.temperature);
        for batch in temperature_batches(&readings) {
            let time = batch.readings.last().map_or_else(Timestamp::default, |reading| reading.time);
            self.push(RawStream::Temperature, &batch, time, 0, batch.ticks().count())?;
        }
        Ok(())
    }

    fn flush_accel(&mut self) -> Result<(), BatchError> {
        let (output, ticks) = self.accel.take();
        for part in ticks.chunks(self.batch_ticks) {
            self.push_ticks(RawStream::Accel, &RawBatch { output, ticks: part.to_vec() })?;
        }
        Ok(())
    }

    fn flush_gyro(&mut self) -> Result<(), BatchError> {
        let (output, ticks) = self.gyro.take();
        self.push_ticks(RawStream::Gyro, &RawBatch { output, ticks })
    }

    fn push_ticks<T: RawTick>(&mut self, stream: RawStream, batch: &RawBatch<T>) -> Result<(), BatchError> {
        let (Some(first), Some(last)) = (batch.ticks.first(), batch.ticks.last()) else { return Ok(()) };
        let (sequence, (time, _)) = (first.parts().sequence, last.parts().times);
        self.push(stream, batch, time, sequence, batch.ticks.len()).map_err(|error| match error {
            BatchError::Codec(CodecError::NotCounts { .. }) => BatchError::NotCounts { sequence },
            error => error,
        })
    }

    fn push(
        &mut self,
        stream: RawStream,
        batch: &impl Message,
        time: Timestamp,
        first_sequence: u64,
        ticks: usize,
    ) -> Result<(), BatchError> {
        let frame = codec::encode(batch)?;
        self.ready.push_back(RawFrame { stream, frame, time, first_sequence, ticks: ticks as u64 });
        Ok(())
    }
}

/// Consecutive ticks of one kind and number of readings.
#[derive(Debug)]
struct Pending<T> {
    output: OutputKind,
    ticks: Vec<T>,
}

impl<T> Default for Pending<T> {
    fn default() -> Self {
        Self { output: OutputKind::Counts, ticks: Vec::new() }
    }
}

impl<T: RawTick> Pending<T> {
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

    fn take(&mut self) -> (OutputKind, Vec<T>) {
        (self.output, std::mem::take(&mut self.ticks))
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
        let mut pending = Pending::default();
        assert!(pending.continues(OutputKind::Counts, &tick(9, 3)));
        pending.push(OutputKind::Counts, tick(9, 0));
        assert!(pending.continues(OutputKind::Counts, &tick(10, 0)));
        assert!(!pending.continues(OutputKind::Counts, &tick(11, 0)), "jump");
        assert!(!pending.continues(OutputKind::Mean, &tick(10, 0)), "kind");
        assert!(!pending.continues(OutputKind::Counts, &tick(10, 3)), "sensors");
    }

    #[test]
    fn readings_that_are_no_counts_are_named() {
        let mut batcher = Batcher::new(1);
        let readings = [1.0, 0.5].into_iter().collect();
        let error = batcher
            .gyro(OutputKind::Counts, GyroTick { sequence: 7, readings, ..GyroTick::default() })
            .unwrap_err();
        assert_eq!(error.to_string(), "tick 7: its readings are not counts of 32 bits");
    }
}
