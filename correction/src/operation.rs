//! The states of a unit (models §7) and what may follow what.
//!
//! ```text
//!               self-test ⇄ standby ⇄ pre-launch calibration
//!                              ⇅
//!      running with mode reversal ⇄ running without
//! ```
//!
//! Increments go out in the two running states only; elsewhere the ticks are corrected and watched, held back, and
//! announced as missing by the first output afterwards. Self-test and pre-launch calibration begin in standby and end there,
//! by themselves or by [`Command::Abort`].

mod self_test;

use alloc::string::ToString;
use alloc::vec::Vec;
use core::fmt;

use serde::{Deserialize, Serialize};
use thiserror::Error;

pub use self_test::{
    CheckItem, CheckResult, HealthReading, SelfTest, SelfTestCounter, SelfTestParts, SelfTestReport,
    SelfTestVoltage,
};

use crate::earth::Place;
use crate::prelaunch::{PreLaunchError, PreLaunchSettings};

/// What a unit is doing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
pub enum State {
    /// Nothing goes out.
    #[serde(rename = "standby")]
    Standby,
    /// The instrument is looked over; nothing goes out.
    #[serde(rename = "self-test")]
    SelfTest,
    /// C0 and B0 are determined at rest; nothing goes out.
    #[serde(rename = "pre-launch calibration")]
    PreLaunchCalibration,
    /// Corrected increments go out; the producer reverses the lasing mode.
    #[serde(rename = "running with mode reversal")]
    RunningWithReversal,
    /// Corrected increments go out; the lasing mode is to stay as it is.
    #[default]
    #[serde(rename = "running without mode reversal")]
    RunningWithoutReversal,
}

impl State {
    /// All of them.
    pub const ALL: [Self; 5] = [
        Self::Standby,
        Self::SelfTest,
        Self::PreLaunchCalibration,
        Self::RunningWithReversal,
        Self::RunningWithoutReversal,
    ];

    /// Its name in files, messages and on screens.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Standby => "standby",
            Self::SelfTest => "self-test",
            Self::PreLaunchCalibration => "pre-launch calibration",
            Self::RunningWithReversal => "running with mode reversal",
            Self::RunningWithoutReversal => "running without mode reversal",
        }
    }

    /// Whether increments go out.
    #[must_use]
    pub const fn is_running(self) -> bool {
        matches!(self, Self::RunningWithReversal | Self::RunningWithoutReversal)
    }

    /// Commands that this state takes, by name. A rollback is a change of calibration, which every state takes.
    #[must_use]
    pub const fn allowed(self) -> &'static [&'static str] {
        match self {
            Self::Standby => &["standby", "run", "self-test", "pre-launch", "rest", "end-rest", "rollback"],
            Self::SelfTest | Self::PreLaunchCalibration => &["abort", "rollback"],
            Self::RunningWithReversal | Self::RunningWithoutReversal => {
                &["run", "standby", "rest", "end-rest", "rollback"]
            }
        }
    }
}

impl fmt::Display for State {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// What a unit is told to do; it takes effect at the next tick.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum Command {
    /// Hold everything back.
    Standby,
    /// Look the instrument over.
    SelfTest,
    /// Determine C0 and B0 at rest.
    PreLaunch(PreLaunchSettings),
    /// End self-test or pre-launch calibration; nothing has changed.
    Abort,
    /// Give increments out; `None`: with mode reversal where the calibration has it.
    Run {
        /// Whether the producer reverses the lasing mode.
        reversal: Option<bool>,
    },
    /// The unit stands still at a place: its own readings feed the drift estimator.
    Rest(Place),
    /// It no longer does.
    EndRest,
}

impl Command {
    /// Its name in messages.
    #[must_use]
    pub const fn name(&self) -> &'static str {
        match self {
            Self::Standby => "standby",
            Self::SelfTest => "self-test",
            Self::PreLaunch(_) => "pre-launch",
            Self::Abort => "abort",
            Self::Run { .. } => "run",
            Self::Rest(_) => "rest",
            Self::EndRest => "end-rest",
        }
    }
}

/// Why a command was refused; the state is as before.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum Refusal {
    /// The state does not take it.
    #[error("{command} is not possible in state {state}; possible now: {}", state.allowed().join(", "))]
    State {
        /// The state.
        state: State,
        /// The command.
        command: &'static str,
    },
    /// It needs a calibration.
    #[error("{command} needs a calibration, and none is in force: give the unit one first")]
    Uncalibrated {
        /// The command.
        command: &'static str,
    },
    /// The calibration knows no mode reversal.
    #[error(
        "the calibration in force has no [mode_reversal]: run without, or swap to a document that has it"
    )]
    NoReversal,
    /// The calibration has no parameters for the drift estimator.
    #[error("no gyro of the calibration in force has a [gyro.sensor.drift]: there is no drift estimator")]
    NoDrift,
    /// Settings of the pre-launch calibration are wrong.
    #[error("{}", .0.iter().map(ToString::to_string).collect::<Vec<_>>().join("; "))]
    PreLaunch(Vec<PreLaunchError>),
}
