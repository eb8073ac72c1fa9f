//! A message of a log, decoded by its topic.

use isotherm_correction::units::Timestamp;
use isotherm_protocol::codec::{self, CodecError};
use isotherm_protocol::corrected::CorrectedBatch;
use isotherm_protocol::key::{Input, RawStream, UnitId};
use isotherm_protocol::raw::{AccelBatch, GyroBatch, HealthBatch, TemperatureBatch};
use isotherm_protocol::reference::Reference;
use isotherm_protocol::status::Status;

use crate::message::{Message, Topic};

/// What a message of a unit says.
#[derive(Debug, Clone, PartialEq)]
pub enum Decoded {
    /// Raw gyro ticks.
    Gyro(GyroBatch),
    /// Raw accelerometer ticks.
    Accel(AccelBatch),
    /// Raw temperature readings.
    Temperature(Box<TemperatureBatch>),
    /// What the instrument reports of itself.
    Health(HealthBatch),
    /// A rate reference.
    Reference(Reference),
    /// Corrected ticks.
    Corrected(Box<CorrectedBatch>),
    /// A unit's status.
    Status(Box<Status>),
    /// Part of a unit's journal; it stays as it is.
    Journal,
}

impl Decoded {
    /// What an input of a unit says.
    ///
    /// # Errors
    /// [`CodecError`] where the frame cannot be read.
    pub fn of_input(input: Input, frame: &[u8]) -> Result<Self, CodecError> {
        Ok(match input {
            Input::Raw(RawStream::Gyro) => Self::Gyro(codec::decode(frame)?),
            Input::Raw(RawStream::Accel) => Self::Accel(codec::decode(frame)?),
            Input::Raw(RawStream::Temperature) => Self::Temperature(Box::new(codec::decode(frame)?)),
            Input::Raw(RawStream::Health) => Self::Health(codec::decode(frame)?),
            Input::Reference => Self::Reference(codec::decode(frame)?),
        })
    }

    /// Times of its first and its last tick or reading; of a reference, of its end.
    #[must_use]
    pub fn times(&self) -> Option<[Timestamp; 2]> {
        fn ends<T>(all: &[T], time: impl Fn(&T) -> Timestamp) -> Option<[Timestamp; 2]> {
            Some([time(all.first()?), time(all.last()?)])
        }
        match self {
            Self::Gyro(batch) => ends(&batch.ticks, |tick| tick.end_time),
            Self::Accel(batch) => ends(&batch.ticks, |tick| tick.end_time),
            Self::Temperature(batch) => ends(&batch.readings, |reading| reading.time),
            Self::Health(batch) => ends(&batch.ticks, |tick| Timestamp::from_ns(tick.time_ns)),
            Self::Reference(reference) => Some([Timestamp::from_ns(reference.end_ns); 2]),
            Self::Corrected(batch) => ends(&batch.ticks, |tick| tick.end_time),
            Self::Status(_) | Self::Journal => None,
        }
    }
}

/// The unit of a message and what it says; `None` for what is of no unit.
///
/// # Errors
/// [`CodecError`] where the frame cannot be read.
pub fn decode(message: &Message) -> Result<Option<(&UnitId, Decoded)>, CodecError> {
    let frame = &message.frame;
    let decoded = match &message.topic {
        Topic::Raw(_, stream) => Decoded::of_input(Input::Raw(*stream), frame)?,
        Topic::Reference(_) => Decoded::of_input(Input::Reference, frame)?,
        Topic::Corrected(_) => Decoded::Corrected(Box::new(codec::decode(frame)?)),
        Topic::Status(_) => Decoded::Status(Box::new(codec::decode(frame)?)),
        Topic::Journal(_) => Decoded::Journal,
        Topic::Service(_) | Topic::Other(_) => return Ok(None),
    };
    Ok(message.topic.unit().map(|unit| (unit, decoded)))
}
