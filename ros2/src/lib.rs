//! isotherm-ros: raw `sensor_msgs/Imu` in, corrected ones out, as `rmw_zenoh` has them, without ROS.
//!
//! A bridge between the keys of ROS 2 and the project's own topics: what corrects is the service, in this process or elsewhere.
//!
//! What this crate refuses to do: correct anything, decide what a stamp means other than by the mapping, or lose a message
//! without counting it.
//!
//! | module | holds |
//! |---|---|
//! | [`mapping`] | which topic is which unit, in which units of measure |
//! | [`name`] | names, keys and liveliness tokens of the graph |
//! | [`interface`] | types of messages with their hashes; those that only a bridge needs |
//! | [`qos`] | qualities of service |
//! | [`attachment`] | what goes with every message |
//! | [`feed`] | messages → ticks |
//! | [`noise`] | a calibration document → covariances |
//! | [`outgoing`] | corrected ticks → messages |
//! | [`session`] | the session that ROS 2 sees |
//! | [`graph`] | who else is on the topics |
//! | [`bridge`] | all of it at work |
//! | [`totals`] | what was done |
//! | [`cli`], [`check`] | the commands |
//!
//! Source: release branches of `rmw_zenoh` for jazzy, kilted, lyrical and rolling.

pub mod attachment;
pub mod bridge;
pub mod check;
pub mod cli;
mod error;
pub mod feed;
pub mod graph;
pub mod interface;
pub mod mapping;
pub mod name;
pub mod noise;
pub mod outgoing;
pub mod qos;
pub mod session;
#[cfg(test)]
mod tests;
pub mod totals;

pub use bridge::Bridge;
pub use error::Error;
pub use mapping::Mapping;
