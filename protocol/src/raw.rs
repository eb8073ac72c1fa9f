//! Raw batches: what a producer publishes for one unit.
//!
//! They hold the core's own ticks. `docs/wire.md` describes their form; one place writes it and one reads it, the latter into
//! room that is used again: that is what becomes of every message in the service.

mod batcher;
mod health;
mod temperature;

use isotherm_correction::sample::{
    AccelTick, GyroTick, HalfPeriodCounts, MAX_SENSORS, OutputKind, Readings, Sensors,
};
use isotherm_correction::units::{Span, Timestamp};

pub use batcher::{BatchError, Batcher, RawFrame};
pub use health::{HealthBatch, HealthReading, HealthTick, MAX_HEALTH};
pub use temperature::{MAX_CHANNELS, TemperatureBatch, read_temperatures};

use crate::codec::{
    self, Body, CodecError, Kind, MAX_NUMBER, MAX_TICKS, Message, Stretch, Tail, Writer, append,
};
use crate::version::{self, Versions};

/// Consecutive ticks of one unit; gyro ticks are of one series.
#[derive(Debug, Clone, PartialEq)]
pub struct RawBatch<T> {
    /// What the readings stand for.
    pub output: OutputKind,
    /// 1…4096 ticks with as many readings each. What is written of their sequence numbers and their series is the first's.
    pub ticks: Vec<T>,
}

/// Raw gyro ticks.
pub type GyroBatch = RawBatch<GyroTick>;
/// Raw accelerometer ticks.
pub type AccelBatch = RawBatch<AccelTick>;

/// Most bytes of a tick: its times, lengths and modes, a reading of each sensor and two half-period counts.
const MOST_BYTES: usize = 8 * MAX_NUMBER + MAX_SENSORS * (size_of::<f64>() + 2 * 5);
// It is written in one part.
const _: () = assert!(MOST_BYTES <= 255);
/// Fewest bytes of a tick: its times, kind and number of readings.
const FEWEST_BYTES: usize = 4;

/// A tick that a raw batch can hold: a gyro or an accelerometer tick.
pub trait RawTick: Default {
    /// Kind of the batch.
    const KIND: Kind;
    /// Versions of the batch.
    const VERSIONS: Versions;
    /// Whether the batch says the number of the producer's run.
    const HAS_SERIES: bool;

    /// What both have.
    fn parts(&self) -> Parts<'_>;
    /// Sets number, run and times; gives the readings, to be set next.
    fn begin(&mut self, sequence: u64, series: u64, times: (Timestamp, Span)) -> &mut Readings;
    /// Writes what stands behind the readings.
    fn write_rest(&self, _: &mut Writer<'_>) {}
    /// Reads what stands behind the readings; how many sensors have half-period counts.
    fn read_rest(&mut self, _: &mut Stretch<'_>) -> Option<usize> {
        Some(0)
    }
}

/// What gyro and accelerometer ticks both have.
#[derive(Debug, Clone, Copy)]
pub struct Parts<'a> {
    /// Producer's number of the tick.
    pub sequence: u64,
    /// Number of the producer's run; 0 where the batch does not say it.
    pub series: u64,
    /// End on the producer's clock, and measured duration.
    pub times: (Timestamp, Span),
    /// One reading per sensor.
    pub readings: &'a Readings,
    /// How many sensors have half-period counts.
    pub half_periods: usize,
}

impl RawTick for GyroTick {
    const KIND: Kind = Kind::RawGyro;
    const VERSIONS: Versions = version::RAW_GYRO;
    const HAS_SERIES: bool = true;

    #[inline]
    fn parts(&self) -> Parts<'_> {
        let Self { sequence, series, ref readings, .. } = *self;
        let times = (self.end_time, self.duration);
        Parts { sequence, series, times, readings, half_periods: self.half_periods.len() }
    }

    #[inline]
    fn begin(&mut self, sequence: u64, series: u64, times: (Timestamp, Span)) -> &mut Readings {
        (self.sequence, self.series) = (sequence, series);
        (self.end_time, self.duration) = times;
        &mut self.readings
    }

    fn write_rest(&self, to: &mut Writer<'_>) {
        to.mode(self.mode);
        to.byte(self.switch_command.into());
        to.mode(self.meander);
        to.length(self.half_periods.len());
        for half in &self.half_periods {
            to.i32(half.positive);
            to.i32(half.negative);
        }
    }

    #[inline]
    fn read_rest(&mut self, part: &mut Stretch<'_>) -> Option<usize> {
        self.mode = part.mode()?;
        self.switch_command = part.bool()?;
        self.meander = part.mode()?;
        resize(&mut self.half_periods, part.length(MAX_SENSORS)?);
        for half in &mut self.half_periods {
            let [positive, negative] = part.two_i32()?;
            *half = HalfPeriodCounts { positive, negative };
        }
        Some(self.half_periods.len())
    }
}

impl RawTick for AccelTick {
    const KIND: Kind = Kind::RawAccel;
    const VERSIONS: Versions = version::RAW_ACCEL;
    const HAS_SERIES: bool = false;

    #[inline]
    fn parts(&self) -> Parts<'_> {
        let Self { sequence, ref readings, .. } = *self;
        Parts { sequence, series: 0, times: (self.end_time, self.duration), readings, half_periods: 0 }
    }

    #[inline]
    fn begin(&mut self, sequence: u64, _: u64, times: (Timestamp, Span)) -> &mut Readings {
        self.sequence = sequence;
        (self.end_time, self.duration) = times;
        &mut self.readings
    }
}

impl<T: RawTick> Message for RawBatch<T> {
    const KIND: Kind = T::KIND;
    const VERSIONS: Versions = T::VERSIONS;

    fn check(&self) -> Result<(), CodecError> {
        let mut alike = Alike::default();
        for (index, tick) in self.ticks.iter().enumerate() {
            let Parts { readings, half_periods, .. } = tick.parts();
            alike.note(index, (self.output, readings.len()), half_periods);
        }
        alike.judge(self.ticks.len()).map(drop)
    }

    fn write_body(&self, frame: &mut Vec<u8>) -> Result<(), CodecError> {
        let first = self.ticks.first().map(RawTick::parts);
        append(frame, |to| {
            to.u64(first.map_or(0, |first| first.sequence));
            if T::HAS_SERIES {
                to.u64(first.map_or(0, |first| first.series));
            }
            to.length(self.ticks.len());
        });
        for (index, tick) in self.ticks.iter().enumerate() {
            let mut fits = true;
            append(frame, |to| {
                let Parts { times: (end_time, duration), readings, .. } = tick.parts();
                to.i64(end_time.as_ns());
                to.u64(duration.as_ns().unsigned_abs());
                to.byte(u8::from(self.output == OutputKind::Mean));
                to.length(readings.len());
                match self.output {
                    OutputKind::Mean => to.f64s(readings),
                    OutputKind::Counts => readings.iter().for_each(|&reading| match whole(reading) {
                        Some(count) => to.i32(count),
                        None => fits = false,
                    }),
                }
                tick.write_rest(to);
            });
            if !fits {
                return Err(CodecError::NotCounts { index });
            }
        }
        Ok(())
    }

    fn read_body(_: u8, body: &[u8]) -> Result<Self, CodecError> {
        let mut reader = TickReader::default();
        Ok(Self { output: reader.read_body(body)?, ticks: reader.ticks })
    }
}

/// A whole number that fits 32 bits.
fn whole(value: f64) -> Option<i32> {
    #[expect(clippy::cast_possible_truncation, reason = "compared with the original right after")]
    let count = value as i32;
    #[expect(clippy::float_cmp, reason = "exactness is the question")]
    let exact = f64::from(count) == value;
    exact.then_some(count)
}

/// Reads frames of gyro or accelerometer ticks one after the other, into room that is used again.
#[derive(Debug)]
pub struct TickReader<T> {
    ticks: Vec<T>,
    tail: Tail,
}

impl<T> Default for TickReader<T> {
    fn default() -> Self {
        Self { ticks: Vec::new(), tail: Tail::default() }
    }
}

impl<T: RawTick> TickReader<T> {
    /// Ticks of a frame, and what their readings stand for.
    ///
    /// # Errors
    /// As [`codec::decode`] of a [`RawBatch`].
    pub fn read(&mut self, frame: &[u8]) -> Result<(OutputKind, &[T]), CodecError> {
        let output = self.read_body(codec::body::<RawBatch<T>>(frame)?)?;
        Ok((output, &self.ticks))
    }

    fn read_body(&mut self, bytes: &[u8]) -> Result<OutputKind, CodecError> {
        let mut body = Body::new(bytes, &mut self.tail);
        let mut alike = Alike::default();
        read_all(&mut body, &mut self.ticks, &mut alike)?;
        body.ends()?;
        alike.judge(self.ticks.len())
    }
}

/// Reads all ticks of a body.
fn read_all<T: RawTick>(
    body: &mut Body<'_>,
    ticks: &mut Vec<T>,
    alike: &mut Alike,
) -> Result<(), CodecError> {
    let head = body.part(|part| {
        let first = part.u64()?;
        let series = if T::HAS_SERIES { part.u64()? } else { 0 };
        Some((first, series, part.length(usize::MAX)?))
    });
    let (first, series, count) = head.ok_or(CodecError::Malformed)?;
    body.can_hold(count, FEWEST_BYTES)?;
    ticks.resize_with(count, T::default);
    for (index, tick) in ticks.iter_mut().enumerate() {
        let read = body.part(|part| {
            let end_time = Timestamp::from_ns(part.i64()?);
            // What is longer than the longest span becomes that, which the core then refuses.
            let duration = Span::from_ns(i64::try_from(part.u64()?).unwrap_or(i64::MAX));
            let readings = tick.begin(first.saturating_add(index as u64), series, (end_time, duration));
            let output = read_readings(part, readings)?;
            let sensors = readings.len();
            let halves = tick.read_rest(part)?;
            alike.note(index, (output, sensors), halves);
            Some(())
        });
        if read.is_none() {
            return Err(why_not_read(body));
        }
    }
    Ok(())
}

/// What is wrong with the tick at which the reading of a body has stopped.
#[cold]
fn why_not_read(body: &mut Body<'_>) -> CodecError {
    let sensors = body.part(|part| {
        let _before = (part.i64()?, part.u64()?, part.variant()?);
        part.length(usize::MAX)
    });
    if sensors.is_some_and(|sensors| sensors > MAX_SENSORS) {
        CodecError::Value { field: "readings", must_be: "0 to 8 per tick" }
    } else {
        CodecError::Malformed
    }
}

/// Reads the readings of a tick; what they stand for.
#[inline(always)]
#[expect(clippy::inline_always, reason = "else how far a tick has been read leaves its register")]
fn read_readings(part: &mut Stretch<'_>, readings: &mut Readings) -> Option<OutputKind> {
    let kind = part.variant()?;
    readings.resize(part.length(MAX_SENSORS)?);
    match kind {
        0 => {
            for reading in readings.iter_mut() {
                *reading = f64::from(part.i32()?);
            }
            Some(OutputKind::Counts)
        }
        1 => {
            for reading in readings.iter_mut() {
                *reading = part.f64()?;
            }
            Some(OutputKind::Mean)
        }
        _ => None,
    }
}

/// Makes room for a number of values, which are written next: mostly as many as there were.
#[inline]
fn resize<V: Default>(values: &mut Sensors<V>, count: usize) {
    if values.len() != count {
        *values = (0..count).map(|_| V::default()).collect();
    }
}

/// Whether all ticks of a batch have readings of one kind and number, and half-period counts of all gyros or of none.
#[derive(Debug, Default)]
struct Alike {
    first: Option<(OutputKind, usize)>,
    /// The first tick with other readings.
    mixed: Option<usize>,
    /// The first tick with half-period counts of some gyros, and how many there are of both.
    some_halves: Option<[usize; 3]>,
}

impl Alike {
    /// A tick with `readings`, and half-period counts of `got` gyros.
    #[inline]
    fn note(&mut self, index: usize, readings: (OutputKind, usize), got: usize) {
        if *self.first.get_or_insert(readings) != readings {
            self.mixed.get_or_insert(index);
        }
        let (_, need) = readings;
        if got != 0 && got != need {
            self.some_halves.get_or_insert([index, got, need]);
        }
    }

    /// What is wrong with a batch of `count` ticks; otherwise what its readings stand for.
    fn judge(&self, count: usize) -> Result<OutputKind, CodecError> {
        match (self.first, self.mixed, self.some_halves) {
            (Some((output, _)), None, None) if count <= MAX_TICKS => Ok(output),
            (Some(_), Some(index), _) if count <= MAX_TICKS => Err(CodecError::MixedReadings { index }),
            (Some(_), None, Some([index, got, need])) if count <= MAX_TICKS => {
                Err(CodecError::HalfPeriods { index, got, need })
            }
            _ => Err(CodecError::Ticks { count }),
        }
    }
}

#[cfg(test)]
mod tests;
