//! What was found of accelerometers: of the ratio of their board, and of axes before and after a thermal cycle.

use std::fmt::{self, Display, Formatter};

use crate::axes::AXES;
use crate::report::{fixed, short};

/// What was found of an accelerometer. Temperatures are in °C, forces in m/s², angles in ″.
#[derive(Debug, Clone, PartialEq)]
pub enum AccelKind {
    /// The document names no channel of the board.
    NoBoardChannel,
    /// A run has no readings of the board's temperature, or of the accelerometer's.
    NoReadings {
        /// The channel.
        channel: String,
    },
    /// The board's temperature does not change enough.
    BoardStays {
        /// The channel.
        channel: String,
        /// Lowest and highest temperature.
        range: [f64; 2],
        /// Least change.
        needed: f64,
    },
    /// The input does not differ enough between the runs.
    SameInput {
        /// Largest difference, and least one.
        spread: [f64; 2],
    },
    /// The runs of different input do not share enough of the board's temperatures.
    OtherTemperatures {
        /// What they share, and least.
        shared: [f64; 2],
    },
    /// The board's temperature goes with that of the accelerometer.
    BoardFollows {
        /// Channels of board and accelerometer.
        channels: [String; 2],
        /// What the board's temperature has of its own (rms), and least.
        own: [f64; 2],
    },
    /// Too few windows.
    FewWindows {
        /// Their number.
        windows: usize,
    },
    /// Part of what follows the board does not go with the input.
    BiasFollowsBoard {
        /// Its slope (m/s² per °C), and standard error.
        slope: [f64; 2],
    },
    /// With it, what is left along a case axis grows.
    MadeWorse {
        /// The axis, 0…2.
        axis: usize,
    },
    /// An axis did not come back after a thermal cycle.
    AxisMoved {
        /// Temperature of the positions before and after.
        deg_c: f64,
        /// Names of the logs before and after.
        logs: [String; 2],
        /// By how much it turned, and standard error.
        turn: [f64; 2],
    },
}

impl Display for AccelKind {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoBoardChannel => f.write_str(
                "the document has no board_channel for it: name the temperature channel of its electronics there (--calibration)",
            ),
            Self::NoReadings { channel } => {
                write!(f, "a run has no readings of temperature channel {channel:?}: check the mapping")
            }
            Self::BoardStays { channel, range: [low, high], needed } => write!(
                f,
                "the board's channel {channel:?} stays between {} and {} °C, a change of {needed} °C is needed: run the chamber",
                fixed(*low, 1),
                fixed(*high, 1)
            ),
            Self::SameInput { spread: [spread, needed] } => write!(
                f,
                "its runs spread its input by {} m/s², at least {} are needed: add a cycle in the opposite position (--pitch, --roll for \
                 each log)",
                short(*spread),
                short(*needed)
            ),
            Self::OtherTemperatures { shared: [shared, needed] } => write!(
                f,
                "the runs of different input share {} °C of the board's temperature, at least {needed} are needed: take every position \
                 through the same cycle",
                fixed(shared.max(0.0), 1)
            ),
            Self::BoardFollows { channels: [board, sensor], own: [own, needed] } => write!(
                f,
                "the board's channel {board:?} goes with the accelerometer's {sensor:?}: it has {} °C rms of its \
                 own, {needed} are needed to separate the board's ratio from the scale factor. Keep the \
                 accelerometers on their thermostat, or warm the board alone",
                short(*own)
            ),
            Self::FewWindows { windows } => {
                write!(f, "{windows} windows are complete, 20 are needed: look for gaps and flags")
            }
            Self::BiasFollowsBoard { slope: [slope, sigma] } => write!(
                f,
                "{} ± {} m/s² per °C of the board do not depend on the input; a document has no key for this, and it \
                 is not corrected",
                short(*slope),
                short(*sigma)
            ),
            Self::MadeWorse { axis } => write!(
                f,
                "the output along {} would become worse: check --pitch and --roll",
                AXES.get(*axis).copied().unwrap_or_default()
            ),
            Self::AxisMoved { deg_c, logs: [before, after], turn: [turn, sigma] } => write!(
                f,
                "its axis turned by {turn:.1} ± {sigma:.1}″ at {} °C between {before} and {after}: a polynomial over \
                 temperature cannot express this hysteresis. Include it in the budget with --hysteresis {turn:.0}",
                fixed(*deg_c, 1)
            ),
        }
    }
}
