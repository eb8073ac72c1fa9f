//! From single ticks and readings to frames, in the order that the service needs.

use std::collections::VecDeque;

use isotherm_correction::sample::{AccelTick, GyroTick, OutputKind, TemperatureReading};
use isotherm_correction::units::Timestamp;
use thiserror::Error;

use super::{AccelBatch, GyroBatch, MAX_CHANNELS, TemperatureBatch, TemperatureTick};
use crate::codec::{self, CodecError, MAX_TICKS, Message};
use crate::key::RawStream;

/// A tick that no frame can carry.
#[derive(Debug, Error)]
pub enum BatchError {
    /// A reading that is said to be a count and is none.
    #[error("tick {sequence}: its readings are no counts of 32 bits")]
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
        if !self.gyro.continues(output, tick.sequence, tick.readings.len()) {
            self.flush()?;
        }
        self.gyro.push(output, tick);
        if self.gyro.len() >= self.batch_ticks { self.flush() } else { Ok(()) }
    }

    /// Takes one accelerometer tick.
    ///
    /// # Errors
    /// As [`Batcher::gyro`].
    pub fn accel(&mut self, output: OutputKind, tick: AccelTick) -> Result<(), BatchError> {
        if !self.accel.continues(output, tick.sequence, tick.readings.len()) || self.accel.len() == MAX_TICKS
        {
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
            let time = batch.ticks.last().map_or(0, |tick| tick.time_ns);
            let ticks = batch.ticks.len();
            self.push(RawStream::Temperature, &batch, Timestamp::from_ns(time), 0, ticks)?;
        }
        Ok(())
    }

    fn flush_accel(&mut self) -> Result<(), BatchError> {
        let Some(output) = self.accel.output() else { return Ok(()) };
        let ticks = self.accel.take();
        for part in ticks.chunks(self.batch_ticks) {
            let (Some(first), Some(last)) = (part.first(), part.last()) else { continue };
            let batch = AccelBatch::from_core(output, part)
                .ok_or(BatchError::NotCounts { sequence: first.sequence })?;
            self.push(RawStream::Accel, &batch, last.end_time, first.sequence, part.len())?;
        }
        Ok(())
    }

    fn flush_gyro(&mut self) -> Result<(), BatchError> {
        let Some(output) = self.gyro.output() else { return Ok(()) };
        let ticks = self.gyro.take();
        let (Some(first), Some(last)) = (ticks.first(), ticks.last()) else { return Ok(()) };
        let batch =
            GyroBatch::from_core(output, &ticks).ok_or(BatchError::NotCounts { sequence: first.sequence })?;
        self.push(RawStream::Gyro, &batch, last.end_time, first.sequence, ticks.len())
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

/// A tick with a sequence number and readings.
trait Sequenced {
    fn sequence(&self) -> u64;
    fn sensors(&self) -> usize;
}

impl Sequenced for GyroTick {
    fn sequence(&self) -> u64 {
        self.sequence
    }
    fn sensors(&self) -> usize {
        self.readings.len()
    }
}

impl Sequenced for AccelTick {
    fn sequence(&self) -> u64 {
        self.sequence
    }
    fn sensors(&self) -> usize {
        self.readings.len()
    }
}

/// Consecutive ticks of one kind and number of readings.
#[derive(Debug)]
struct Pending<T> {
    output: Option<OutputKind>,
    ticks: Vec<T>,
}

impl<T> Default for Pending<T> {
    fn default() -> Self {
        Self { output: None, ticks: Vec::new() }
    }
}

impl<T: Sequenced> Pending<T> {
    /// Whether such a tick can stand in the same batch as those that wait.
    fn continues(&self, output: OutputKind, sequence: u64, sensors: usize) -> bool {
        self.ticks.last().is_none_or(|last| {
            self.output == Some(output)
                && last.sequence().checked_add(1) == Some(sequence)
                && last.sensors() == sensors
        })
    }

    fn push(&mut self, output: OutputKind, tick: T) {
        self.output = Some(output);
        self.ticks.push(tick);
    }

    fn len(&self) -> usize {
        self.ticks.len()
    }

    /// What the readings stand for; `None` where no tick waits.
    fn output(&self) -> Option<OutputKind> {
        if self.ticks.is_empty() { None } else { self.output }
    }

    fn take(&mut self) -> Vec<T> {
        std::mem::take(&mut self.ticks)
    }
}

/// Batches of the readings in their order: readings of one time make a tick, ticks of the same channels a batch.
fn temperature_batches(readings: &[TemperatureReading]) -> Vec<TemperatureBatch> {
    let mut batches: Vec<TemperatureBatch> = Vec::new();
    let mut rest = readings;
    while let Some(first) = rest.first() {
        let count = tick_length(rest, first.time);
        let (tick, others) = rest.split_at(count);
        rest = others;
        let wire = TemperatureTick {
            time_ns: first.time.as_ns(),
            raw: tick.iter().map(|reading| reading.raw).collect(),
        };
        match batches.last_mut() {
            Some(batch)
                if batch.ticks.len() < MAX_TICKS
                    && batch.channels.iter().eq(tick.iter().map(|r| &r.channel)) =>
            {
                batch.ticks.push(wire);
            }
            _ => batches.push(TemperatureBatch {
                channels: tick.iter().map(|reading| reading.channel).collect(),
                ticks: vec![wire],
            }),
        }
    }
    batches
}

/// Number of readings in front that belong to one tick: one time, each channel once.
fn tick_length(readings: &[TemperatureReading], time: Timestamp) -> usize {
    readings
        .iter()
        .take(MAX_CHANNELS)
        .enumerate()
        .take_while(|(index, reading)| {
            reading.time == time
                && readings[..*index].iter().all(|earlier| earlier.channel != reading.channel)
        })
        .count()
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
        let shape: Vec<_> = batches.iter().map(|batch| (batch.channels.len(), batch.ticks.len())).collect();
        assert_eq!(shape, [(2, 2), (1, 2)]);
        let back: Vec<_> = batches.iter().flat_map(TemperatureBatch::to_core).collect();
        assert_eq!(back, readings);
        assert!(temperature_batches(&[]).is_empty());
    }

    #[test]
    fn a_jump_of_the_sequence_or_another_kind_ends_a_batch() {
        let mut pending = Pending::default();
        assert!(pending.continues(OutputKind::Counts, 9, 3));
        pending.push(OutputKind::Counts, AccelTick { sequence: 9, ..AccelTick::default() });
        assert!(pending.continues(OutputKind::Counts, 10, 0));
        assert!(!pending.continues(OutputKind::Counts, 11, 0), "jump");
        assert!(!pending.continues(OutputKind::Mean, 10, 0), "kind");
        assert!(!pending.continues(OutputKind::Counts, 10, 3), "sensors");
    }
}
