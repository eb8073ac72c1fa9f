//! `isotherm-replay`: plays recorded logs into the service, corrects them offline, simulates new ones.
//!
//! What this crate refuses to do: correct by any other state machine than the service's, or lose a row of a log
//! without counting it.
//!
//! | module | holds |
//! |---|---|
//! | [`mapping`] | which column of a text log is what |
//! | [`log`] | text logs as events in time order |
//! | [`play`], [`pace`] | a log to the raw topics, at a speed |
//! | [`offline`], [`output`], [`summary`] | a log through the service's state machine, its output and figures |
//! | [`simulated`] | a scenario as a text log |
//! | [`progress`] | the progress bar |
//! | [`error`], [`cli`] | what can go wrong; the command line |

pub mod cli;
pub mod error;
mod file;
pub mod log;
pub mod mapping;
pub mod offline;
pub mod output;
pub mod pace;
pub mod play;
pub mod progress;
pub mod simulated;
pub mod summary;
