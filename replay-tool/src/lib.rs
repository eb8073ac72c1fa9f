//! `isotherm-replay`: plays recorded logs into the service, corrects them offline, simulates new ones.
//!
//! What this crate refuses to do: read a log by itself (`isotherm-log` does), or lose a message without counting it.
//!
//! | module | holds |
//! |---|---|
//! | `play`, `pace` | a log to the raw topics, at a speed |
//! | `keyboard` | keys pressed meanwhile |
//! | `record` | what is on the bus to recordings |
//! | [`simulated`] | a scenario as a text log |
//! | [`error`], [`cli`] | what can go wrong; the command line |

pub mod cli;
pub mod error;
mod keyboard;
mod pace;
mod play;
mod record;
pub mod simulated;
mod stop;
