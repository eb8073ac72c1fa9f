//! Health of one gyro or accelerometer.

use serde::{Deserialize, Serialize};

/// Kind of a sensor.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SensorKind {
    /// A gyro.
    Gyro,
    /// An accelerometer.
    Accel,
}

/// Health of one sensor; the counts are of corrected ticks since the unit appeared.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct SensorStatus {
    /// Name in the calibration document; its number from 1 where it has none.
    pub name: String,
    /// Gyro or accelerometer.
    pub kind: SensorKind,
    /// Bits of [`isotherm_correction::sample::SensorFlags`] in the last tick.
    pub flags: u8,
    /// Ticks looked at.
    pub ticks: u64,
    /// Ticks in which its reading did not take part as it stands.
    pub invalid: u64,
    /// Ticks at or beyond the input range.
    pub overrange: u64,
    /// Ticks with a reading that was no finite number.
    pub not_finite: u64,
    /// Ticks with a temperature outside a fitted range.
    pub clamped: u64,
    /// Ticks with a stale temperature.
    pub stale: u64,
    /// Ticks in which the parity check excluded it.
    pub excluded: u64,
}
