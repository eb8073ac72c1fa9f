//! isotherm: corrects the raw increments of inertial units in a stream, over Zenoh.
//!
//! The asynchronous edge of the project: sessions, threads, files, commands and signals are here, and nothing that
//! decides a corrected value. Every unit's frames go through [`isotherm_protocol::stream::UnitStream`], which the
//! offline tools use too.
//!
//! | module | holds |
//! |---|---|
//! | [`cli`] | the commands |
//! | [`config`] | the service configuration, checked |
//! | [`calibrations`] | what each unit is to correct with |
//! | [`kept`] | texts that are kept for long and read seldom |
//! | [`watch`] | the calibration folder as it changes |
//! | [`service`] | start and stop of the whole |
//! | [`intake`] | what the receive threads do |
//! | [`mod@unit`] | one unit's part |
//! | `registrar` | the one path of every swap, and commands |
//! | `pair` | other instances for the same stream |
//! | `keeper` | status, and what only a clock can do |
//! | `metrics` | metrics and health over HTTP |
//! | `pulse` | whether the receive path is alive |
//! | `supervisor` | what systemd is told |
//! | `web` | the console in the browser, on the same server |
//! | [`store`] | what is remembered over a restart: audit file, documents |
//! | [`fault`], [`latency`], [`totals`] | what is counted |
//! | [`console`] | the operator's side: commands that talk to a running service |
//! | [`check`] | validation of calibration documents and configurations |
//! | [`signing`] | keys, signed documents and who is trusted, as files |
//! | [`logging`], [`words`] | what is said on stderr and stdout, for other programs too |
//! | [`demo`] | the demonstration and its report |
//!
//! How a message travels: Zenoh's receive thread calls [`intake::Intake::receive`], which finds the unit, locks it, has
//! it corrected and publishes what came out, all before it returns. A second thread, the keeper, does what only a clock
//! can: it flushes the tail of a stream that has stopped, and publishes status. A third one, the registrar, takes
//! calibrations and commands, whoever gives them, writes them down and hands them to the units.

pub mod calibrations;
pub mod check;
pub mod cli;
pub mod config;
pub mod console;
pub mod demo;
mod error;
pub mod exit;
pub mod fault;
pub mod intake;
mod keeper;
pub mod kept;
pub mod latency;
pub mod logging;
mod metrics;
mod pair;
mod pulse;
mod registrar;
mod serve;
pub mod service;
pub mod signing;
pub mod store;
mod supervisor;
mod text;
pub mod totals;
pub mod unit;
pub mod watch;
pub mod web;
pub mod words;

pub use config::Settings;
pub use error::ServiceError;
pub use pulse::Stuck;
pub use service::{RunningService, start, start_with};
pub use totals::{Totals, UnitTotals};
