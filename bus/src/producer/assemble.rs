//! From single ticks and readings to batches that the codec takes.

use isotherm_correction::sample::{AccelTick, GyroTick, OutputKind, TemperatureReading};
use isotherm_correction::units::Timestamp;
use isotherm_protocol::codec::MAX_TICKS;
use isotherm_protocol::raw::{MAX_CHANNELS, TemperatureBatch, TemperatureTick};

/// A tick with a sequence number and readings.
pub(super) trait Sequenced {
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
pub(super) struct Pending<T> {
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
    pub(super) fn continues(&self, output: OutputKind, sequence: u64, sensors: usize) -> bool {
        self.ticks.last().is_none_or(|last| {
            self.output == Some(output)
                && last.sequence().checked_add(1) == Some(sequence)
                && last.sensors() == sensors
        })
    }

    pub(super) fn push(&mut self, output: OutputKind, tick: T) {
        self.output = Some(output);
        self.ticks.push(tick);
    }

    pub(super) fn len(&self) -> usize {
        self.ticks.len()
    }

    /// What the readings stand for; `None` where no tick waits.
    pub(super) fn output(&self) -> Option<OutputKind> {
        if self.ticks.is_empty() { None } else { self.output }
    }

    pub(super) fn take(&mut self) -> Vec<T> {
        std::mem::take(&mut self.ticks)
    }
}

/// Batches of the readings in their order: readings of one time make a tick, ticks of the same channels a batch.
pub(super) fn temperature_batches(readings: &[TemperatureReading]) -> Vec<TemperatureBatch> {
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
