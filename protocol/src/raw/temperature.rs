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
    readings.clear();
    let (channels, count) = read_head(&mut body).ok_or(CodecError::Malformed)?;
    body.can_hold(count, FEWEST_BYTES)?;
    let others = read_ticks(&mut body, (&channels, count), readings).ok_or(CodecError::Malformed)?;
    body.ends()?;
    match others {
        _ if count == 0 => Err(CodecError::Ticks { count }),
        Some((index, got)) => Err(CodecError::ChannelReadings { index, got, need: channels.len() }),
        None => Ok(()),
    }
}

/// Channels of a batch.
type Channels = ArrayVec<ChannelName, MAX_CHANNELS>;

/// Reads the channels and how many ticks there are to be.
fn read_head(body: &mut Body<'_>) -> Option<(Channels, usize)> {
    let mut channels = Channels::new();
    for _ in 0..body.length(MAX_CHANNELS)? {
        channels.push(ChannelName::from(body.str()?).ok()?);
    }
    Some((channels, body.length(usize::MAX)?))
}

/// Reads all ticks; the first whose readings are not one per channel, and how many it has.
#[expect(clippy::option_option, reason = "no such tick is one thing, a body that does not decode another")]
fn read_ticks(
    body: &mut Body<'_>,
    (channels, count): (&Channels, usize),
    readings: &mut Vec<TemperatureReading>,
) -> Option<Option<(usize, usize)>> {
    let mut others = None;
    for index in 0..count {
        body.part(|part| {
            let time = Timestamp::from_ns(part.i64()?);
            let got = part.length(MAX_CHANNELS)?;
            if got != channels.len() {
                others.get_or_insert((index, got));
            }
            for place in 0..got {
                let raw = part.f64()?;
                let channel = channels.get(place);
                readings.extend(channel.map(|&channel| TemperatureReading { channel, time, raw }));
            }
            Some(())
        })?;
    }
    Some(others)
}
