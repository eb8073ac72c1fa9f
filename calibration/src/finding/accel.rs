//! What was found of accelerometers: of the ratio of their board, and of axes before and after a thermal cycle.

use thiserror::Error;

use crate::axes::AXES;
use crate::report::{fixed, short};

/// What was found of an accelerometer. Temperatures are in °C, forces in m/s², angles in ″.
#[derive(Debug, Clone, PartialEq, Error)]
#[expect(missing_docs, reason = "the text of each kind says what its numbers are")]
pub enum AccelKind {
    /// The document names no channel of the board.
    #[error(
        "the document has no board_channel for it: name the temperature channel of its electronics there (--calibration)"
    )]
    NoBoardChannel,
    /// A run has no readings of the board's temperature, or of the accelerometer's.
    #[error("a run has no readings of temperature channel {channel:?}: check the mapping")]
    NoReadings { channel: String },
    /// The board's temperature does not change enough: lowest and highest, and the least change.
    #[error(
        "the board's channel {channel:?} stays between {} and {} °C, a change of {needed} °C is needed: run the chamber",
        fixed(.range[0], 1), fixed(.range[1], 1)
    )]
    BoardStays { channel: String, range: [f64; 2], needed: f64 },
    /// The input does not differ enough between the runs: largest difference, and least one.
    #[error(
        "its runs spread its input by {} m/s², at least {} are needed: add a cycle in the opposite position (--pitch, \
         --roll for each log)",
        short(.spread[0]), short(.spread[1])
    )]
    SameInput { spread: [f64; 2] },
    /// The runs of different input do not share enough of the board's temperatures: what they share, and least.
    #[error(
        "the runs of different input share {} °C of the board's temperature, at least {} are needed: take every position \
         through the same cycle",
        fixed(.shared[0].max(0.0), 1), .shared[1]
    )]
    OtherTemperatures { shared: [f64; 2] },
    /// The temperature of the board (the first channel) goes with that of the accelerometer: what it has of its own (rms), and least.
    #[error(
        "the board's channel {:?} goes with the accelerometer's {:?}: it has {} °C rms of its own, {} are needed to \
         separate the board's ratio from the scale factor. Keep the accelerometers on their thermostat, or warm the board \
         alone",
        .channels[0], .channels[1], short(.own[0]), .own[1]
    )]
    BoardFollows { channels: [String; 2], own: [f64; 2] },
    /// Too few windows.
    #[error("{windows} windows are complete, 20 are needed: look for gaps and flags")]
    FewWindows { windows: usize },
    /// Part of what follows the board does not go with the input: its slope (m/s² per °C), and standard error.
    #[error(
        "{} ± {} m/s² per °C of the board do not depend on the input; a document has no key for this, and it is not \
         corrected",
        short(.slope[0]), short(.slope[1])
    )]
    BiasFollowsBoard { slope: [f64; 2] },
    /// With it, what is left along a case axis, 0…2, grows.
    #[error("the output along {} would become worse: check --pitch and --roll", AXES[*.axis])]
    MadeWorse { axis: usize },
    /// An axis did not come back after a thermal cycle: temperature of the positions, logs before and after, its turn and standard error.
    #[error(
        "its axis turned by {:.1} ± {:.1}″ at {} °C between {} and {}: a polynomial over temperature cannot express this \
         hysteresis. Include it in the budget with --hysteresis {:.0}",
        .turn[0], .turn[1], fixed(*.deg_c, 1), .logs[0], .logs[1], .turn[0]
    )]
    AxisMoved { deg_c: f64, logs: [String; 2], turn: [f64; 2] },
}
