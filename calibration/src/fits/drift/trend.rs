//! Trend of the slow part, and how far it can be trusted beyond the log: "fit 21 h, extrapolate the rest" (002).

use nalgebra::{DMatrix, DVector};
use serde::Serialize;

use super::slow::Slow;
use crate::lsq::linear::{self, SINGULAR, Weak};
use crate::numbers::{ends, mean};

/// Hours that 002 fits: how long its system is calibrated.
pub const FIT_H: f64 = 21.0;
/// Share of the log that is fitted where it is not long enough for that: 21 h of 72 h.
const FIT_SHARE: f64 = 21.0 / 72.0;
/// Fewest bins of either part.
const FEWEST: usize = 8;
/// Share of the extrapolated bins whose mean stands for the end.
const END_SHARE: usize = 20;

/// What a straight line through the beginning says of the rest.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Extrapolation {
    /// How much was fitted (h).
    pub fit_h: f64,
    /// How much was extrapolated (h).
    pub extrapolated_h: f64,
    /// Slope of the line (readings per h).
    pub slope_per_h: f64,
    /// Value of the line at the log's beginning.
    pub start: f64,
    /// Slow part less line at the end.
    pub error_at_end: f64,
    /// Root mean square of that over the extrapolated part.
    pub error_rms: f64,
    /// Largest of it.
    pub error_largest: f64,
    /// Error at the end over the range of the slow part.
    pub share_of_range: f64,
    /// The same where the constant of the fit is kept and the slope is left out.
    pub error_at_end_without_trend: f64,
}

impl Extrapolation {
    /// Fits the first `fit_h` hours and extrapolates; a log too short for that gives its first 29 %. `None` where that is
    /// too little too.
    pub fn of(slow: &Slow, fit_h: f64) -> Option<Self> {
        let length_h = slow.length_h();
        let fit_h = if length_h >= fit_h / 0.75 { fit_h } else { length_h * FIT_SHARE };
        let first = slow.time_h.first()? - 0.5 * slow.width_h;
        let split = slow.time_h.partition_point(|time| time - first <= fit_h);
        let (times, later) = slow.time_h.split_at_checked(split)?;
        let (means, rest) = slow.mean.split_at_checked(split)?;
        if times.len() < FEWEST || later.len() < FEWEST {
            return None;
        }
        let columns = DMatrix::from_fn(
            times.len(),
            2,
            |row, column| if column == 0 { 1.0 } else { times[row] - first },
        );
        let line =
            linear::solve(&columns, &DVector::from_column_slice(means), Weak::Refuse(SINGULAR)).ok()?;
        let (start, slope) = (line.coefficients[0], line.coefficients[1]);
        let errors: Vec<f64> =
            later.iter().zip(rest).map(|(time, mean)| mean - start - slope * (time - first)).collect();

        let last = errors.len().div_ceil(END_SHARE);
        let end = |values: &[f64]| mean(values.get(values.len() - last..).unwrap_or(values));
        let squares: Vec<f64> = errors.iter().map(|error| error * error).collect();
        let [low, high] = ends(slow.mean.iter().copied());
        let error_at_end = end(&errors);
        Some(Self {
            fit_h,
            extrapolated_h: length_h - fit_h,
            slope_per_h: slope,
            start,
            error_at_end,
            error_rms: mean(&squares).sqrt(),
            error_largest: errors.iter().fold(0.0, |largest: f64, error| largest.max(error.abs())),
            share_of_range: error_at_end.abs() / (high - low),
            error_at_end_without_trend: end(rest) - mean(means),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn slow(of: impl Fn(f64) -> f64) -> Slow {
        let time_h: Vec<f64> = (0..288).map(|k| (f64::from(k) + 0.5) * 0.25).collect();
        Slow { width_h: 0.25, mean: time_h.iter().map(|t| of(*t)).collect(), time_h }
    }

    #[test]
    fn a_line_goes_on_and_a_bend_does_not() {
        let straight = Extrapolation::of(&slow(|t| 0.1 + 0.001 * t), FIT_H).unwrap();
        assert!((straight.slope_per_h - 0.001).abs() < 1e-12 && straight.error_largest < 1e-12);
        assert!((straight.fit_h - 21.0).abs() < 1e-12 && (straight.extrapolated_h - 51.0).abs() < 1e-9);
        // From 21 h on the trend is gone: what the line adds over 51 h is the error.
        let bent = Extrapolation::of(&slow(|t| 0.001 * t.min(21.0)), FIT_H).unwrap();
        assert!((bent.error_at_end / (-0.001 * 51.0) - 1.0).abs() < 0.03, "{bent:?}");
        assert!((bent.error_at_end_without_trend - 0.0105).abs() < 1e-3);
        let short = Extrapolation::of(&slow(|t| t), 100.0).unwrap();
        assert!((short.fit_h - 21.0).abs() < 1e-9);
    }
}
