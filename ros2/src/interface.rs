//! Types of messages and services, each with the hash by which ROS 2 tells its versions apart (REP 2011), and the messages
//! that a log has no use for.

use isotherm_log::ros2::Header;
use serde::{Deserialize, Serialize};

/// A type of a topic or a service.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Interface {
    /// `sensor_msgs/msg/Imu` as keys have it: `sensor_msgs::msg::dds_::Imu_`.
    pub dds: &'static str,
    /// `RIHS01_` and 64 hexadecimal digits, the same in jazzy, kilted, lyrical and rolling.
    pub hash: &'static str,
}

/// What a humble node has in the place of a hash.
pub const NO_HASH: &str = "TypeHashNotSupported";

/// `sensor_msgs/msg/Imu`.
pub const IMU: Interface = Interface {
    dds: "sensor_msgs::msg::dds_::Imu_",
    hash: "RIHS01_7d9a00ff131080897a5ec7e26e315954b8eae3353c3f995c55faf71574000b5b",
};

/// `sensor_msgs/msg/Temperature`.
pub const TEMPERATURE: Interface = Interface {
    dds: "sensor_msgs::msg::dds_::Temperature_",
    hash: "RIHS01_72514a14126ab9f8a9abec974c78e5610a367b59db5da355ff1fb982d5bad4b8",
};

/// `diagnostic_msgs/msg/DiagnosticArray`.
pub const DIAGNOSTICS: Interface = Interface {
    dds: "diagnostic_msgs::msg::dds_::DiagnosticArray_",
    hash: "RIHS01_5a8a36efb05fb25070fa0fb3810290c0e6cd4862b54a8fb975a1ee8dc55a333e",
};

/// `std_srvs/srv/Trigger`.
pub const TRIGGER: Interface = Interface {
    dds: "std_srvs::srv::dds_::Trigger_",
    hash: "RIHS01_eeff2cd6fa5ad9d27cdf4dec64818317839b62f212a91e6b5304b634b2062c5f",
};

/// `diagnostic_msgs/msg/DiagnosticArray`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DiagnosticArray {
    /// When it was made; no frame.
    pub header: Header,
    /// One for each unit.
    pub status: Vec<DiagnosticStatus>,
}

/// How well a unit does; the bytes are those of `diagnostic_msgs/msg/DiagnosticStatus`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(into = "u8", try_from = "u8")]
pub enum Level {
    /// All is well.
    Ok = 0,
    /// Something to look at.
    Warn = 1,
    /// It does not work.
    Error = 2,
    /// Nothing comes any more.
    Stale = 3,
}

impl From<Level> for u8 {
    fn from(level: Level) -> Self {
        level as Self
    }
}

impl TryFrom<u8> for Level {
    type Error = String;

    fn try_from(byte: u8) -> Result<Self, String> {
        let all = [Self::Ok, Self::Warn, Self::Error, Self::Stale];
        all.into_iter().find(|level| u8::from(*level) == byte).ok_or_else(|| format!("{byte} is no level"))
    }
}

/// `diagnostic_msgs/msg/DiagnosticStatus`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DiagnosticStatus {
    /// How well it does.
    pub level: Level,
    /// What it is about.
    pub name: String,
    /// In words.
    pub message: String,
    /// Serial of the unit.
    pub hardware_id: String,
    /// Figures.
    pub values: Vec<KeyValue>,
}

/// `diagnostic_msgs/msg/KeyValue`.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct KeyValue {
    /// Name, with its unit of measure.
    pub key: String,
    /// Value.
    pub value: String,
}

/// Response of `std_srvs/srv/Trigger`.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct TriggerResponse {
    /// Whether it was done.
    pub success: bool,
    /// What was done, or why not.
    pub message: String,
}

/// Request of `std_srvs/srv/Trigger`: ROS gives a message without fields one byte.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct TriggerRequest {
    /// Says nothing.
    pub structure_needs_at_least_one_member: u8,
}
