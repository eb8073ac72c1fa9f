//! `isotherm-calibrate`: logs of a unit in, calibration documents and reports out.
//!
//! What this crate refuses to do: evaluate a correction by any other code than the service's. What a fit has as its
//! columns, and what it states as its residuals, comes out of `isotherm-correction` itself.
//!
//! | module | holds |
//! |---|---|
//! | [`runs`] | what a log has of one unit, to be corrected again and again; as columns, raw and corrected |
//! | [`axes`] | case axes, and what sensors are called |
//! | [`lsq`] | least squares: coefficients, covariance, cross-validation |
//! | [`numbers`] | counts, ends, lengths; mean, rms, deviation; middle and scatter of numbers among which some may be wrong |
//! | [`finding`] | what can be wrong or is worth telling, and its words |
//! | [`report`] | what a fit says: verdicts, before and after, coefficients; text, JSON and page |
//! | [`document`] | a document on its way to a file; compared, merged, shown |
//! | [`fits`] | a fit for each command |
//! | [`validate`] | a document judged on other logs |
//! | [`error`], [`cli`] | what can go wrong; the command line |

#![expect(clippy::must_use_candidate, clippy::return_self_not_must_use, reason = "a library of one program")]

pub mod axes;
pub mod cli;
mod csv;
pub mod document;
pub mod error;
pub mod finding;
pub mod fits;
#[cfg(test)]
mod fixture;
mod limits;
pub mod lsq;
pub mod numbers;
pub mod report;
pub mod runs;
pub mod validate;
