//! Pre-launch calibration on simulated units: what is found, what is refused, and that nothing else changes.
#![expect(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

mod bench;
mod given_up;
mod recovery;
mod refusals;
