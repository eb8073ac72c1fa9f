//! Frames of raw readings straight into the core's ticks, into room that is used again.
//!
//! This is what becomes of every message in the service: nothing is allocated, and no tick is written twice. The bytes are
//! those of [`GyroBatch`], [`AccelBatch`] and [`TemperatureBatch`], which say what they mean; a test holds both readings of them together.

mod body;

use arrayvec::ArrayVec;
use isotherm_correction::sample::{
    AccelTick, ChannelName, GyroTick, HalfPeriodCounts, MAX_SENSORS, OutputKind, Sensors, TemperatureReading,
};
use isotherm_correction::units::Timestamp;

use super::{AccelBatch, GyroBatch, MAX_CHANNELS, TemperatureBatch, span};
use crate::codec::{self, CodecError, MAX_TICKS};

use body::Body;

/// Fewest bytes of a tick: its times, kind and number of readings.
const FEWEST_BYTES: usize = 4;
/// Fewest bytes of a temperature tick: its time and number of readings.
const FEWEST_BYTES_OF_TEMPERATURES: usize = 2;

/// Reads a gyro frame; what its readings stand for.
///
/// `ticks` holds the ticks afterwards, and anything after an error.
///
/// # Errors
/// As [`codec::decode`] of a [`GyroBatch`].
pub fn read_gyro(frame: &[u8], ticks: &mut Vec<GyroTick>) -> Result<OutputKind, CodecError> {
    let bytes = codec::body::<GyroBatch>(frame)?;
    let mut alike = Alike::default();
    let mut half_periods = None;
    let rest = read_body(bytes, |body| {
        let first_sequence = body.u64()?;
        let series = body.u64()?;
        make_room(body, bytes.len(), ticks)?;
        for (index, tick) in ticks.iter_mut().enumerate() {
            tick.sequence = first_sequence.saturating_add(index as u64);
            tick.series = series;
            tick.end_time = Timestamp::from_ns(body.i64()?);
            tick.duration = span(body.u64()?);
            alike.note(index, readings(body, &mut tick.readings)?, tick.readings.len());
            body.mode(&mut tick.mode)?;
            tick.switch_command = body.bool()?;
            body.mode(&mut tick.meander)?;
            let got = length(body, MAX_SENSORS)?;
            tick.half_periods.clear();
            for _ in 0..got {
                let positive = body.i32()?;
                let negative = body.i32()?;
                tick.half_periods.push(HalfPeriodCounts { positive, negative });
            }
            let need = tick.readings.len();
            if got != 0 && got != need {
                half_periods.get_or_insert(CodecError::HalfPeriods { index, got, need });
            }
        }
        Some(())
    })?;
    let output = alike.judge(ticks.len(), rest)?;
    half_periods.map_or(Ok(output), Err)
}

/// Reads an accelerometer frame; what its readings stand for.
///
/// `ticks` holds the ticks afterwards, and anything after an error.
///
/// # Errors
/// As [`codec::decode`] of an [`AccelBatch`].
pub fn read_accel(frame: &[u8], ticks: &mut Vec<AccelTick>) -> Result<OutputKind, CodecError> {
    let bytes = codec::body::<AccelBatch>(frame)?;
    let mut alike = Alike::default();
    let rest = read_body(bytes, |body| {
        let first_sequence = body.u64()?;
        make_room(body, bytes.len(), ticks)?;
        for (index, tick) in ticks.iter_mut().enumerate() {
            tick.sequence = first_sequence.saturating_add(index as u64);
            tick.end_time = Timestamp::from_ns(body.i64()?);
            tick.duration = span(body.u64()?);
            alike.note(index, readings(body, &mut tick.readings)?, tick.readings.len());
        }
        Some(())
    })?;
    alike.judge(ticks.len(), rest)
}

/// Reads a temperature frame.
///
/// `readings` holds the readings afterwards, tick by tick in the order of the channels, and anything after an error.
///
/// # Errors
/// As [`codec::decode`] of a [`TemperatureBatch`].
pub fn read_temperatures(frame: &[u8], readings: &mut Vec<TemperatureReading>) -> Result<(), CodecError> {
    let bytes = codec::body::<TemperatureBatch>(frame)?;
    let mut count = 0;
    let mut mixed = None;
    readings.clear();
    let rest = read_body(bytes, |body| {
        let mut channels = ArrayVec::<ChannelName, MAX_CHANNELS>::new();
        for _ in 0..length(body, MAX_CHANNELS)? {
            channels.push(ChannelName::from(body.str()?).ok()?);
        }
        count = length(body, MAX_TICKS.min(bytes.len() / FEWEST_BYTES_OF_TEMPERATURES))?;
        for index in 0..count {
            let time = Timestamp::from_ns(body.i64()?);
            let got = length(body, MAX_CHANNELS)?;
            if got != channels.len() {
                mixed.get_or_insert(index);
            }
            for reading in 0..got {
                let raw = body.f64()?;
                let channel = channels.get(reading);
                readings.extend(channel.map(|channel| TemperatureReading { channel: *channel, time, raw }));
            }
        }
        Some(())
    })?;
    if rest > 0 {
        return Err(CodecError::Trailing { count: rest });
    }
    match mixed {
        _ if count == 0 => Err(CodecError::Ticks { count }),
        Some(index) => Err(CodecError::MixedReadings { index }),
        None => Ok(()),
    }
}

/// Reads a body with `read`; how many bytes are left over behind it.
fn read_body<'a>(
    bytes: &'a [u8],
    read: impl FnOnce(&mut Body<'a>) -> Option<()>,
) -> Result<usize, CodecError> {
    let mut body = Body::new(bytes);
    read(&mut body).ok_or(CodecError::Malformed)?;
    Ok(body.left())
}

/// A stated number of elements, at most `most`.
#[inline]
fn length(body: &mut Body<'_>, most: usize) -> Option<usize> {
    usize::try_from(body.u64()?).ok().filter(|length| *length <= most)
}

/// Makes `ticks` as many as a body of so many bytes states; never more than it can hold.
fn make_room<T: Clone + Default>(body: &mut Body<'_>, bytes: usize, ticks: &mut Vec<T>) -> Option<()> {
    let count = length(body, MAX_TICKS.min(bytes / FEWEST_BYTES))?;
    ticks.resize(count, T::default());
    Some(())
}

/// Reads the readings of a tick; what they stand for.
#[inline]
fn readings(body: &mut Body<'_>, values: &mut Sensors<f64>) -> Option<OutputKind> {
    let kind = match body.u32()? {
        0 => OutputKind::Counts,
        1 => OutputKind::Mean,
        _ => return None,
    };
    let count = length(body, MAX_SENSORS)?;
    values.clear();
    for _ in 0..count {
        values.push(match kind {
            OutputKind::Counts => f64::from(body.i32()?),
            OutputKind::Mean => body.f64()?,
        });
    }
    Some(kind)
}

/// Whether all ticks of a batch have readings of one kind and number.
#[derive(Debug, Default)]
struct Alike {
    first: Option<(OutputKind, usize)>,
    /// The first tick that differs.
    mixed: Option<usize>,
}

impl Alike {
    fn note(&mut self, index: usize, kind: OutputKind, sensors: usize) {
        if *self.first.get_or_insert((kind, sensors)) != (kind, sensors) {
            self.mixed.get_or_insert(index);
        }
    }

    /// What is wrong with a batch of `count` ticks with so many bytes left over, in the order of [`codec::decode`].
    fn judge(&self, count: usize, left_over: usize) -> Result<OutputKind, CodecError> {
        if left_over > 0 {
            return Err(CodecError::Trailing { count: left_over });
        }
        let Some((kind, _)) = self.first else { return Err(CodecError::Ticks { count }) };
        match self.mixed {
            Some(index) => Err(CodecError::MixedReadings { index }),
            None => Ok(kind),
        }
    }
}

#[cfg(test)]
mod tests;
