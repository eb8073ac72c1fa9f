//! The messages, as CDR has them.

use byteorder::LittleEndian;
use isotherm_correction::sample::{CorrectedTick, TickFlags};
use serde::Serialize;

use super::definitions;

/// What stands before the CDR of a message: plain CDR, little-endian, no options.
const ENCAPSULATION: [u8; 4] = [0, 1, 0, 0];
/// Nothing is known of a covariance.
const UNKNOWN: [f64; 9] = [0.0; 9];
/// The quantity itself is not known; stands in element 0 of its covariance.
const NOT_MEASURED: [f64; 9] = [-1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];

/// A message that a bag can hold.
pub trait RosMessage: Serialize + Sized {
    /// Name of its type.
    const TYPE: &'static str;
    /// Its definition, followed by those of the types in it.
    const DEFINITION: &'static str;

    /// The message as bytes.
    ///
    /// # Errors
    /// Where a text of it has more than 2³² bytes.
    fn to_cdr(&self) -> Result<Vec<u8>, cdr_encoding::Error> {
        let mut bytes = ENCAPSULATION.to_vec();
        // The alignment of CDR counts from behind the encapsulation, as does the writer.
        cdr_encoding::to_writer::<_, LittleEndian, _>(&mut bytes, self)?;
        Ok(bytes)
    }
}

/// `builtin_interfaces/msg/Time`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
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
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Header {
    /// When the sample was taken.
    pub stamp: Time,
    /// The frame that it is in.
    pub frame_id: String,
}

/// `geometry_msgs/msg/Vector3`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Vector3 {
    /// Along x.
    pub x: f64,
    /// Along y.
    pub y: f64,
    /// Along z.
    pub z: f64,
}

impl From<[f64; 3]> for Vector3 {
    fn from([x, y, z]: [f64; 3]) -> Self {
        Self { x, y, z }
    }
}

/// `geometry_msgs/msg/Quaternion`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
struct Quaternion {
    x: f64,
    y: f64,
    z: f64,
    w: f64,
}

/// `sensor_msgs/msg/Imu`. There is never an orientation: element 0 of its covariance is −1.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Imu {
    header: Header,
    orientation: Quaternion,
    orientation_covariance: [f64; 9],
    angular_velocity: Vector3,
    angular_velocity_covariance: [f64; 9],
    linear_acceleration: Vector3,
    linear_acceleration_covariance: [f64; 9],
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
#[derive(Debug, Clone, PartialEq, Serialize)]
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
