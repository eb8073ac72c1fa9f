//! What a recording says of itself: versions and options at its beginning, counts at its end.

use std::time::{Duration, UNIX_EPOCH};

use isotherm_log::message::Topic;
use isotherm_log::recording::Metadata;
use isotherm_protocol::version;
use serde::Serialize;

/// Messages of one topic in one file.
#[derive(Debug, Serialize)]
struct TopicLine {
    topic: String,
    received: u64,
    written: u64,
    lost: u64,
}

/// What the beginning of a file says; `described` is how all files are recorded.
pub(super) fn beginning(described: &[(&'static str, String)], number: u32) -> Metadata {
    let now_ns = super::queue::now_ns();
    let values = [
        ("record", "beginning".to_owned()),
        ("version", env!("CARGO_PKG_VERSION").to_owned()),
        ("wire_versions", wire_versions()),
        ("file", number.to_string()),
        ("began_ns", now_ns.to_string()),
        ("began", time(now_ns)),
    ];
    Metadata::of(described.iter().cloned().chain(values))
}

/// What its end says; `lost` is by number of the topic, as `written` is.
pub(super) fn end(why: &str, topics: &[Topic], written: &[u64], lost: &[u64]) -> Metadata {
    let of = |counts: &[u64], number: usize| counts.get(number).copied().unwrap_or(0);
    let lines = topics.iter().enumerate().map(|(number, topic)| {
        let (written, lost) = (of(written, number), of(lost, number));
        TopicLine { topic: topic.key(), received: written + lost, written, lost }
    });
    let mut lines: Vec<_> = lines.filter(|line| line.received > 0).collect();
    lines.sort_by(|a, b| a.topic.cmp(&b.topic));
    let sum = |count: fn(&TopicLine) -> u64| lines.iter().map(count).sum::<u64>().to_string();
    let now_ns = super::queue::now_ns();
    Metadata::of([
        ("record", "end".to_owned()),
        ("why", why.to_owned()),
        ("ended_ns", now_ns.to_string()),
        ("ended", time(now_ns)),
        ("received", sum(|line| line.received)),
        ("written", sum(|line| line.written)),
        ("lost", sum(|line| line.lost)),
        // Plain structures of numbers and texts always serialise.
        ("topics", serde_json::to_string(&lines).unwrap_or_default()),
    ])
}

/// The versions of each kind of message that this program knows.
fn wire_versions() -> String {
    let versions = [
        ("raw_gyro", version::RAW_GYRO),
        ("raw_accelerometer", version::RAW_ACCEL),
        ("raw_temperature", version::RAW_TEMPERATURE),
        ("raw_health", version::RAW_HEALTH),
        ("rate_reference", version::REFERENCE),
        ("corrected", version::CORRECTED),
        ("status", version::STATUS),
        ("service_status", version::SERVICE_STATUS),
        ("journal", version::JOURNAL),
    ];
    versions.map(|(name, versions)| format!("{name} {versions}")).join(", ")
}

/// A time for people (UTC).
fn time(ns: u64) -> String {
    humantime::format_rfc3339_millis(UNIX_EPOCH + Duration::from_nanos(ns)).to_string()
}
