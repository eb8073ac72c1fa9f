//! What operators ask of a running unit and what they are told: text and JSON, so that any tool can speak it.
//!
//! | key | query carries | reply |
//! |---|---|---|
//! | `imu/{unit}/calibration` | nothing | the active document's text |
//! | `imu/{unit}/calibration?by=ann;slew_s=2` | a calibration document or overlay, TOML | [`SwapReply`] |
//! | `imu/{unit}/command` | [`CommandOrder`] | [`CommandReply`], for `rollback` a [`SwapReply`] in it |
//! | `imu/{unit}/history?limit=20` | nothing | a list of [`crate::history::AuditEntry`] |
//!
//! A `put` on `imu/{unit}/calibration` takes the same way; its answer is the unit's status.

mod command;
mod swap;

pub use command::{CommandOrder, CommandReply, Order, PlaceOrder, PreLaunchOrder};
pub use swap::{
    CorrectionChange, Difference, DocumentChange, OptionsError, Schedule, SwapOptions, SwapOutcome, SwapReply,
};

/// Longest name of an operator or program, in characters.
pub const MAX_BY: usize = 64;

/// Whether a text can say who asks.
pub(crate) fn is_by(text: &str) -> bool {
    text.chars().count() <= MAX_BY && !text.contains(char::is_control)
}
