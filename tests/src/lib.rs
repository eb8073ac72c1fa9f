//! Fixtures that the system tests share: calibrations, streams and ways to drive a unit with them.
//!
//! The tests themselves are in `tests/tests/`.

#![expect(
    clippy::expect_used,
    clippy::panic,
    reason = "a fixture that does not hold ends the test that asked for it"
)]

pub mod bench;
pub mod calibrations;
pub mod data;
pub mod dice;
pub mod drive;
pub mod judged;
pub mod lives;
pub mod logs;
pub mod operator;
pub mod pair;
pub mod player;
pub mod process;
pub mod proxy;
pub mod script;
pub mod simulated;
pub mod slope;
pub mod streams;
pub mod yardstick;
