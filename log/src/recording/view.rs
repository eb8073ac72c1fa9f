//! Readings and corrected ticks once more as JSON with a JSON Schema, for viewers that know nothing of this project: Foxglove,
//! `PlotJuggler`.
//!
//! They have channels of their own, named as the topic with `/json` behind it; each tick is one message. Nothing reads them back here.
//! Times and vectors are Foxglove's own, by their names: its times begin with 1970, and an earlier tick is not shown.

use std::collections::BTreeMap;

use isotherm_correction::sample::{CorrectedTick, LasingMode, TickFlags};
use isotherm_correction::sigma::{Causes, Sigma};
use isotherm_correction::units::{AngularRate, Timestamp};
use isotherm_protocol::key::RawStream;
use serde::Serialize;
use serde_json::{Value, json};

use crate::message::{Message, Topic};
use crate::ros2::means;
use crate::streams::decoded::{Decoded, decode};

/// Encoding of the messages.
pub(super) const ENCODING: &str = "json";
/// Encoding of their schemas.
pub(super) const SCHEMA_ENCODING: &str = "jsonschema";
/// What stands behind the name of the topic.
const SUFFIX: &str = "/json";

/// One message.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Point {
    /// When it happened on the recorder's clock: the time of reception, less what lay between this tick and the message's last.
    pub(super) log_ns: u64,
    /// When it happened on the producer's clock.
    pub(super) time_ns: u64,
    /// The message.
    pub(super) json: Vec<u8>,
}

/// The topic beside whose channel one of this key stands; `None` where it is another one.
pub(super) fn topic(key: &str) -> Option<Topic> {
    let topic = Topic::of(key.strip_suffix(SUFFIX)?);
    schema(&topic).is_some().then_some(topic)
}

/// Name of the channel beside that of a topic.
pub(super) fn key(topic: &Topic) -> String {
    topic.key() + SUFFIX
}

/// Name and text of the schema; `None` for topics that are not shown.
pub(super) fn schema(topic: &Topic) -> Option<(&'static str, String)> {
    let (name, words, more) = match topic {
        Topic::Corrected(_) => ("isotherm.CorrectedTick", "A corrected tick, in case axes", corrected()),
        Topic::Raw(_, RawStream::Gyro) => ("isotherm.RawGyroTick", "A raw tick of the gyros", raw("rad/s")),
        Topic::Raw(_, RawStream::Accel) => {
            ("isotherm.RawAccelerometerTick", "A raw tick of the accelerometers", raw("m/s² or V"))
        }
        Topic::Raw(_, RawStream::Temperature) => (
            "isotherm.RawTemperature",
            "A raw reading of a temperature",
            json!({ "raw": {
                "type": "object",
                "description": "By channel: V, counts or °C, whatever the document's conversion takes",
                // Its channels are not known, but Foxglove refuses an object without the key.
                "properties": {},
                "additionalProperties": { "type": "number" },
            } }),
        ),
        _ => return None,
    };
    let mut properties = json!({ "timestamp": {
        "type": "object",
        "title": "time",
        "description": "End of the tick on the producer's clock",
        "properties": {
            "sec": { "type": "integer", "minimum": 0 },
            "nsec": { "type": "integer", "minimum": 0, "maximum": 999_999_999 },
        },
    } });
    if let (Value::Object(all), Value::Object(more)) = (&mut properties, more) {
        all.extend(more);
    }
    let schema = json!({
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": name,
        "description": words,
        "type": "object",
        "properties": properties,
        "required": ["timestamp"],
    });
    Some((name, schema.to_string()))
}

/// Fields of a corrected tick.
fn corrected() -> Value {
    let axes = |words: &str| {
        let axis = json!({ "type": "number" });
        json!({
            "type": "object", "title": "foxglove.Vector3", "description": words,
            "properties": { "x": axis, "y": axis, "z": axis }, "required": ["x", "y", "z"],
        })
    };
    json!({
        "sequence": integer("Sequence number of the raw gyro tick"),
        "missed": integer("Raw gyro ticks missing before this one"),
        "angular_rate_deg_per_h": axes("Mean angular rate over the tick (°/h); absent where it is not known"),
        "specific_force_m_per_s2": axes("Mean specific force over the tick (m/s²); absent where it is not known"),
        "angular_rate_sigma_deg_per_h": axes("Standard error of the former; absent where it is not asked for or not known"),
        "specific_force_sigma_m_per_s2": axes("Likewise"),
        "mode": integer("Lasing mode: 1, -1; 0: none"),
        "flags": integer("Flags of the tick, as in docs/wire.md"),
        "revision": integer("Revision of the calibration; 0: uncalibrated"),
    })
}

/// Fields of a raw tick whose sensors give counts or a mean output.
fn raw(unit: &str) -> Value {
    json!({
        "sequence": integer("Producer's number of the tick"),
        "readings": {
            "type": "array",
            "description": format!("One for each sensor: counts, or its mean output ({unit}); absent where one is no number"),
            "items": { "type": "number" },
        },
    })
}

fn integer(words: &str) -> Value {
    json!({ "type": "integer", "description": words })
}

#[derive(Serialize)]
struct Shown<T> {
    timestamp: Stamp,
    #[serde(flatten)]
    more: T,
}

#[derive(Serialize)]
struct Stamp {
    sec: u64,
    nsec: u64,
}

#[derive(Serialize)]
struct Corrected {
    sequence: u64,
    missed: u64,
    #[serde(skip_serializing_if = "Option::is_none")]
    angular_rate_deg_per_h: Option<Axes>,
    #[serde(skip_serializing_if = "Option::is_none")]
    specific_force_m_per_s2: Option<Axes>,
    #[serde(skip_serializing_if = "Option::is_none")]
    angular_rate_sigma_deg_per_h: Option<Axes>,
    #[serde(skip_serializing_if = "Option::is_none")]
    specific_force_sigma_m_per_s2: Option<Axes>,
    mode: i8,
    flags: u16,
    revision: u64,
}

#[derive(Serialize)]
struct Axes {
    x: f64,
    y: f64,
    z: f64,
}

impl Axes {
    /// `None` where one is no number: JSON has none for it.
    fn of([x, y, z]: [f64; 3]) -> Option<Self> {
        (x.is_finite() && y.is_finite() && z.is_finite()).then_some(Self { x, y, z })
    }
}

#[derive(Serialize)]
struct Raw<'a> {
    sequence: u64,
    #[serde(skip_serializing_if = "Option::is_none")]
    readings: Option<&'a [f64]>,
}

#[derive(Serialize)]
struct Temperature<'a> {
    raw: BTreeMap<&'a str, f64>,
}

/// Standard errors of the means over a tick from all causes together (per second).
fn sigma(tick: &CorrectedTick, of: impl Fn(&Sigma) -> Causes) -> Option<[f64; 3]> {
    let variance = of(tick.sigma.as_deref()?).variance();
    Some(variance.map(|variance| variance.sqrt() / tick.duration.as_s()))
}

/// What is shown of a message; nothing of one that cannot be read.
pub(super) fn points(message: &Message) -> Vec<Point> {
    let received_ns = message.received_ns;
    match decode(message) {
        Ok(Some((_, Decoded::Corrected(batch)))) => {
            shown(received_ns, batch.ticks.iter().map(|tick| (tick.end_time, corrected_of(tick))))
        }
        Ok(Some((_, Decoded::Gyro(batch)))) => {
            let ticks = batch.ticks.iter();
            shown(received_ns, ticks.map(|tick| (tick.end_time, raw_of(tick.sequence, &tick.readings))))
        }
        Ok(Some((_, Decoded::Accel(batch)))) => {
            let ticks = batch.ticks.iter();
            shown(received_ns, ticks.map(|tick| (tick.end_time, raw_of(tick.sequence, &tick.readings))))
        }
        Ok(Some((_, Decoded::Temperature(batch)))) => {
            let good = batch.readings.iter().filter(|reading| reading.raw.is_finite());
            let readings = good.map(|reading| {
                let raw = BTreeMap::from([(reading.channel.as_str(), reading.raw)]);
                (reading.time, Temperature { raw })
            });
            shown(received_ns, readings)
        }
        _ => Vec::new(),
    }
}

fn corrected_of(tick: &CorrectedTick) -> Corrected {
    let known = !tick.flags.contains(TickFlags::UNCALIBRATED);
    let (rate, force) = means(tick);
    let deg_per_h = |rate: [f64; 3]| rate.map(|axis| AngularRate::from_rad_per_s(axis).as_deg_per_h());
    Corrected {
        sequence: tick.sequence,
        missed: tick.missed,
        angular_rate_deg_per_h: rate.filter(|_| known).map(deg_per_h).and_then(Axes::of),
        specific_force_m_per_s2: force.filter(|_| known).and_then(Axes::of),
        angular_rate_sigma_deg_per_h: sigma(tick, |sigma| sigma.angle).map(deg_per_h).and_then(Axes::of),
        specific_force_sigma_m_per_s2: sigma(tick, |sigma| sigma.velocity).and_then(Axes::of),
        mode: tick.mode.map_or(0, |mode| if mode == LasingMode::Plus { 1 } else { -1 }),
        flags: tick.flags.bits(),
        revision: tick.revision,
    }
}

fn raw_of(sequence: u64, readings: &[f64]) -> Raw<'_> {
    Raw { sequence, readings: readings.iter().all(|reading| reading.is_finite()).then_some(readings) }
}

/// Readings with their times, as messages of the time of reception.
fn shown<T: Serialize>(received_ns: u64, readings: impl Iterator<Item = (Timestamp, T)>) -> Vec<Point> {
    let readings: Vec<_> = readings.collect();
    let last = readings.iter().map(|(time, _)| time.as_ns()).max().unwrap_or(0);
    let point = |(time, more): (Timestamp, T)| {
        let ns = time.as_ns();
        let time_ns = u64::try_from(ns).ok()?;
        let timestamp = Stamp { sec: time_ns / 1_000_000_000, nsec: time_ns % 1_000_000_000 };
        let json = serde_json::to_vec(&Shown { timestamp, more }).ok()?;
        let before = u64::try_from(last.saturating_sub(ns)).unwrap_or(0);
        Some(Point { log_ns: received_ns.saturating_sub(before), time_ns, json })
    };
    readings.into_iter().filter_map(point).collect()
}

#[cfg(test)]
mod tests {
    use isotherm_protocol::key::UnitId;

    use super::*;

    /// Foxglove's parser of JSON Schemas takes these types, with the properties of an object and the items of a list, and no others.
    fn assert_foxglove_takes(schema: &Value, at: &str) {
        match schema["type"].as_str() {
            Some("object") => {
                let properties = schema["properties"].as_object();
                let properties = properties.unwrap_or_else(|| panic!("{at} has no properties"));
                properties.iter().for_each(|(name, of)| assert_foxglove_takes(of, &format!("{at}.{name}")));
            }
            Some("array") => assert_foxglove_takes(&schema["items"], &format!("{at}[]")),
            kind => {
                let plain = ["boolean", "string", "number", "integer"];
                assert!(kind.is_some_and(|kind| plain.contains(&kind)), "{at}: {kind:?}");
            }
        }
    }

    #[test]
    fn every_schema_is_one_that_foxglove_takes() {
        let unit = UnitId::new("ZLG-1").unwrap();
        let raw = [RawStream::Gyro, RawStream::Accel, RawStream::Temperature];
        let raw = raw.map(|stream| Topic::Raw(unit.clone(), stream));
        for topic in raw.iter().chain([&Topic::Corrected(unit.clone())]) {
            let (name, text) = schema(topic).unwrap();
            assert_foxglove_takes(&serde_json::from_str(&text).unwrap(), name);
        }
    }
}
