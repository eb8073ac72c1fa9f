//! `metadata.yaml`, as `ros2 bag` reads it.

use std::fmt::Write as _;

use super::BagSummary;

/// Version of the form: the first that lists the files, which every `ros2 bag` since Humble reads. What later ones add is
/// nothing that is known here.
const VERSION: u32 = 5;

/// Quality of service that a player is to offer: keep the last ten, reliable, volatile, no limits of time. As text, which
/// is how versions up to 8 hold it, with the numbers of `rmw`.
pub(super) const QUALITY_OF_SERVICE: &str = "\
- history: 1
  depth: 10
  reliability: 1
  durability: 2
  deadline:
    sec: 9223372036
    nsec: 854775807
  lifespan:
    sec: 9223372036
    nsec: 854775807
  liveliness: 1
  liveliness_lease_duration:
    sec: 9223372036
    nsec: 854775807
  avoid_ros_namespace_conventions: false";

/// The file's text.
pub(super) fn yaml(file: &str, summary: &BagSummary) -> String {
    let (start, duration) = (summary.first_ns.unwrap_or(0), summary.duration_ns());
    let (messages, file) = (summary.messages(), quoted(file));
    let mut text = format!(
        "rosbag2_bagfile_information:\n  version: {VERSION}\n  storage_identifier: mcap\n  duration:\n    nanoseconds: {duration}\n\
         \x20 starting_time:\n    nanoseconds_since_epoch: {start}\n  message_count: {messages}\n  topics_with_message_count:\n"
    );
    for topic in &summary.topics {
        let _ = writeln!(
            text,
            "    - topic_metadata:\n        name: {}\n        type: {}\n        serialization_format: cdr\n\
             \x20       offered_qos_profiles: {}\n      message_count: {}",
            quoted(&topic.name),
            topic.message_type,
            quoted(QUALITY_OF_SERVICE),
            topic.messages
        );
    }
    let _ = write!(
        text,
        "  compression_format: \"\"\n  compression_mode: \"\"\n  relative_file_paths:\n    - {file}\n  files:\n    - path: {file}\n\
         \x20     starting_time:\n        nanoseconds_since_epoch: {start}\n      duration:\n        nanoseconds: {duration}\n\
         \x20     message_count: {messages}\n"
    );
    text
}

/// A text in double quotes: what JSON writes is YAML too.
fn quoted(text: &str) -> String {
    serde_json::Value::from(text).to_string()
}
