//! `isotherm-calibrate`: logs of a unit in, calibration documents and reports out.
//!
//! What this crate refuses to do: evaluate a correction by any other code than the service's. What a fit has as its
//! columns, and what it states as its residuals, comes out of `isotherm-correction` itself.
//!
//! | module | holds |
//! |---|---|
//! | [`runs`] | what a log has of one unit, to be corrected again and again; as columns, raw and corrected |
//! | [`written`], [`provenance`] | a document: on its way to a file, where its numbers come from |
//! | [`drift`], [`allan`], [`spectrum`] | noise and drift of a static log |
//! | [`report`] | what a fit says: verdicts, before and after, coefficients; text, JSON and page |
//! | [`impact`] | what a drift that is left means for navigation |
//! | [`diff`] | what has changed between two documents |
//! | [`merge`] | parts of a calibration in one document |
//! | [`show`] | a document in words and curves |
//! | [`lsq`] | least squares: coefficients, covariance, cross-validation |
//! | [`robust`], [`size`] | middle and scatter of numbers among which some may be wrong; mean, rms, deviation |
//! | [`swapped`] | columns that look swapped |
//! | [`validate`] | a document judged on other logs |
//! | [`positions`], [`tumble`] | accelerometers on a stand; a unit tumbled by hand |
//! | [`board`] | ratio of the accelerometers' board from two-position cycles |
//! | [`modes`] | drift polynomials and switch parameters of a mode-reversed laser gyro |
//! | [`rates`] | scale factor, asymmetry, linearity and axes from a rate table |
//! | [`thermal`] | bias over temperature from runs at rest |
//! | [`finding`] | what can be wrong or is worth telling, and its words |
//! | [`error`], [`cli`] | what can go wrong; the command line |

pub mod allan;
pub mod board;
pub mod cli;
pub mod diff;
pub mod drift;
pub mod error;
pub mod finding;
#[cfg(test)]
mod fixture;
pub mod impact;
pub mod lsq;
pub mod merge;
pub mod modes;
pub mod positions;
pub mod provenance;
pub mod rates;
pub mod report;
pub mod robust;
pub mod runs;
pub mod show;
pub mod size;
pub mod spectrum;
pub mod swapped;
pub mod thermal;
pub mod tumble;
pub mod validate;
pub mod written;
