//! Messages of ROS 2: what bags hold, and what a node of ROS 2 takes and gives.
//!
//! They are CDR, little-endian. Sources: the message definitions of ROS 2 (`common_interfaces`, `rcl_interfaces`), REP 103 and 145.

mod definitions;
mod message;
mod names;
#[cfg(test)]
mod tests;

pub use message::{
    CdrError, Header, Imu, NOT_MEASURED, Quaternion, RosMessage, Temperature, Time, UNKNOWN, Vector3,
    from_cdr, means, time, to_cdr,
};
pub use names::{Names, token};
