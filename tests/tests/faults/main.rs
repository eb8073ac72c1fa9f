//! Faults of every kind, and an account that adds up in each: every tick that was sent has been received, or announced as missing,
//! or is found lost behind the service, by counters.
//!
//! Beside these: a crash at any moment (`operators`), broken input (`system`), documents that are none (`operators`), a player that
//! stands still and subscribers that hang (`logs`, `receipts`), a state folder that is damaged, removed or full (the service's own
//! tests and docs/operations.md), one of two services (`operators`).

#![expect(clippy::expect_used, clippy::unwrap_used, reason = "what does not hold ends the test")]

mod disturb;
mod line;
mod links;
mod machine;
mod peers;
