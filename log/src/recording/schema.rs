//! What a recording says of the bytes of its messages.

use isotherm_protocol::key::RawStream;

use crate::message::Topic;

/// Name of the schema of a topic.
pub(super) fn name(topic: &Topic) -> &'static str {
    match topic {
        Topic::Raw(_, RawStream::Gyro) => "isotherm/raw_gyro",
        Topic::Raw(_, RawStream::Accel) => "isotherm/raw_accelerometer",
        Topic::Raw(_, RawStream::Temperature) => "isotherm/raw_temperature",
        Topic::Raw(_, RawStream::Health) => "isotherm/raw_health",
        Topic::Reference(_) => "isotherm/rate_reference",
        Topic::Corrected(_) => "isotherm/corrected",
        Topic::Status(_) => "isotherm/status",
        Topic::Journal(_) => "isotherm/journal",
        Topic::Service(_) => "isotherm/service_status",
        Topic::Other(_) => "isotherm/other",
    }
}

/// What the schema says.
pub(super) fn words(topic: &Topic) -> String {
    format!(
        "{}: one frame per message: kind (u8), version (u8), body (postcard), CRC-32 (little-endian). \
         Fields, units of measure and versions: docs/wire.md of Isotherm.\n",
        name(topic)
    )
}
