//! One message as it was on the bus.

use isotherm_correction::units::Timestamp;
use isotherm_protocol::key::{self, RawStream, UnitId};

use crate::streams::decoded::decode;

/// What a message is about.
#[derive(Debug, Clone, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Topic {
    /// Raw readings of a unit.
    Raw(UnitId, RawStream),
    /// A rate reference for a unit.
    Reference(UnitId),
    /// Corrected increments of a unit.
    Corrected(UnitId),
    /// Status of a unit.
    Status(UnitId),
    /// What acted on a unit beside its messages.
    Journal(UnitId),
    /// Status of a service instance, by its name.
    Service(String),
    /// Something else, by its key.
    Other(String),
}

impl Topic {
    /// The topic of a key, without namespace.
    #[must_use]
    pub fn of(key: &str) -> Self {
        type Parse = fn(&str) -> Option<&str>;
        type Make = fn(UnitId) -> Topic;
        let unit = |serial: &str| UnitId::new(serial).ok();
        if let Some((serial, stream)) = key::parse_raw(key)
            && let Some(unit) = unit(serial)
        {
            return Self::Raw(unit, stream);
        }
        let kinds: [(Parse, Make); 4] = [
            (key::parse_reference, Self::Reference),
            (key::parse_corrected, Self::Corrected),
            (key::parse_status, Self::Status),
            (key::parse_journal, Self::Journal),
        ];
        let found = kinds.iter().find_map(|(parse, make)| parse(key).and_then(unit).map(make));
        let service = || key::parse_service_status(key).map(|instance| Self::Service(instance.to_owned()));
        found.or_else(service).unwrap_or_else(|| Self::Other(key.to_owned()))
    }

    /// Its key, without namespace.
    #[must_use]
    pub fn key(&self) -> String {
        match self {
            Self::Raw(unit, stream) => key::raw(unit, *stream),
            Self::Reference(unit) => key::reference(unit),
            Self::Corrected(unit) => key::corrected(unit),
            Self::Status(unit) => key::status(unit),
            Self::Journal(unit) => key::journal(unit),
            Self::Service(instance) => key::service_status(instance),
            Self::Other(key) => key.clone(),
        }
    }

    /// The unit that it is about.
    #[must_use]
    pub fn unit(&self) -> Option<&UnitId> {
        match self {
            Self::Raw(unit, _)
            | Self::Reference(unit)
            | Self::Corrected(unit)
            | Self::Status(unit)
            | Self::Journal(unit) => Some(unit),
            Self::Service(_) | Self::Other(_) => None,
        }
    }
}

/// One message of a log.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Message {
    /// What it is about.
    pub topic: Topic,
    /// When it was received (ns since 1970-01-01 UTC); for text logs its time on the producer's clock, 0 before that clock's zero.
    pub received_ns: u64,
    /// The frame, as it was on the bus.
    pub frame: Vec<u8>,
}

impl Message {
    /// When it happened on the producer's clock: the end of its last tick, or the time of its last reading; `None` where a
    /// message has no such time or cannot be read.
    #[must_use]
    pub fn time(&self) -> Option<Timestamp> {
        Some(decode(self).ok()??.1.times()?[1])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_key_and_its_topic_name_each_other() {
        for key in [
            "imu/A-1/raw/gyro",
            "imu/A-1/raw/accel",
            "imu/A-1/raw/temp",
            "imu/A-1/raw/health",
            "imu/A-1/reference",
            "imu/A-1/corrected",
            "imu/A-1/status",
            "imu/A-1/journal",
            "isotherm/7f/status",
            "something/else",
            "imu/not a serial/corrected",
        ] {
            let topic = Topic::of(key);
            assert_eq!(topic.key(), key);
            assert_eq!(
                matches!(topic, Topic::Other(_)),
                key.contains("else") || key.contains("not"),
                "{key}"
            );
        }
    }
}
