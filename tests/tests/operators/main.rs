//! What operators do to a running service, on real Zenoh sessions: swaps, states, broken documents, crashes, recipes.

#![expect(
    clippy::expect_used,
    clippy::unwrap_used,
    clippy::panic,
    reason = "what does not hold ends the test"
)]

mod access;
mod broken_documents;
mod documents;
mod kill_9;
mod pair;
mod recipes;
mod shares;
mod stand;
mod states;
mod swaps_1000;
