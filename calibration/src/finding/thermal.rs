//! What was found of a fit over temperature and of the runs that judge it.

use thiserror::Error;

use crate::report::{counted, fixed, short, six};

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
    /// A judging run says nothing of some axes: its temperature is not known, or hardly moves.
    #[error(
        "{run}: {} not judged on it: {}, {needed} °C are needed for judging; use a run through the chamber with its thermometers",
        .axes.join(", "),
        .range_deg_c.map_or("it has no temperature readings".to_owned(), |range| format!("the temperature moves by {} °C", fixed(range, 1)))
    )]
    NotJudged { run: String, axes: Vec<String>, range_deg_c: Option<f64>, needed: f64 },
    /// Two logs have the same readings, whatever their files are called.
    #[error("{log}: its readings are those of {other}: {}", if *.judges { "the judge must be another run" } else { "each log counts once" })]
    SameReadings { log: String, other: String, judges: bool },
    /// Readings of a run at rest are far from all others: how many, the first (in this unit, at this time in s), in how many windows, and
    /// whether they can be left out.
    #[error(
        "{} far from all others, the first {} {measure} at {at_s:.2} s: {}",
        counted(*.count, "reading is", "readings are"), short(*.value),
        if *.single {
            format!("left out with {}; find their cause", counted(*.windows, "window", "windows"))
        } else {
            format!(
                "in {} they would change the fit: did the unit turn, or was it knocked? Cut the log to the part at rest with \
                 --start and --duration",
                counted(*.windows, "window", "windows")
            )
        }
    )]
    Far { count: usize, value: f64, measure: &'static str, at_s: f64, windows: usize, single: bool },
    /// A thermometer reads the same for the larger part of a run: its raw reading, and from when to when (s).
    #[error(
        "temperature channel {channel:?} reads exactly {} from {:.0} s to {:.0} s, most of the log: the thermometer is frozen, or the \
         mapping names the wrong column; cut the log with --start and --duration",
        six(*.value), .window_s[0], .window_s[1]
    )]
    Frozen { channel: String, value: f64, window_s: [f64; 2] },
}
