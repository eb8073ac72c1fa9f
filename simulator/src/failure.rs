//! Sensors that fail in the middle of a run.

use isotherm_correction::sample::Readings;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// One failure. From `at_s` on it lasts to the end; the truth is not touched by it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Failure {
    /// Which sensor.
    pub sensor: FailingSensor,
    /// When, from the start of the run (s, ≥ 0).
    #[schemars(range(min = 0.0, max = 1e12))]
    pub at_s: f64,
    /// How.
    pub fault: Fault,
}

/// A sensor by its kind and its number from 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum FailingSensor {
    /// A gyro.
    Gyro(usize),
    /// An accelerometer.
    Accelerometer(usize),
}

/// The way in which a sensor fails.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Fault {
    /// The reading stays what it was in the last good tick (zero where there was none).
    Stuck,
    /// This is added to a gyro's input rate (rad/s).
    RateJump {
        /// By how much (rad/s).
        #[schemars(range(min = -1e12, max = 1e12))]
        rad_per_s: f64,
    },
    /// This is added to an accelerometer's input (m/s²).
    ForceJump {
        /// By how much (m/s²).
        #[schemars(range(min = -1e12, max = 1e12))]
        m_per_s2: f64,
    },
    /// The reading is not a number.
    NotFinite,
}

/// The failures of a run.
#[derive(Debug, Clone)]
pub(crate) struct Failures(pub(crate) Vec<Failure>);

impl Failures {
    fn of(&self, sensor: FailingSensor, time_s: f64) -> impl Iterator<Item = Fault> {
        let of = self.0.iter().filter(move |failure| failure.sensor == sensor && time_s >= failure.at_s);
        of.map(|failure| failure.fault)
    }

    /// What is added to a sensor's input (rad/s or m/s²).
    pub(crate) fn extra(&self, sensor: FailingSensor, time_s: f64) -> f64 {
        let jump = |fault| match fault {
            Fault::RateJump { rad_per_s } => rad_per_s,
            Fault::ForceJump { m_per_s2 } => m_per_s2,
            Fault::Stuck | Fault::NotFinite => 0.0,
        };
        self.of(sensor, time_s).map(jump).sum()
    }

    /// Puts the last values of sensors that are stuck, zero where there were none, in the place of the present ones.
    pub(crate) fn repeat<T: Copy + Default>(
        &self,
        sensor: fn(usize) -> FailingSensor,
        time_s: f64,
        values: &mut [T],
        last: &[T],
    ) {
        for (index, value) in values.iter_mut().enumerate() {
            if self.of(sensor(index), time_s).any(|fault| fault == Fault::Stuck) {
                *value = last.get(index).copied().unwrap_or_default();
            }
        }
    }

    /// Changes the readings of sensors that are stuck or give no numbers; remembers them in `last`.
    pub(crate) fn change(
        &self,
        sensor: fn(usize) -> FailingSensor,
        time_s: f64,
        readings: &mut Readings,
        last: &mut Readings,
    ) {
        self.repeat(sensor, time_s, readings, last);
        for (index, reading) in readings.iter_mut().enumerate() {
            if self.of(sensor(index), time_s).any(|fault| fault == Fault::NotFinite) {
                *reading = f64::NAN;
            }
        }
        last.clone_from(readings);
    }
}
