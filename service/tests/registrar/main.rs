//! Swaps and commands on a running service: whichever way they come in, over real sessions and folders.

#![expect(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a test may panic, its helpers included"
)]

mod at_start;
mod bus;
mod command;
mod console;
mod folder;
mod instance;
mod losses;
mod policy;
mod pre_launch;
mod restart;
mod said;
mod schedule;
mod stand;
