//! The messages, as CDR has them.

use byteorder::{BigEndian, LittleEndian};
use isotherm_correction::sample::{CorrectedTick, TickFlags};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::definitions;

/// What stands before the CDR of a message: plain CDR, little-endian, no options.
const ENCAPSULATION: [u8; 4] = [0, 1, 0, 0];
/// Most bytes behind a message: DDS fills up to a multiple of four.
const MOST_FILL: usize = 3;
/// Nothing is known of a covariance.
pub const UNKNOWN: [f64; 9] = [0.0; 9];
/// The quantity itself is not known; stands in element 0 of its covariance.
pub const NOT_MEASURED: [f64; 9] = [-1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];

/// Why bytes are no message.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum CdrError {
    /// They do not begin as plain CDR does.
    #[error(
        "begins with {0:02x?}, must begin with 00 00 (big-endian) or 00 01 (little-endian) and two bytes of options"
    )]
    Encapsulation(Vec<u8>),
    /// They do not decode: cut short, or of another type or byte order.
    #[error("does not decode: {0}")]
    Body(String),
    /// More follows than a message has.
    #[error("has {extra} bytes too many, may have {MOST_FILL} to fill up")]
    Extra {
        /// How many.
        extra: usize,
    },
}

/// A message as bytes.
///
/// # Errors
/// Where a text of it has more than 2³² bytes.
pub fn to_cdr<M: Serialize>(message: &M) -> Result<Vec<u8>, cdr_encoding::Error> {
    let mut bytes = ENCAPSULATION.to_vec();
    // The alignment of CDR counts from behind the encapsulation, as does the writer.
    cdr_encoding::to_writer::<_, LittleEndian, _>(&mut bytes, message)?;
    Ok(bytes)
}

/// A message from bytes, of either byte order.
///
/// # Errors
/// [`CdrError`].
pub fn from_cdr<M: DeserializeOwned>(bytes: &[u8]) -> Result<M, CdrError> {
    let refused = || CdrError::Encapsulation(bytes.iter().take(4).copied().collect());
    let (head, body) = bytes.split_first_chunk::<4>().ok_or_else(refused)?;
    let read = match head {
        [0, 0, _, _] => cdr_encoding::from_bytes::<M, BigEndian>(body),
        [0, 1, _, _] => cdr_encoding::from_bytes::<M, LittleEndian>(body),
        _ => return Err(refused()),
    };
    let (message, taken) = read.map_err(|error| CdrError::Body(error.to_string()))?;
    match body.len().saturating_sub(taken) {
        0..=MOST_FILL => Ok(message),
        extra => Err(CdrError::Extra { extra }),
    }
}

/// A message that a bag can hold.
pub trait RosMessage: Serialize + Sized {
    /// Name of its type.
    const TYPE: &'static str;
    /// Its definition, followed by those of the types in it.
    const DEFINITION: &'static str;
}

/// `builtin_interfaces/msg/Time`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Time {
    /// Seconds, rounded down.
    pub sec: i32,
    /// And nanoseconds, 0 to 999 999 999.
    pub nanosec: u32,
}

/// A time of nanoseconds; `None` beyond the 68 years that a ROS time holds, and before its zero, which no bag can hold.
#[must_use]
pub fn time(ns: i64) -> Option<Time> {
    const SECOND: i64 = 1_000_000_000;
    let sec = i32::try_from(ns.div_euclid(SECOND)).ok().filter(|sec| *sec >= 0)?;
    let nanosec = u32::try_from(ns.rem_euclid(SECOND)).ok()?;
    Some(Time { sec, nanosec })
}

/// `std_msgs/msg/Header`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Header {
    /// When the sample was taken.
    pub stamp: Time,
    /// The frame that it is in.
    pub frame_id: String,
}

/// `geometry_msgs/msg/Vector3`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Vector3 {
    /// Along x.
    pub x: f64,
    /// Along y.
    pub y: f64,
    /// Along z.
    pub z: f64,
}

impl From<Vector3> for [f64; 3] {
    fn from(Vector3 { x, y, z }: Vector3) -> Self {
        [x, y, z]
    }
}

impl From<[f64; 3]> for Vector3 {
    fn from([x, y, z]: [f64; 3]) -> Self {
        Self { x, y, z }
    }
}

/// `geometry_msgs/msg/Quaternion`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Quaternion {
    /// Share of x.
    pub x: f64,
    /// Share of y.
    pub y: f64,
    /// Share of z.
    pub z: f64,
    /// Cosine of half the angle.
    pub w: f64,
}

/// `sensor_msgs/msg/Imu`. What is made here never has an orientation: element 0 of its covariance is −1.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Imu {
    /// When and where.
    pub header: Header,
    /// Orientation.
    pub orientation: Quaternion,
    /// Its covariance (rad²), row by row; −1 in element 0 where there is none.
    pub orientation_covariance: [f64; 9],
    /// Rate about each axis (rad/s).
    pub angular_velocity: Vector3,
    /// Its covariance ((rad/s)²); zeros are unknown, −1 in element 0 where there is no rate.
    pub angular_velocity_covariance: [f64; 9],
    /// Specific force along each axis (m/s²).
    pub linear_acceleration: Vector3,
    /// Its covariance ((m/s²)²), likewise.
    pub linear_acceleration_covariance: [f64; 9],
}

impl RosMessage for Imu {
    const TYPE: &'static str = "sensor_msgs/msg/Imu";
    const DEFINITION: &'static str = definitions::IMU;
}

impl Imu {
    /// Rates (rad/s) and specific forces (m/s²); `None` is unknown and has −1 in element 0 of its covariance. The
    /// covariance of what is known is unknown: all zero.
    #[must_use]
    pub fn new(header: Header, rate: Option<[f64; 3]>, force: Option<[f64; 3]>) -> Self {
        let covariance = |known: bool| if known { UNKNOWN } else { NOT_MEASURED };
        Self {
            header,
            orientation: Quaternion { x: 0.0, y: 0.0, z: 0.0, w: 1.0 },
            orientation_covariance: NOT_MEASURED,
            angular_velocity: rate.unwrap_or_default().into(),
            angular_velocity_covariance: covariance(rate.is_some()),
            linear_acceleration: force.unwrap_or_default().into(),
            linear_acceleration_covariance: covariance(force.is_some()),
        }
    }

    /// Means over a corrected tick: its increments divided by its duration.
    #[must_use]
    pub fn of_tick(header: Header, tick: &CorrectedTick) -> Self {
        let (rate, force) = means(tick);
        Self::new(header, rate, force)
    }
}

/// Mean rate (rad/s) and specific force (m/s²) over a corrected tick: its increments divided by its duration; `None` where its flags
/// say that it is not known.
#[must_use]
pub fn means(tick: &CorrectedTick) -> (Option<[f64; 3]>, Option<[f64; 3]>) {
    let duration_s = tick.duration.as_s();
    let mean = |increments: [f64; 3]| increments.map(|increment| increment / duration_s);
    let no_force = TickFlags::ACCELEROMETER_MISSING | TickFlags::VELOCITY_INVALID;
    let rate = (!tick.flags.contains(TickFlags::ANGLE_INVALID)).then(|| mean(tick.delta_angle));
    let force = (!tick.flags.intersects(no_force)).then(|| mean(tick.delta_velocity));
    (rate, force)
}

/// `sensor_msgs/msg/Temperature`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Temperature {
    /// When and where.
    pub header: Header,
    /// °C.
    pub temperature: f64,
    /// 0: unknown.
    pub variance: f64,
}

impl RosMessage for Temperature {
    const TYPE: &'static str = "sensor_msgs/msg/Temperature";
    const DEFINITION: &'static str = definitions::TEMPERATURE;
}
