//! Readings of temperature channels.

use arrayvec::ArrayVec;
use isotherm_correction::sample::{ChannelName, TemperatureReading};
use isotherm_correction::units::Timestamp;

use crate::codec::{self, Body, CodecError, Kind, MAX_TICKS, Message, Tail, append, append_text};
use crate::version::{self, Versions};

/// Most temperature channels in one batch.
pub const MAX_CHANNELS: usize = 16;
/// Fewest bytes of a tick: its time and number of readings.
const FEWEST_BYTES: usize = 2;

/// Temperature readings of one unit.
#[derive(Debug, Clone, PartialEq)]
pub struct TemperatureBatch {
    /// 1…4096 ticks, each the readings of the same 1…16 channels, in the same order, at one time; NaN where a channel gave
    /// none.
    pub readings: Vec<TemperatureReading>,
}

impl TemperatureBatch {
    /// The readings by time.
    pub fn ticks(&self) -> impl Iterator<Item = &[TemperatureReading]> + Clone {
        ticks(&self.readings)
    }

    fn channels(&self) -> impl Iterator<Item = &ChannelName> {
        self.ticks().take(1).flatten().map(|reading| &reading.channel)
    }
}

/// Readings of one time make a tick, each channel once.
pub(super) fn ticks(readings: &[TemperatureReading]) -> impl Iterator<Item = &[TemperatureReading]> + Clone {
    let mut rest = readings;
    std::iter::from_fn(move || {
        let time = rest.first()?.time;
        let first_time = |(index, reading): &(usize, &TemperatureReading)| {
            let before = rest.iter().take(*index);
            reading.time == time && before.into_iter().all(|other| other.channel != reading.channel)
        };
        let length = rest.iter().take(MAX_CHANNELS).enumerate().take_while(first_time).count();
        let (tick, others) = rest.split_at_checked(length)?;
        rest = others;
        Some(tick)
    })
}

impl Message for TemperatureBatch {
    const KIND: Kind = Kind::RawTemperature;
    const VERSIONS: Versions = version::RAW_TEMPERATURE;

    fn check(&self) -> Result<(), CodecError> {
        let count = self.ticks().count();
        if !(1..=MAX_TICKS).contains(&count) {
            return Err(CodecError::Ticks { count });
        }
        let like_first =
            |tick: &[TemperatureReading]| tick.iter().map(|reading| &reading.channel).eq(self.channels());
        match self.ticks().position(|tick| !like_first(tick)) {
            Some(index) => Err(CodecError::MixedReadings { index }),
            None => Ok(()),
        }
    }

    fn write_body(&self, frame: &mut Vec<u8>) -> Result<(), CodecError> {
        append(frame, |to| to.length(self.channels().count()));
        self.channels().for_each(|channel| append_text(frame, channel));
        append(frame, |to| to.length(self.ticks().count()));
        for tick in self.ticks() {
            append(frame, |to| {
                to.i64(tick.first().map_or(0, |reading| reading.time.as_ns()));
                to.length(tick.len());
                for reading in tick {
                    to.f64s(&[reading.raw]);
                }
            });
        }
        Ok(())
    }

    fn read_body(_: u8, body: &[u8]) -> Result<Self, CodecError> {
        let mut readings = Vec::new();
        read_body(body, &mut readings)?;
        Ok(Self { readings })
    }
}

/// Reads a temperature frame.
///
/// `readings` holds the readings afterwards, tick by tick in the order of the channels, and anything after an error.
///
/// # Errors
/// As [`codec::decode`] of a [`TemperatureBatch`].
pub fn read_temperatures(frame: &[u8], readings: &mut Vec<TemperatureReading>) -> Result<(), CodecError> {
    read_body(codec::body::<TemperatureBatch>(frame)?, readings)
}

fn read_body(bytes: &[u8], readings: &mut Vec<TemperatureReading>) -> Result<(), CodecError> {
    let mut tail = Tail::default();
    let mut body = Body::new(bytes, &mut tail);
    let (count, mixed) = read_all(&mut body, readings).ok_or(CodecError::Malformed)?;
    body.ends()?;
    match mixed {
        _ if count == 0 => Err(CodecError::Ticks { count }),
        Some(index) => Err(CodecError::MixedReadings { index }),
        None => Ok(()),
    }
}

/// Reads all ticks of a body: how many there are, and the first whose readings are not one per channel.
fn read_all(body: &mut Body<'_>, readings: &mut Vec<TemperatureReading>) -> Option<(usize, Option<usize>)> {
    readings.clear();
    // Never more than the body can hold, whatever it says.
    let most = MAX_TICKS.min(body.left() / FEWEST_BYTES);
    let mut channels = ArrayVec::<ChannelName, MAX_CHANNELS>::new();
    for _ in 0..body.length(MAX_CHANNELS)? {
        channels.push(ChannelName::from(body.str()?).ok()?);
    }
    let count = body.length(most)?;
    let mut mixed = None;
    for index in 0..count {
        body.part(|part| {
            let time = Timestamp::from_ns(part.i64()?);
            let got = part.length(MAX_CHANNELS)?;
            if got != channels.len() {
                mixed.get_or_insert(index);
            }
            for place in 0..got {
                let raw = part.f64()?;
                let channel = channels.get(place);
                readings.extend(channel.map(|&channel| TemperatureReading { channel, time, raw }));
            }
            Some(())
        })?;
    }
    Some((count, mixed))
}
