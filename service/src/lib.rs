//! The service: corrects the raw increments of inertial units in a stream, over Zenoh.
//!
//! The asynchronous edge of the project: sessions, threads, files, commands and signals are here, and nothing that
//! decides a corrected value. Every unit's frames go through [`isotherm_protocol::stream::UnitStream`], which the
//! offline tools use too.
//!
//! | module | holds |
//! |---|---|
//! | [`serve`] | the command that runs it |
//! | [`config`] | the service configuration, checked |
//! | [`service`] | start and stop of the whole |
//! | [`receive`] | Zenoh → unit → Zenoh: what the receive threads do |
//! | [`control`] | documents, swaps and commands, and what is remembered of them |
//! | [`observe`] | status, metrics, totals |
//! | `pair` | other instances for the same stream |
//! | `supervisor` | what systemd is told |
//! | [`check`] | validation of calibration documents and configurations |
//! | [`signing`] | keys, signed documents and who is trusted, as files |
//! | [`logging`] | the log, for other programs too |
//!
//! How a message travels: Zenoh's receive thread calls [`receive::intake::Intake::receive`], which finds the unit, locks it, has
//! it corrected and publishes what came out, all before it returns. A second thread, the status publisher, does what only a clock
//! can: it flushes the tail of a stream that has stopped, and publishes status. A third one, the swap manager, takes
//! calibrations and commands, whoever gives them, writes them down and hands them to the units.

pub mod check;
pub mod config;
pub mod control;
mod error;
pub mod logging;
pub mod observe;
mod pair;
pub mod receive;
pub mod serve;
pub mod service;
pub mod signing;
mod supervisor;

pub use config::Settings;
pub use error::ServiceError;
pub use observe::totals::{Totals, UnitTotals};
pub use receive::pulse::Stuck;
pub use service::{RunningService, start, start_with};
