//! System tests on real Zenoh sessions, one binary: linking Zenoh once is enough.

#![expect(
    clippy::expect_used,
    clippy::unwrap_used,
    clippy::panic,
    reason = "what does not hold ends the test"
)]

mod i7_broken_input_over_zenoh;
mod i8_clean_stop;
mod online_equals_offline;
mod python_subscriber;
mod real_logs;
mod watchdog;
