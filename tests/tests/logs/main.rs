//! Logs of a running service, on real Zenoh sessions.

#![expect(
    clippy::expect_used,
    clippy::unwrap_used,
    clippy::panic,
    reason = "what does not hold ends the test"
)]

mod examples;
mod play;
mod recorder_killed;
mod session;
