//! A unit tumbled by hand: accelerometers from |f| = g, gyros against the accelerometers (models §9).
//!
//! | module | holds |
//! |---|---|
//! | [`accel`], [`gyro`], [`acceleration`] | the fits: |f| = g, turns, what the gyros read at rest |
//! | [`mod@fit`] | from a run to both, and every reason not to |
//! | [`document`], [`report`] | as a document; in words, with what the service leaves |

pub mod accel;
pub mod acceleration;
pub mod document;
pub mod fit;
pub mod gyro;
pub mod report;
