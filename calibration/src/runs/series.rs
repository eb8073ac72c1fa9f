//! A log as columns: what a unit measured, tick by tick.

use std::collections::BTreeMap;

use isotherm_correction::sample::OutputKind;
use isotherm_correction::units::{Span, Timestamp};
use isotherm_log::text::LogEvent;
use isotherm_protocol::key::UnitId;

use super::{Fed, readings};

use crate::error::Error;
use crate::numbers::seconds;

/// Ticks of one kind of sensor, as columns of equal length.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Ticks {
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

impl Channel {
    /// Times since the first reading (s).
    pub fn since_s(&self) -> Vec<f64> {
        let first = self.time_ns.first().copied().unwrap_or_default();
        let since_s = |time: &i64| seconds(time.saturating_sub(first));
        self.time_ns.iter().map(since_s).collect()
    }
}

/// Everything that a log has of one unit.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    /// The unit.
    pub unit: UnitId,
    /// Where in the log the part begins that was read (s).
    pub start_s: f64,
    /// Gyro ticks.
    pub gyros: Ticks,
    /// Accelerometer ticks.
    pub accels: Ticks,
    /// Temperature channels by name.
    pub temperatures: BTreeMap<String, Channel>,
    /// Frames that could not be read.
    pub bad_frames: u64,
}

impl Series {
    /// Nothing of a unit yet, in the part of a log that begins there (s).
    pub fn empty(unit: UnitId, start_s: f64) -> Self {
        Self {
            unit,
            start_s,
            gyros: Ticks::default(),
            accels: Ticks::default(),
            temperatures: BTreeMap::new(),
            bad_frames: 0,
        }
    }

    /// Takes an event, or the readings of a frame; a frame that cannot be read is counted.
    ///
    /// # Errors
    /// [`Error::Refused`] where ticks are of another instrument than those before.
    pub(super) fn take(&mut self, fed: &Fed<'_>) -> Result<(), Error> {
        let event = match fed {
            Fed::Event(event) => event,
            Fed::Frame(stream, frame) => {
                let events = readings(*stream, frame);
                self.bad_frames += u64::from(events.is_none());
                return events.iter().flatten().try_for_each(|event| self.take(&Fed::Event(event)));
            }
        };
        match event {
            LogEvent::Gyro { output, tick } => {
                self.gyros.push(*output, tick.sequence, (tick.end_time, tick.duration), &tick.readings)?;
            }
            LogEvent::Accel { output, tick } => {
                self.accels.push(*output, tick.sequence, (tick.end_time, tick.duration), &tick.readings)?;
            }
            LogEvent::Temperature(reading) => {
                let channel = self.temperatures.entry(reading.channel.to_string()).or_default();
                channel.time_ns.push(reading.time.as_ns());
                channel.raw.push(reading.raw);
            }
        }
        Ok(())
    }
}

impl Ticks {
    /// Whether more than half of the shorter of two logs is in the other, too: ticks of the same end with the same readings.
    pub fn overlap(&self, other: &Self) -> bool {
        let equal = |(tick, end): &(usize, &i64)| {
            let Ok(twin) = other.end_ns.binary_search(end) else { return false };
            self.readings.iter().zip(&other.readings).all(|(a, b)| a[*tick].total_cmp(&b[twin]).is_eq())
        };
        let alike = self.readings.len() == other.readings.len();
        alike && 2 * self.end_ns.iter().enumerate().filter(equal).count() > self.len().min(other.len())
    }

    /// Number of ticks.
    pub fn len(&self) -> usize {
        self.end_ns.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.end_ns.is_empty()
    }

    /// From the first tick's end to the last one's (s).
    pub fn length_s(&self) -> f64 {
        let ends = self.end_ns.first().zip(self.end_ns.last());
        ends.map_or(0.0, |(first, last)| seconds(last.saturating_sub(*first)))
    }

    /// Adds a tick, with its end and duration.
    fn push(
        &mut self,
        output: OutputKind,
        sequence: u64,
        (end, duration): (Timestamp, Span),
        readings: &[f64],
    ) -> Result<(), Error> {
        if self.output.is_none() {
            self.output = Some(output);
            self.readings.resize_with(readings.len(), Vec::new);
        }
        if self.output != Some(output) || self.readings.len() != readings.len() {
            return Err(Error::refused(format!(
                "tick {sequence} has {} sensors ({output:?}), the ticks before it have {} ({:?}): a log must be of one \
                 instrument; cut it there with --start and --duration",
                readings.len(),
                self.readings.len(),
                self.output.unwrap_or(output),
            )));
        }
        self.end_ns.push(end.as_ns());
        self.duration_s.push(duration.as_s());
        self.readings.iter_mut().zip(readings).for_each(|(column, reading)| column.push(*reading));
        Ok(())
    }
}
