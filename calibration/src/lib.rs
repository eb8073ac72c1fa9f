//! `isotherm-calibrate`: logs of a unit in, calibration documents and reports out.
//!
//! What this crate refuses to do: evaluate a correction by any other code than the service's. What a fit has as its
//! columns, and what it states as its residuals, comes out of `isotherm-correction` itself.
//!
//! | module | holds |
//! |---|---|
//! | [`series`] | a log as columns: ticks, readings, temperatures of one unit |
//! | [`provenance`] | where the numbers of a document come from |
//! | [`drift`], [`allan`], [`spectrum`] | noise and drift of a static log |
//! | [`impact`] | what a drift that is left means for navigation |
//! | [`error`], [`cli`] | what can go wrong; the command line |

pub mod allan;
pub mod cli;
pub mod drift;
pub mod error;
pub mod impact;
pub mod provenance;
pub mod series;
pub mod spectrum;
