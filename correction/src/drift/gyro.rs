//! One gyro of the estimator: its filter, its readings, and what is subtracted from it.

use serde::{Deserialize, Serialize};

use super::filter::{Filter, Measured};
use super::ring::Ring;
use super::{DriftModel, Reference, ReferenceRefusal};
use crate::thermal::Ramp;
use crate::units::{Span, Timestamp};

/// What an update changes is subtracted bit by bit over this time, so that the corrected rate has no step.
pub const SUBTRACTION_RAMP: Span = Span::from_ms(10_000);

/// Length of the cells at whose ends the prediction is evaluated.
pub(super) const GRID: Span = Span::from_ms(1_000);

/// The drift of one gyro as it is known at the last tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DriftEstimate {
    /// Predicted drift ε along the gyro's input axis (rad/s): what the calibration's biases leave.
    pub rate: f64,
    /// Its standard error (rad/s).
    pub sigma: f64,
    /// Trend rate χ (rad/s²).
    pub trend: f64,
    /// Its standard error (rad/s²).
    pub trend_sigma: f64,
    /// Measurements taken.
    pub updates: u64,
    /// Measurements refused by the gate.
    pub refused: u64,
    /// Of the measurements taken, those that ended a row of refusals which agreed with each other.
    pub believed: u64,
    /// End of the last reference taken; `None` before the first and after a step back of the producer's clock.
    pub last_update: Option<Timestamp>,
    /// Innovation of the last measurement taken, in its sigmas.
    pub normalised_innovation: Option<f64>,
    /// Mean of the normalised innovations squared over the last
    /// [`INNOVATIONS_KEPT`](super::INNOVATIONS_KEPT) measurements taken; near 1 where the stated drift is the gyro's own,
    /// see [`MEAN_NIS_BOUNDS`](super::MEAN_NIS_BOUNDS).
    pub mean_nis: Option<f64>,
}

/// One gyro.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct GyroDrift {
    pub(super) filter: Filter,
    pub(super) ring: Ring,
    /// The prediction on its way over a cell of the grid: at its start, and how much it gains (rad/s).
    line: [f64; 2],
    /// What is subtracted beyond the line: the rest of what updates have changed.
    offset: Ramp,
}

impl GyroDrift {
    pub(super) fn new(model: DriftModel) -> Self {
        Self { filter: Filter::new(model), ring: Ring::new(), line: [0.0; 2], offset: Ramp::hold(0.0) }
    }

    /// Draws the line over the grid cell of this number.
    pub(super) fn draw(&mut self, grid: i64) {
        let from = self.filter.rate_at(Timestamp::of_cell(grid, GRID));
        let to = self.filter.rate_at(Timestamp::of_cell(grid.saturating_add(1), GRID));
        self.line = [from, to - from];
    }

    fn predicted(&self, grid: i64, time: Timestamp) -> f64 {
        let [from, gain] = self.line;
        from + gain * (time.seconds_from(Timestamp::of_cell(grid, GRID)) / GRID.as_s())
    }

    pub(super) fn subtrahend(&self, grid: i64, time: Timestamp) -> f64 {
        self.predicted(grid, time) + self.offset.at(time)
    }

    /// Goes on from what was subtracted `before` to what the filter says now.
    pub(super) fn hand_over(&mut self, before: f64, grid: i64, time: Timestamp) {
        self.draw(grid);
        self.offset = Ramp::hold(before - self.predicted(grid, time));
        self.offset.turn(time, SUBTRACTION_RAMP, 0.0);
    }

    /// Measures the drift against a reference that gives this rate (rad/s) along the input axis, at the tick that ends `now`.
    pub(super) fn measure(
        &mut self,
        reference: &Reference,
        rate: f64,
        grid: i64,
        now: Timestamp,
    ) -> Result<(), ReferenceRefusal> {
        let &Reference { start, end, sigma, .. } = reference;
        let mean = self.ring.mean(reference)?;
        let before = self.subtrahend(grid, now);
        let variance = mean.variance + sigma * sigma;
        if !self.filter.update(&Measured { start, end, mean: mean.rate - rate, variance }) {
            return Err(ReferenceRefusal::Gated);
        }
        self.hand_over(before, grid, now);
        Ok(())
    }

    /// The drift at `time`, that of the last tick.
    pub(super) fn estimate(&self, grid: i64, time: Timestamp) -> DriftEstimate {
        DriftEstimate { rate: self.predicted(grid, time), ..self.filter.estimate(time) }
    }
}
