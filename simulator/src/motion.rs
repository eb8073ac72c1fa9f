//! What the vehicle does, as a scenario states it.
//!
//! Frames: the local level frame is north, east, down. The case starts from it by heading about down, pitch
//! about the new east axis, roll about the case's x axis, each positive by the right-hand rule. The path's own
//! rotation is applied to the case after that. An accelerometer at rest and level feels −g along z (down).

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Rate of rotation of the Earth relative to the stars (rad/s), WGS 84.
pub const EARTH_RATE_RAD_PER_S: f64 = 7.292_115e-5;

/// Motion of the case: where it is, how it stands, and what it does there.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Motion {
    /// Geodetic latitude (°, −90…90).
    #[schemars(range(min = -90.0, max = 90.0))]
    pub latitude_deg: f64,
    /// Rate of the Earth (rad/s, −1…1); zero switches it off, which coning and sculling checks want.
    #[serde(default = "earth_rate")]
    #[schemars(range(min = -1.0, max = 1.0))]
    pub earth_rate_rad_per_s: f64,
    /// Gravity at the place (m/s², 0…20); see [`normal_gravity_m_per_s2`].
    #[schemars(range(min = 0.0, max = 20.0))]
    pub gravity_m_per_s2: f64,
    /// Heading of the case's x axis from north (°).
    #[serde(default)]
    #[schemars(range(min = -360.0, max = 360.0))]
    pub heading_deg: f64,
    /// Pitch of the case's x axis above the horizon (°).
    #[serde(default)]
    #[schemars(range(min = -360.0, max = 360.0))]
    pub pitch_deg: f64,
    /// Roll about the case's x axis (°).
    #[serde(default)]
    #[schemars(range(min = -360.0, max = 360.0))]
    pub roll_deg: f64,
    /// Movement from that attitude.
    pub path: Path,
}

fn earth_rate() -> f64 {
    EARTH_RATE_RAD_PER_S
}

/// Movement of the case relative to the Earth. Axes are case axes and need not be unit vectors.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Path {
    /// No movement.
    Rest,
    /// Rotation about a fixed axis at a constant rate.
    ConstantRate {
        /// Axis of the rotation.
        #[schemars(inner(range(min = -1e12, max = 1e12)))]
        axis: [f64; 3],
        /// Rate about it (°/s, −10 000…10 000).
        #[schemars(range(min = -1e4, max = 1e4))]
        rate_deg_per_s: f64,
    },
    /// Angle A·sin(2πft + p) about a fixed axis.
    Sine {
        /// Axis of the rotation.
        #[schemars(inner(range(min = -1e12, max = 1e12)))]
        axis: [f64; 3],
        /// Amplitude A (°, −360…360).
        #[schemars(range(min = -360.0, max = 360.0))]
        amplitude_deg: f64,
        /// Frequency f (Hz, 0…1000).
        #[schemars(range(min = 0.0, max = 1000.0))]
        frequency_hz: f64,
        /// Phase p at the start (°).
        #[serde(default)]
        #[schemars(range(min = -360.0, max = 360.0))]
        phase_deg: f64,
    },
    /// The z axis goes round a cone: attitude by the rotation vector a·(cos 2πft, sin 2πft, 0).
    Coning {
        /// Angle a between the z axis and the axis of the cone (°, −90…90).
        #[schemars(range(min = -90.0, max = 90.0))]
        half_angle_deg: f64,
        /// Frequency f (Hz, 0…1000).
        #[schemars(range(min = 0.0, max = 1000.0))]
        frequency_hz: f64,
    },
    /// Angle A·sin(2πft) about one axis and specific force B·sin(2πft + p) along another: where the axes are
    /// at right angles and p is zero, the velocity drifts by ½·A·B per second along the third one.
    Sculling {
        /// Axis of the rotation.
        #[schemars(inner(range(min = -1e12, max = 1e12)))]
        axis: [f64; 3],
        /// Amplitude A (°, −360…360).
        #[schemars(range(min = -360.0, max = 360.0))]
        amplitude_deg: f64,
        /// Frequency f (Hz, 0…1000).
        #[schemars(range(min = 0.0, max = 1000.0))]
        frequency_hz: f64,
        /// Axis of the vibration, fixed in the case.
        #[schemars(inner(range(min = -1e12, max = 1e12)))]
        vibration_axis: [f64; 3],
        /// Amplitude B of the specific force (m/s², −1000…1000).
        #[schemars(range(min = -1e3, max = 1e3))]
        vibration_m_per_s2: f64,
        /// Phase p of the specific force relative to the angle (°).
        #[serde(default)]
        #[schemars(range(min = -360.0, max = 360.0))]
        vibration_phase_deg: f64,
    },
}

impl Motion {
    /// At rest and level, x to the north, at a latitude, with that latitude's normal gravity.
    #[must_use]
    pub fn rest(latitude_deg: f64) -> Self {
        Self {
            latitude_deg,
            earth_rate_rad_per_s: EARTH_RATE_RAD_PER_S,
            gravity_m_per_s2: normal_gravity_m_per_s2(latitude_deg),
            heading_deg: 0.0,
            pitch_deg: 0.0,
            roll_deg: 0.0,
            path: Path::Rest,
        }
    }

    /// The same place and attitude with another movement.
    #[must_use]
    pub fn along(mut self, path: Path) -> Self {
        self.path = path;
        self
    }
}

/// Gravity on the WGS 84 ellipsoid by Somigliana's closed formula (m/s²).
#[must_use]
pub fn normal_gravity_m_per_s2(latitude_deg: f64) -> f64 {
    let sine = libm::sin(latitude_deg.to_radians());
    let square = sine * sine;
    9.780_325_335_9 * (1.0 + 0.001_931_852_652_41 * square) / libm::sqrt(1.0 - 0.006_694_379_990_13 * square)
}
