//! Definitions of the message types: fields as ROS 2 has them, each type in a message behind it.

/// `sensor_msgs/msg/Imu`.
pub(super) const IMU: &str = "\
# Inertial measurement: accelerations in m/s^2, rates in rad/s.
# A covariance of zeros is unknown; element 0 of -1 says that there is no such measurement.

std_msgs/Header header

geometry_msgs/Quaternion orientation
float64[9] orientation_covariance # Row major about x, y, z axes

geometry_msgs/Vector3 angular_velocity
float64[9] angular_velocity_covariance # Row major about x, y, z axes

geometry_msgs/Vector3 linear_acceleration
float64[9] linear_acceleration_covariance # Row major about x, y, z axes

================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id

================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec

================================================================================
MSG: geometry_msgs/Quaternion
float64 x 0
float64 y 0
float64 z 0
float64 w 1

================================================================================
MSG: geometry_msgs/Vector3
float64 x
float64 y
float64 z
";

/// `sensor_msgs/msg/Temperature`.
pub(super) const TEMPERATURE: &str = "\
# A temperature reading.

std_msgs/Header header
float64 temperature # Degrees Celsius
float64 variance # 0 is unknown

================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id

================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
";
