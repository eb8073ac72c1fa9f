//! Logs of inertial units, and their correction offline.
//!
//! What this crate refuses to do: open a session, correct by any other state machine than the service's, or lose a row or
//! a message of a log without counting it.
//!
//! | module | holds |
//! |---|---|
//! | [`mapping`] | which column of a text log is what |
//! | [`text`] | text logs as events in time order |
//! | [`recording`] | MCAP files with every message as it was on the bus |
//! | [`message`] | one message and its topic |
//! | [`source`] | a log of either kind as messages |
//! | [`progress`] | how far a log has been read |
//! | [`offline`] | a log through the service's state machine |
//! | [`file`] | small files read whole, outputs that must not fall on inputs |
//! | [`error`] | what can go wrong |

pub mod error;
pub mod file;
pub mod mapping;
pub mod message;
pub mod offline;
pub mod progress;
pub mod recording;
pub mod source;
pub mod text;
