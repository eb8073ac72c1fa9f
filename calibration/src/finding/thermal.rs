//! What was found of a fit over temperature and of the runs that judge it.

use thiserror::Error;

use crate::report::short;

/// What was found of a thermal fit.
#[derive(Debug, Clone, PartialEq, Error)]
#[expect(missing_docs, reason = "the text of each kind says what its numbers are")]
pub enum ThermalKind {
    /// The base document leaves less of an axis on the judging runs: rms with it and with the new terms, and their unit.
    #[error(
        "on the judging runs the base document leaves {} {measure} rms, the new terms {}: its terms are kept. Fit runs over all \
         temperatures of the judging ones, or judge on a run that the base was not made from",
        short(.left[0]), short(.left[1])
    )]
    BeforeIsBetter { left: [f64; 2], measure: &'static str },
}
