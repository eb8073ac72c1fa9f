//! What was really there, beside each raw tick.

use isotherm_correction::sample::{AccelTick, GyroTick, Sensors, TemperatureReading};

/// One step of a simulation: the raw messages of one tick and the truth about it.
#[derive(Debug, Clone, PartialEq)]
pub struct Step {
    /// Raw tick of the gyros.
    pub gyro: GyroTick,
    /// Raw tick of the accelerometers, where the unit has any.
    pub accel: Option<AccelTick>,
    /// Temperature readings that fall into the tick; those at the very start come with the first tick.
    pub temperatures: Vec<TemperatureReading>,
    /// The truth.
    pub truth: Truth,
}

/// Exact state of unit and surroundings over one tick. Slow quantities are those in the middle of the tick.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Truth {
    /// ∫ω dt about the case axes, ω relative to the stars (rad).
    pub delta_angle: [f64; 3],
    /// ∫f dt along the case axes (m/s).
    pub delta_velocity: [f64; 3],
    /// Temperature of the chamber (°C).
    pub chamber_deg_c: f64,
    /// Temperature of the housing, which the orientation follows (°C).
    pub housing_deg_c: f64,
    /// Temperature of the electronics board (°C).
    pub board_deg_c: f64,
    /// Temperature at each gyro's sensor (°C).
    pub gyro_deg_c: Sensors<f64>,
    /// Temperature of each accelerometer (°C).
    pub accel_deg_c: Sensors<f64>,
    /// Drift of each gyro (rad/s): all that adds to its input but noise, servo transient and failures. The
    /// correction model's Ω: angle = K·reading − Ω·Δt.
    pub gyro_drift_rad_per_s: Sensors<f64>,
    /// Apparent rate of each gyro from the servo transient (rad/s); zero for gyros without a servo.
    pub gyro_transient_rad_per_s: Sensors<f64>,
    /// The counts of this tick carry nothing: there was no two-way generation.
    pub lost: bool,
}
