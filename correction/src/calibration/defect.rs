//! What can be wrong with a set of parts, and where.

use alloc::format;
use alloc::string::String;

use thiserror::Error;

use crate::curve::CurveError;
use crate::orientation::OrientationError;
use crate::reversal::ReversalError;
use crate::servo::ServoError;
use crate::stated::{self, AtDegC, Shown};

/// Part of the calibration in which a defect lies.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Section {
    /// Filter of all channels.
    Filter,
    /// The channel of this index.
    Channel(usize),
    /// The auxiliary channel of this index.
    Auxiliary(usize),
    /// The gyros as a set.
    Gyros,
    /// The gyro of this index.
    Gyro(usize),
    /// The gyros' orientation.
    GyroOrientation,
    /// The accelerometers as a set.
    Accels,
    /// The accelerometer of this index.
    Accel(usize),
    /// The accelerometers' orientation.
    AccelOrientation,
    /// The substitution over a mode switch.
    Reversal,
    /// The self-test's limits as a set.
    SelfTest,
    /// The self-test's voltage of this index.
    SelfTestVoltage(usize),
    /// The self-test's counter of this index.
    SelfTestCounter(usize),
}

/// One thing that is wrong with a set of parts.
#[derive(Debug, Clone, PartialEq)]
pub struct Defect {
    /// Where.
    pub section: Section,
    /// Which field of the part, as in [`Defect::path`]; empty for the part as a whole.
    pub field: String,
    /// What.
    pub kind: DefectKind,
}

impl Defect {
    /// Path of its key in a calibration document, but for the unit that keys end with: `gyro.sensor[1].static_bias.knots[2]`.
    #[must_use]
    pub fn path(&self) -> String {
        let (table, index) = match self.section {
            Section::Filter if self.field == "assumed_deg_c" => ("temperature", None),
            Section::Filter => ("temperature.filter", None),
            Section::Channel(index) => ("temperature.channel", Some(index)),
            Section::Auxiliary(index) => ("auxiliary", Some(index)),
            Section::Gyros => ("gyro", None),
            Section::Gyro(index) => ("gyro.sensor", Some(index)),
            Section::GyroOrientation => ("gyro.orientation", None),
            Section::Accels => ("accel", None),
            Section::Accel(index) => ("accel.sensor", Some(index)),
            Section::AccelOrientation => ("accel.orientation", None),
            Section::Reversal => ("mode_reversal", None),
            Section::SelfTest => ("self_test", None),
            Section::SelfTestVoltage(index) => ("self_test.voltage", Some(index)),
            Section::SelfTestCounter(index) => ("self_test.counter", Some(index)),
        };
        let table = index.map_or_else(|| table.into(), |index| format!("{table}[{index}]"));
        if self.field.is_empty() { table } else { format!("{table}.{}", self.field) }
    }
}

/// Kinds of wrongness.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum DefectKind {
    /// A time that the filter's grid cannot resolve.
    #[error("is {} s, must be at least temperature.filter.grid_step_s, {} s", Shown(*time_s), Shown(*grid_step_s))]
    BelowGridStep {
        /// The time (s).
        time_s: f64,
        /// Step of the grid (s).
        grid_step_s: f64,
    },
    /// Not a finite number, or outside its limits.
    #[error("is {}, must be {} to {}", Shown(*value), Shown(*low), Shown(*high))]
    OutOfRange {
        /// The value.
        value: f64,
        /// Smallest value allowed.
        low: f64,
        /// Largest value allowed.
        high: f64,
    },
    /// Too few or too many.
    #[error("has {count} entries, must have {low} to {high}")]
    Count {
        /// How many there are.
        count: usize,
        /// Fewest allowed.
        low: usize,
        /// Most allowed.
        high: usize,
    },
    /// Lower limit at or above the upper one.
    #[error("runs from {} to {}: the first must be below the second", Shown(*low), Shown(*high))]
    InvertedRange {
        /// Lower end.
        low: f64,
        /// Upper end.
        high: f64,
    },
    /// An index that names no channel.
    #[error("names channel {index}, but there are {channels}")]
    NoSuchChannel {
        /// The index.
        index: usize,
        /// How many channels there are.
        channels: usize,
    },
    /// Two things of one name.
    #[error("is also the name of {of}[{other}]: names must differ")]
    DuplicateName {
        /// What list the earlier one is in.
        of: &'static str,
        /// Its index.
        other: usize,
    },
    /// Correlations that no numbers can have.
    #[error(
        "is not a correlation matrix of these σ: it must be symmetric, with 1 in its diagonal and no negative \
         variance"
    )]
    NoCovariance,
    /// A name without a letter.
    #[error("is empty, must be a name")]
    NoName,
    /// Zero where a divisor or a weight is needed.
    #[error("is zero {}, must not be zero anywhere in its range", AtDegC(*.at))]
    Zero {
        /// Argument at which it is zero.
        at: f64,
    },
    /// A term that works on counts, for gyros with another output.
    #[error("needs gyros with output = \"counts\"")]
    NeedsCounts,
    /// Needed because another part is there.
    #[error("is missing: {needed_by} needs it")]
    Missing {
        /// What needs it.
        needed_by: &'static str,
    },
    /// A curve is wrong.
    #[error(transparent)]
    Curve(#[from] CurveError),
    /// The orientation is wrong.
    #[error(transparent)]
    Orientation(#[from] OrientationError),
    /// The substitution is wrong.
    #[error(transparent)]
    Reversal(#[from] ReversalError),
    /// The servo transient is wrong.
    #[error(transparent)]
    Servo(#[from] ServoError),
    /// The drift is wrong.
    #[error(transparent)]
    Drift(#[from] stated::OutOfRange),
}
