//! The calibration tool as a whole: one test program, because linking one takes as long as running most of what is in it.
//!
//! | file | holds |
//! |---|---|
//! | `thermal` | what the methods reach on simulated coils and the real chamber log, bad input, the fit against the service |
//! | `positions`, `positions_command`, `positions_damaged` | a simulated stand, from the log to the document; damaged logs |
//! | `tumble`, `tumble_damaged` | a unit put down by hand, real and simulated, sound and damaged |
//! | `modes_rates` | `modes` and `rates` as their users run them |
//! | `drift`, `impact`, `logged` | noise and drift, what they mean for navigation, and logs in every form |
//! | `rest` | `drift` and `impact` on logs that are none of a unit at rest |
//! | `agreement` | what reports state is what `isotherm-replay correct` gives with the written document, command by command |
//! | `bad_logs` | files that may not be written, logs that are cut short, empty, swapped or not judged |
//! | `two_units` | a recording of two units through every command that reads logs |
//! | `validate`, `documents` | documents judged, shown, compared and merged |
//! | `skewed_six` | units of six sensors through all of them |
//! | `pages` | pages to be looked at |
//! | `command` | how the program is called |
//! | `stand`, `drift_generator`, `simulated_logs` | what the logs are made with |

#![expect(
    clippy::unwrap_used,
    clippy::cast_precision_loss,
    clippy::cast_possible_truncation,
    clippy::cast_possible_wrap,
    reason = "a test ends where something is not as it must be, and its counts are small"
)]
#![expect(clippy::float_cmp, reason = "a document states what was printed")]

mod agreement;
mod bad_logs;
mod board;
mod command;
mod documents;
mod drift;
mod drift_generator;
mod impact;
mod logged;
mod modes_rates;
mod pages;
mod positions;
mod positions_channels;
mod positions_command;
mod positions_damaged;
mod rates_refused;
mod rest;
mod simulated_logs;
mod skewed_six;
mod stand;
mod thermal;
mod tumble;
mod tumble_damaged;
mod two_units;
mod validate;
