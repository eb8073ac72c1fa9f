//! Noise and drift of a static log [002; models §7].
//!
//! | file | holds |
//! |---|---|
//! | [`columns`] | the log as columns of one kind: raw, or corrected as the service does it |
//! | [`pieces`] | gaps, pieces without gaps, what is refused |
//! | [`slow`] | the slow part: means over bins, its autocorrelation |
//! | [`markov`] | σ and correlation time by restricted maximum likelihood, with trend and daily lines beside it |
//! | [`trend`] | trend of first and second order; "fit 21 h, extrapolate the rest" |
//! | [`mod@fit`] | all of it for one sensor, and for all on both processor cores |
//! | [`document`] | what the estimator is to expect: `[gyro.sensor.drift]`, as text and put into a document |
//! | [`allan`], [`spectrum`] | Allan variances and what they show; power spectrum |
//! | [`report`], [`page`] | verdicts, tables, JSON; charts |

pub mod allan;
pub mod columns;
pub mod document;
pub mod fit;
pub mod markov;
pub mod page;
pub mod pieces;
pub mod report;
pub mod slow;
pub mod spectrum;
pub mod trend;

/// Seconds of an hour.
pub const HOUR_S: f64 = 3600.0;
/// °/h in one rad/s.
pub const DEG_PER_H_IN_RAD_PER_S: f64 = 180.0 / std::f64::consts::PI * 3600.0;
