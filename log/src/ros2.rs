//! A ROS 2 bag: a folder with an MCAP file of the profile `ros2` and the `metadata.yaml` that `ros2 bag` reads.
//!
//! | topic | type | from |
//! |---|---|---|
//! | `/imu/<unit>/data` | `sensor_msgs/msg/Imu` | corrected increments, divided by their duration |
//! | `/imu/<unit>/data_raw` | `sensor_msgs/msg/Imu` | raw readings of three gyros in rad/s ([`nominal`]) |
//! | `/imu/<unit>/temperature/<channel>` | `sensor_msgs/msg/Temperature` | temperatures as they were applied (°C) |
//! | `/imu/<unit>/temperature_raw/<channel>` | `sensor_msgs/msg/Temperature` | raw readings through the document's conversion (°C) |
//!
//! Every time in the bag is that of the sample on the producer's clock. The messages are CDR, little-endian; their
//! definitions stand in the file, so that a reader needs nothing else.
//!
//! Sources: the message definitions of ROS 2 (`common_interfaces`, `rcl_interfaces`), REP 103 and 145,
//! `rosbag2_storage` (`yaml.hpp`, `qos.cpp`) and the MCAP profile `ros2`.

mod bag;
mod definitions;
mod message;
mod metadata;
mod names;
pub mod nominal;
#[cfg(test)]
mod tests;

pub use bag::{BagSummary, BagTopic, BagWriter};
pub use message::{
    CdrError, Header, Imu, NOT_MEASURED, Quaternion, RosMessage, Temperature, Time, UNKNOWN, Vector3,
    from_cdr, means, time, to_cdr,
};
pub use names::{Names, token};
