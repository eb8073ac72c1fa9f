//! A message of a log, decoded by its topic.

use isotherm_protocol::codec::{self, CodecError};
use isotherm_protocol::corrected::CorrectedBatch;
use isotherm_protocol::key::{RawStream, UnitId};
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

/// The unit of a message and what it says; `None` for what is of no unit.
///
/// # Errors
/// [`CodecError`] where the frame cannot be read.
pub fn decode(message: &Message) -> Result<Option<(&UnitId, Decoded)>, CodecError> {
    let frame = &message.frame;
    let decoded = match &message.topic {
        Topic::Raw(_, RawStream::Gyro) => Decoded::Gyro(codec::decode(frame)?),
        Topic::Raw(_, RawStream::Accel) => Decoded::Accel(codec::decode(frame)?),
        Topic::Raw(_, RawStream::Temperature) => Decoded::Temperature(Box::new(codec::decode(frame)?)),
        Topic::Raw(_, RawStream::Health) => Decoded::Health(codec::decode(frame)?),
        Topic::Reference(_) => Decoded::Reference(codec::decode(frame)?),
        Topic::Corrected(_) => Decoded::Corrected(Box::new(codec::decode(frame)?)),
        Topic::Status(_) => Decoded::Status(Box::new(codec::decode(frame)?)),
        Topic::Journal(_) => Decoded::Journal,
        Topic::Service(_) | Topic::Other(_) => return Ok(None),
    };
    Ok(message.topic.unit().map(|unit| (unit, decoded)))
}
