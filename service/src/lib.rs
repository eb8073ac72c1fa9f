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
//! | [`calibrations`] | the calibration documents of a folder |
//! | [`service`] | start and stop of the whole |
//! | [`intake`] | what the receive threads do |
//! | [`mod@unit`] | one unit's part |
//! | [`fault`], [`latency`], [`totals`] | what is counted |
//! | [`check`] | validation of calibration documents and configurations |
//! | [`report`], [`demo`] | the demonstration and its report |
//!
//! How a message travels: Zenoh's receive thread calls [`intake::Intake::receive`], which finds the unit, locks it, has
//! it corrected and publishes what came out, all before it returns. A second thread, the keeper, does what only a clock
//! can: it flushes the tail of a stream that has stopped, and publishes status.

pub mod calibrations;
pub mod check;
pub mod cli;
pub mod config;
pub mod demo;
mod error;
pub mod exit;
pub mod fault;
pub mod intake;
mod keeper;
pub mod latency;
mod logging;
pub mod report;
mod serve;
pub mod service;
mod text;
pub mod totals;
pub mod unit;
mod words;

pub use config::Settings;
pub use error::ServiceError;
pub use service::{RunningService, start, start_with};
pub use totals::{Totals, UnitTotals};
