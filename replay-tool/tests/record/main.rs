//! Recording from the bus, and recovering what a recorder has left behind.

#![expect(
    clippy::unwrap_used,
    clippy::expect_used,
    reason = "helpers of tests end the test where something is not as it must be"
)]

mod bus;
mod common;
mod memory;
mod recover;
