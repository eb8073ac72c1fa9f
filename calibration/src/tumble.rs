//! A unit tumbled by hand: accelerometers from |f| = g, gyros against the accelerometers (models §9).
//!
//! | module | holds |
//! |---|---|
//! | [`accel`], [`gyro`], [`acceleration`] | the fits: |f| = g, turns, what the gyros read at rest |
//! | [`analysis`] | from a run to both, and every reason not to |
//! | [`document`], [`report`] | as a document; in words, with what the service leaves |

pub mod accel;
pub mod acceleration;
pub mod analysis;
pub mod document;
pub mod gyro;
pub mod report;
