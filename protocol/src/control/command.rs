//! Commands to a unit, and the answer.

use isotherm_correction::operation::State;
use serde::{Deserialize, Serialize};

use super::swap::SwapReply;
use super::{MAX_BY, is_by};
use crate::escape::clipped;

/// What of an error of JSON is shown, in characters.
const LONGEST_SHOWN: usize = 300;

/// A command and who gives it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CommandOrder {
    /// Who asks, for the audit file: at most 64 characters.
    #[serde(default)]
    pub by: String,
    /// What is to be done.
    #[serde(flatten)]
    pub order: Order,
}

impl CommandOrder {
    /// Reads what a query carries.
    ///
    /// # Errors
    /// What is wrong with it, in words.
    pub fn read(json: &[u8]) -> Result<Self, String> {
        // It repeats what it does not understand.
        let unreadable = |error: serde_json::Error| {
            format!("the command cannot be read: {}", clipped(&error.to_string(), LONGEST_SHOWN))
        };
        let value: serde_json::Value = serde_json::from_slice(json).map_err(unreadable)?;
        // A number would be taken for the place of a command in the list of all.
        if !value.get("command").is_some_and(serde_json::Value::is_string) {
            return Err("the command cannot be read: \"command\" must be the name of a command".to_owned());
        }
        let order: Self = serde_json::from_value(value).map_err(unreadable)?;
        if !is_by(&order.by) {
            return Err(format!(
                "by must have at most {MAX_BY} characters, none of them a control character"
            ));
        }
        Ok(order)
    }
}

/// What a unit can be told to do (models §7).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "command", rename_all = "kebab-case")]
pub enum Order {
    /// Publish nothing until further notice; ticks are announced as missing afterwards.
    Standby,
    /// Test the instrument; at most 15 s, from standby.
    SelfTest,
    /// Determine C0 and B0 of each gyro at rest, from standby.
    PreLaunch(PreLaunchOrder),
    /// End self-test or pre-launch calibration; nothing has changed.
    Abort,
    /// Publish corrected increments.
    Run {
        /// Whether the lasing mode is reversed; left out: as the calibration has it.
        #[serde(default)]
        reversal: Option<bool>,
    },
    /// The unit is at rest: feed the drift estimator.
    Rest(PlaceOrder),
    /// The unit is no longer at rest.
    EndRest,
    /// Go back to the calibration before this one, or to a stated revision.
    Rollback {
        /// Revision counter to go back to.
        #[serde(default)]
        revision: Option<u64>,
        /// Only say what would happen.
        #[serde(default)]
        dry_run: bool,
    },
    /// Know nothing more of the unit: no calibration, no history to go back to, no place among the units. Its revision numbers are
    /// not given again.
    Forget,
}

/// Where the unit stands and how.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct PlaceOrder {
    /// Geodetic latitude (°, −90…90).
    pub latitude_deg: f64,
    /// Heading of the case's x axis from north (°).
    pub heading_deg: f64,
    /// Pitch and roll of the case (°); left out: levelled from the accelerometers.
    #[serde(default)]
    pub pitch_roll_deg: Option<[f64; 2]>,
}

/// A pre-launch calibration; what is left out is as configured.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct PreLaunchOrder {
    /// Where the unit stands and how.
    #[serde(flatten)]
    pub place: PlaceOrder,
    /// How long to accumulate (s, 60…7200).
    #[serde(default)]
    pub duration_s: Option<f64>,
    /// Put the result in force at once; otherwise it is only stored and told.
    #[serde(default = "yes")]
    pub install: bool,
}

fn yes() -> bool {
    true
}

/// The answer to a command.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CommandReply {
    /// Whether it was carried out, or begun.
    pub accepted: bool,
    /// Serial of the unit.
    pub unit: String,
    /// The unit's state afterwards.
    pub state: State,
    /// Why it was refused.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub reason: Option<String>,
    /// Commands that the unit would take now.
    pub allowed: Vec<String>,
    /// What became of a rollback.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub swap: Option<SwapReply>,
}
