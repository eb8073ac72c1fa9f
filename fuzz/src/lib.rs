//! Everything that reads what others have written, given anything, must do what it promises.
//!
//! Each function takes one input and panics where a property does not hold. The targets in `targets/` give them to libFuzzer
//! (`fuzz/run`); `tests/seeds.rs` runs them over the seeds. A property is stated by public functions alone: what is taken is
//! written and read back as the same, what is refused is refused in few words, what comes in is given, announced or counted.
#![expect(
    clippy::missing_panics_doc,
    clippy::expect_used,
    reason = "a property that does not hold is a panic"
)]

#[cfg(feature = "service")]
pub mod configuration;
mod cursor;
pub mod frames;
pub mod journal;
#[cfg(feature = "logs")]
pub mod logs;
pub mod operators;
mod said;
pub mod stream;
pub mod texts;
