//! What can be wrong with a scenario.

use core::fmt;

use crate::failure::FailingSensor;
use crate::temperature::Place;

/// A key of a scenario, with the place in its list where it stands in one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Key {
    /// Path of the key.
    pub path: &'static str,
    /// Place in the list, from 0.
    pub index: Option<usize>,
}

impl fmt::Display for Key {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.index {
            None => formatter.write_str(self.path),
            Some(index) => write!(formatter, "{}, number {index}", self.path),
        }
    }
}

/// One thing that is wrong with a scenario.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ScenarioError {
    /// A number is not finite or not within its limits.
    #[error("{key}: {got} is not within {low}…{high}")]
    OutOfRange {
        /// Where.
        key: Key,
        /// What it is.
        got: f64,
        /// Least value.
        low: f64,
        /// Largest value.
        high: f64,
    },
    /// A vector has no direction.
    #[error("{key}: the vector has no direction")]
    NoDirection {
        /// Where.
        key: Key,
    },
    /// Too few or too many sensors of a kind.
    #[error("{key}: {got} sensors, a unit has 3…8")]
    SensorCount {
        /// Where.
        key: Key,
        /// How many.
        got: usize,
    },
    /// A list is not as long as the list of sensors that it belongs to.
    #[error("{key}: {got} entries for {expected} sensors")]
    Length {
        /// Where.
        key: Key,
        /// How many.
        got: usize,
        /// How many it should be.
        expected: usize,
    },
    /// A row of an orientation is not a unit vector.
    #[error("{key}: the row's length is {got}, not 1")]
    RowNotUnit {
        /// Where.
        key: Key,
        /// Its length.
        got: f64,
    },
    /// The input axes lie in one plane.
    #[error("{key}: the input axes lie in one plane")]
    AxesInPlane {
        /// Where.
        key: Key,
    },
    /// A channel's name is empty or too long.
    #[error("{key}: a name has 1…24 bytes, this one {got}")]
    ChannelName {
        /// Where.
        key: Key,
        /// Its length in bytes.
        got: usize,
    },
    /// A channel has the name of an earlier one.
    #[error("{key}: the name is taken by an earlier channel")]
    ChannelTwice {
        /// Where.
        key: Key,
    },
    /// A channel sits on a sensor that the unit does not have.
    #[error("{key}: the unit has no such place: {place:?}")]
    UnknownPlace {
        /// Where.
        key: Key,
        /// The place.
        place: Place,
    },
    /// A failure names a sensor that the unit does not have.
    #[error("{key}: the unit has no such sensor: {sensor:?}")]
    UnknownSensor {
        /// Where.
        key: Key,
        /// The sensor.
        sensor: FailingSensor,
    },
    /// A failure is of a kind that this kind of sensor cannot have.
    #[error("{key}: a rate jump is for gyros, a force jump for accelerometers")]
    WrongFault {
        /// Where.
        key: Key,
    },
}

/// All that is wrong with a scenario; never empty.
#[derive(Debug, Clone, PartialEq)]
pub struct ScenarioErrors(pub Vec<ScenarioError>);

impl fmt::Display for ScenarioErrors {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (index, error) in self.0.iter().enumerate() {
            let separator = if index == 0 { "" } else { "; " };
            write!(formatter, "{separator}{error}")?;
        }
        Ok(())
    }
}

impl core::error::Error for ScenarioErrors {}
