//! Sensors that fail in the middle of a run.

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

/// The failures of a run and what they need to remember.
#[derive(Debug, Clone)]
pub(crate) struct Failures {
    failures: Vec<Failure>,
}

impl Failures {
    pub(crate) fn new(failures: &[Failure]) -> Self {
        Self { failures: failures.to_vec() }
    }

    fn of(&self, sensor: FailingSensor, time_s: f64) -> impl Iterator<Item = Fault> {
        self.failures
            .iter()
            .filter(move |failure| failure.sensor == sensor && time_s >= failure.at_s)
            .map(|f| f.fault)
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

    /// Whether a sensor repeats its last reading.
    pub(crate) fn stuck(&self, sensor: FailingSensor, time_s: f64) -> bool {
        self.of(sensor, time_s).any(|fault| fault == Fault::Stuck)
    }

    /// Whether a sensor's reading is not a number.
    pub(crate) fn not_finite(&self, sensor: FailingSensor, time_s: f64) -> bool {
        self.of(sensor, time_s).any(|fault| fault == Fault::NotFinite)
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.failures.is_empty()
    }
}
