//! A unit tumbled by hand: accelerometers from |f| = g, gyros against the accelerometers (models §9).
//!
//! | module | holds |
//! |---|---|
//! | [`accel`], [`gyro`] | the two fits |
//! | [`analysis`] | from a run to both, and every reason not to |

pub mod accel;
pub mod analysis;
pub mod gyro;
