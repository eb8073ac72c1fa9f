//! A step in readings that are otherwise steady: no drift, but a log of two states.

use crate::numbers::{SIGMA_PER_MAD, mean_if_any, median};
use crate::report::short;

/// Parts of a log whose means are compared, and the fewest ticks of one.
const PARTS: usize = 128;
pub(super) const FEWEST_TICKS: usize = 16;
/// Parts that must be there before and behind a step.
const BESIDE: usize = 4;
/// A step stands so far out of all changes (robust standard deviations), and so many times out of those near it.
const STANDS_OUT: f64 = 8.0;
const TIMES_ITS_NEIGHBOURS: f64 = 4.0;
/// Share of a step that must be left of it over the parts beside it.
const STAYS: f64 = 0.5;

/// A step from one level to another.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Step {
    /// The part that it lies in, or ends before.
    pub(crate) part: usize,
    /// Mean of the parts before it.
    pub(crate) before: f64,
    /// Mean of the parts behind it.
    pub(crate) behind: f64,
}

/// Where the means of equal parts step from one level to another and stay there.
///
/// Compared are the means of the parts before and behind each part, so that a step within a part counts whole. A slow drift, of whatever
/// kind, changes as much in the parts near by.
pub(crate) fn step(means: &[f64]) -> Option<Step> {
    let changes: Vec<f64> = means.windows(3).map(|near| (near[2] - near[0]).abs()).collect();
    let usual = SIGMA_PER_MAD * median(&changes);
    let (at, largest) = changes
        .iter()
        .enumerate()
        .filter(|(_, change)| change.is_finite())
        .max_by(|(_, a), (_, b)| a.total_cmp(b))?;
    // The change at `at` is that over the part behind it; those next to it hold a part of the same step.
    let near = |from: usize, to: usize| changes.get(from..to).unwrap_or(&[]);
    let beside = [near(at.checked_sub(BESIDE + 2)?, at - 2), near(at + 3, at + 3 + BESIDE)];
    if beside.iter().any(|near| near.len() < BESIDE) || *largest <= STANDS_OUT * usual {
        return None;
    }
    let most = beside.iter().flat_map(|near| near.iter()).copied().fold(0.0, f64::max);
    let before = mean(means.get(at + 1 - BESIDE..=at)?);
    let behind = mean(means.get(at + 2..at + 2 + BESIDE)?);
    if *largest <= TIMES_ITS_NEIGHBOURS * most || (behind - before).abs() < STAYS * largest {
        return None;
    }
    Some(Step { part: at + 1, before, behind })
}

/// Where readings, or means over windows, step from one level to another and stay there, and the place in its middle; a part is at least
/// so many.
pub(crate) fn step_in(column: &[f64], fewest: usize) -> Option<(Step, usize)> {
    let width = column.len().div_ceil(PARTS).max(fewest);
    let step = step(&column.chunks_exact(width).map(mean).collect::<Vec<f64>>())?;
    Some((step, step.part * width + width / 2))
}

/// A step in words.
pub(crate) fn words((called, measure): (&str, &str), Step { before, behind, .. }: Step, at_s: f64) -> String {
    format!(
        "{called} steps from {} to {} {measure} at about {at_s:.0} s and stays there: was the unit moved, its power or its range \
         switched, or are these two logs? A step is taken for drift; cut the log there with --start and --duration",
        short(before),
        short(behind)
    )
}

/// Of the good readings; no number without any.
fn mean(readings: &[f64]) -> f64 {
    mean_if_any(readings.iter().copied()).unwrap_or(f64::NAN)
}
