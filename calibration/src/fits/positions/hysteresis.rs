//! Whether the axes come back: C before and after a thermal cycle, at the same temperature (004's hysteresis of the axes).

use nalgebra::{DMatrix, DVector};

use super::doubts::{ACCIDENT, excess, survival};
use super::model::{SMALL, Taken};
use super::pose::Pose;
use super::solve::{Fit, Positions};
use crate::finding::AccelKind;
use crate::lsq::linear;
use crate::numbers::{ARCSEC_PER_RAD, mean};

/// The axes at one temperature, before and after others were visited.
#[derive(Debug, Clone, PartialEq)]
pub struct Return {
    /// The temperature (°C).
    pub deg_c: f64,
    /// Runs before and after, by number.
    pub runs: [usize; 2],
    /// By how much each accelerometer's axis turned, and its standard error (″).
    pub turns: Vec<[f64; 2]>,
    /// Probability that so much is an accident.
    pub accident: f64,
}

impl Return {
    /// As a finding, where an axis moved beyond chance: the accelerometer whose axis turned most, and the kind.
    pub fn finding(&self, runs: &[String]) -> Option<(usize, AccelKind)> {
        let turns = self.turns.iter().copied().enumerate().filter(|_| self.accident < ACCIDENT);
        let (sensor, turn) = turns.max_by(|a, b| a.1[0].total_cmp(&b.1[0]))?;
        let logs = self.runs.map(|run| runs.get(run).cloned().unwrap_or_default());
        Some((sensor, AccelKind::AxisMoved { deg_c: self.deg_c, logs, turn }))
    }
}

/// Positions of one temperature that were taken without another in between, fitted by themselves.
struct Visit {
    run: usize,
    level: usize,
    /// Mean temperature that the axes follow, scaled as that of [`Taken`].
    axes_t: f64,
    fit: Fit,
}

/// Every return to a temperature that was left; `poses` are those of `all.taken`, in the order of logs and time.
pub(super) fn returns(all: &Positions<'_>, poses: &[Pose], fit: &Fit, levels_deg_c: &[f64]) -> Vec<Return> {
    let mut order: Vec<usize> = (0..poses.len()).collect();
    order.sort_by_key(|index| (poses[*index].run, poses[*index].ticks.start));
    let visit = |visit: &[usize]| {
        let taken: Vec<Taken> = visit.iter().map(|index| all.taken[*index].clone()).collect();
        let fit = all.alone(&taken)?;
        let axes_t: Vec<f64> = taken.iter().map(|taken| taken.axes_t).collect();
        Some(Visit { run: poses[visit[0]].run, level: taken[0].level, axes_t: mean(&axes_t), fit })
    };
    let visits = order.chunk_by(|a, b| all.taken[*a].level == all.taken[*b].level);
    let found: Vec<Visit> = visits.filter_map(visit).collect();
    let after = |at: usize| {
        let before = found[..at].iter().rev().find(|other| other.level == found[at].level)?;
        compare(fit, [before, &found[at]], levels_deg_c)
    };
    (0..found.len()).filter_map(after).collect()
}

/// The turn from one visit to another, less what the line over temperature says of the small difference of theirs.
fn compare(fit: &Fit, [first, second]: [&Visit; 2], levels_deg_c: &[f64]) -> Option<Return> {
    let [before, after] = [&first.fit, &second.fit];
    let away = second.axes_t - first.axes_t;
    let angle = |sensor: usize, which: usize| {
        let at = before.degrees.axis_index(sensor, which, 0);
        let slope = if fit.degrees.axes > 0 {
            fit.solution.parameters[fit.degrees.axis_index(sensor, which, 1)]
        } else {
            0.0
        };
        (after.solution.parameters[at] - before.solution.parameters[at] - slope * away) * SMALL
    };
    let count = fit.guess.len();
    let angles = DVector::from_iterator(
        2 * count,
        (0..count).flat_map(|sensor| [0, 1].map(|which| angle(sensor, which))),
    );
    let chi_square = before.solution.chi_square + after.solution.chi_square;
    let degrees = before.solution.degrees + after.solution.degrees;
    let covariance: DMatrix<f64> =
        (before.axes_covariance(0) + after.axes_covariance(0)) * excess(chi_square, degrees).unwrap_or(1.0);
    let accident = survival(linear::chi_square(&angles, &covariance)?, 2 * count);
    let turn = |sensor: usize| {
        let own = angles.rows(2 * sensor, 2);
        let block = covariance.view((2 * sensor, 2 * sensor), (2, 2));
        let size = own.norm();
        let variance = if size > 0.0 { (block * own).dot(&own) / (size * size) } else { block[(0, 0)] };
        [size * ARCSEC_PER_RAD, variance.max(0.0).sqrt() * ARCSEC_PER_RAD]
    };
    Some(Return {
        deg_c: *levels_deg_c.get(second.level)?,
        runs: [first.run, second.run],
        turns: (0..count).map(turn).collect(),
        accident,
    })
}
