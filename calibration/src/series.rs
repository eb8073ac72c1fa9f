//! A log as columns: what a unit measured, tick by tick.

use std::collections::BTreeMap;

use isotherm_correction::sample::{LasingMode, OutputKind};
use isotherm_log::message::Topic;
use isotherm_log::source::Log;
use isotherm_protocol::codec;
use isotherm_protocol::key::{RawStream, UnitId};
use isotherm_protocol::raw::{AccelBatch, GyroBatch, TemperatureBatch};

use crate::error::Error;

/// Ticks of one kind of sensor, as columns of equal length.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Ticks {
    /// Sequence numbers.
    pub sequence: Vec<u64>,
    /// Ends (ns on the producer's clock).
    pub end_ns: Vec<i64>,
    /// Durations (s).
    pub duration_s: Vec<f64>,
    /// Readings by sensor: counts of the tick, or means over it (rad/s; V or m/s²).
    pub readings: Vec<Vec<f64>>,
    /// What the readings stand for; `None` where there are no ticks.
    pub output: Option<OutputKind>,
}

/// Readings of one temperature channel.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Channel {
    /// Times (ns on the producer's clock).
    pub time_ns: Vec<i64>,
    /// Raw readings (V, counts or °C, as the document converts them).
    pub raw: Vec<f64>,
}

/// Everything that a log has of one unit.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    /// The unit.
    pub unit: UnitId,
    /// Gyro ticks.
    pub gyros: Ticks,
    /// Lasing mode by gyro tick: +1, −1, or 0 where the producer states none.
    pub mode: Vec<i8>,
    /// Accelerometer ticks.
    pub accels: Ticks,
    /// Temperature channels by name.
    pub temperatures: BTreeMap<String, Channel>,
    /// Frames that could not be read.
    pub bad_frames: u64,
}

impl Series {
    /// Reads everything of a log that is of one unit; `unit` chooses where it has several.
    ///
    /// # Errors
    /// [`Error::Refused`] where the log has several units and none is chosen, or nothing of the chosen one; [`Error::Log`].
    pub fn read(log: &mut Log, unit: Option<&UnitId>, mut progress: impl FnMut(u64)) -> Result<Self, Error> {
        let mut of_unit: BTreeMap<UnitId, Self> = BTreeMap::new();
        let mut ticks = 0;
        while let Some(message) = log.next_message()? {
            let Topic::Raw(serial, stream) = &message.topic else { continue };
            if unit.is_some_and(|unit| unit != serial) {
                continue;
            }
            let series = of_unit.entry(serial.clone()).or_insert_with(|| Self::empty(serial.clone()));
            series.bad_frames += u64::from(!series.take(*stream, &message.frame)?);
            ticks += 1;
            progress(ticks);
        }
        let mut found = of_unit.into_iter();
        match (found.next(), found.next()) {
            (Some((_, series)), None) => Ok(series),
            (None, _) => {
                let of = unit.map(|unit| format!(" of unit {unit}")).unwrap_or_default();
                Err(Error::Refused(vec![format!("the log has no raw readings{of}")]))
            }
            (Some((first, _)), Some((second, _))) => {
                let others = found.fold(String::new(), |list, (serial, _)| format!("{list}, {serial}"));
                Err(Error::Refused(vec![format!(
                    "the log is of several units ({first}, {second}{others}): choose one with --unit"
                )]))
            }
        }
    }

    /// Nothing of a unit yet.
    #[must_use]
    pub fn empty(unit: UnitId) -> Self {
        Self {
            unit,
            gyros: Ticks::default(),
            mode: Vec::new(),
            accels: Ticks::default(),
            temperatures: BTreeMap::new(),
            bad_frames: 0,
        }
    }

    /// Takes one frame; `false` where it cannot be read.
    fn take(&mut self, stream: RawStream, frame: &[u8]) -> Result<bool, Error> {
        match stream {
            RawStream::Gyro => {
                let Ok(batch) = codec::decode::<GyroBatch>(frame) else { return Ok(false) };
                for tick in batch.to_core() {
                    let (end, duration) = (tick.end_time.as_ns(), tick.duration.as_s());
                    self.gyros.push(batch.output(), tick.sequence, (end, duration), &tick.readings)?;
                    self.mode.push(match tick.mode {
                        Some(LasingMode::Plus) => 1,
                        Some(LasingMode::Minus) => -1,
                        None => 0,
                    });
                }
            }
            RawStream::Accel => {
                let Ok(batch) = codec::decode::<AccelBatch>(frame) else { return Ok(false) };
                for tick in batch.to_core() {
                    let (end, duration) = (tick.end_time.as_ns(), tick.duration.as_s());
                    self.accels.push(batch.output(), tick.sequence, (end, duration), &tick.readings)?;
                }
            }
            RawStream::Temperature => {
                let Ok(batch) = codec::decode::<TemperatureBatch>(frame) else { return Ok(false) };
                for reading in batch.to_core() {
                    let channel = self.temperatures.entry(reading.channel.to_string()).or_default();
                    channel.time_ns.push(reading.time.as_ns());
                    channel.raw.push(reading.raw);
                }
            }
            RawStream::Health => {}
        }
        Ok(true)
    }
}

impl Ticks {
    /// Number of ticks.
    #[must_use]
    pub fn len(&self) -> usize {
        self.end_ns.len()
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.end_ns.is_empty()
    }

    /// Adds a tick, with its end (ns) and duration (s).
    fn push(
        &mut self,
        output: OutputKind,
        sequence: u64,
        (end_ns, duration_s): (i64, f64),
        readings: &[f64],
    ) -> Result<(), Error> {
        if self.output.is_none() {
            self.output = Some(output);
            self.readings.resize_with(readings.len(), Vec::new);
        }
        if self.output != Some(output) || self.readings.len() != readings.len() {
            return Err(Error::Refused(vec![format!(
                "tick {sequence} has {} sensors ({output:?}), the ticks before it have {} ({:?}): a log must be of one \
                 instrument; cut it there with --start and --duration",
                readings.len(),
                self.readings.len(),
                self.output.unwrap_or(output),
            )]));
        }
        self.sequence.push(sequence);
        self.end_ns.push(end_ns);
        self.duration_s.push(duration_s);
        self.readings.iter_mut().zip(readings).for_each(|(column, reading)| column.push(*reading));
        Ok(())
    }
}
