//! The invariants of the core, each in a module named after it, and the laws of the correction. No session, no file.

#![expect(
    clippy::expect_used,
    clippy::unwrap_used,
    clippy::panic,
    reason = "what does not hold ends the test"
)]

mod delays;
mod i1_each_tick_once;
mod i2_memory;
mod i2_timing_does_not_matter;
mod i3_schedule;
mod i3_swap;
mod i5_mode_switch;
mod i7_broken_input;
mod laws;
mod states;
mod terms;
