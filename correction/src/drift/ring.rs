//! The last two minutes of one gyro's residual angle, on a grid of event time.
//!
//! Residual: what the gyro measured less every bias of its calibration, without the drift estimate. The angle of each
//! tick is shared out to the cells that it covers, so the mean rate over any span of whole cells is that of the ticks
//! within half a tick's change of rate at either end. Where a span ends inside a cell, the cell's angle is divided by
//! time; for a rate that changes by Δω over the cell this errs by `Δω·c·f(1 − f)/2` of angle (c: length of the cell, f: the
//! part of it that is used), and that much is added to the stated uncertainty.
//!
//! Time without a good reading (a missing tick, a mode switch, a reading beyond its limit) is bridged with the mean of the
//! rest, as long as it is a small share of the span. What that can err by is the share times the scatter of the
//! cells' rates, which is added too: at rest it is next to nothing, in motion it takes the measurement's weight away.

use alloc::vec::Vec;
use core::array;

use serde::{Deserialize, Serialize};

use super::{Reference, ReferenceRefusal};
use crate::lanes::{Lanes, narrow, put};
use crate::sample::MAX_SENSORS;
use crate::units::{Span, Timestamp};

/// Length of a cell.
pub const CELL: Span = Span::from_ms(250);
/// Cells kept: 128 s.
pub const RING_CELLS: u16 = 512;
/// Largest share of a span that may be bridged: white noise then adds at most a tenth to the variance over a minute.
pub const LARGEST_UNOBSERVED_SHARE: f64 = 0.02;

/// One cell: the angle gained in it, and for how much of it there were good readings.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
struct Cell {
    angle_rad: f64,
    observed_s: f64,
}

impl Cell {
    fn rate(self) -> f64 {
        if self.observed_s > 0.0 { self.angle_rad / self.observed_s } else { 0.0 }
    }
}

/// Mean residual rate over a span.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Mean {
    /// rad/s.
    pub(super) rate: f64,
    /// Variance from bridged time and from ends inside a cell ((rad/s)²).
    pub(super) variance: f64,
}

/// The cells that one tick covers: alike for every gyro.
#[derive(Debug, Clone, Copy)]
pub(super) struct Covered {
    start: Timestamp,
    end: Timestamp,
    first: i64,
    last: i64,
    /// Place of the last cell, and how much of it the tick covers (s).
    slot: usize,
    in_last_s: f64,
}

impl Covered {
    /// Of a tick from `start` to `end`.
    pub(super) fn new(start: Timestamp, end: Timestamp) -> Self {
        let last = last_number(end);
        // Mostly within one cell.
        let first = if start >= Timestamp::of_cell(last, CELL) { last } else { start.cell(CELL) };
        Self { start, end, first, last, slot: slot(last), in_last_s: overlap(last, start, end).as_s() }
    }
}

/// The cell in which the last tick ended, as the rings of a unit will hold it: a lane for each gyro. Ticks add to it what they would
/// add to the rings.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct OpenCell {
    from: Timestamp,
    to: Timestamp,
    slot: usize,
    angle_rad: Lanes,
    observed_s: Lanes,
}

impl OpenCell {
    /// The last cell of a tick; `None` where it is not the newest of each ring.
    pub(super) fn new<'a>(
        tick: &Covered,
        rings: impl Iterator<Item = (usize, &'a Ring)> + Clone,
    ) -> Option<Self> {
        let from = Timestamp::of_cell(tick.last, CELL);
        if from + CELL == from || rings.clone().any(|(_, ring)| ring.newest != Some(tick.last)) {
            return None;
        }
        let (mut angle_rad, mut observed_s) = ([0.0; MAX_SENSORS], [0.0; MAX_SENSORS]);
        for (lane, ring) in rings {
            let cell = ring.cell(tick.last);
            (angle_rad[lane], observed_s[lane]) = (cell.angle_rad, cell.observed_s);
        }
        Some(Self { from, to: from + CELL, slot: tick.slot, angle_rad, observed_s })
    }

    /// Time of a tick that lies in it (s); `None` for another tick.
    #[inline]
    pub(super) fn within(&self, start: Timestamp, end: Timestamp) -> Option<f64> {
        (self.from <= start && start < end && end <= self.to).then(|| end.since(start).as_s())
    }

    /// Adds the mean rate (rad/s) of one gyro over a time (s).
    #[inline]
    pub(super) fn gain(&mut self, lane: usize, covered_s: f64, rate: f64) {
        self.angle_rad[lane] += rate * covered_s;
        self.observed_s[lane] += covered_s;
    }

    /// Adds those of the first `N` gyros.
    #[inline]
    pub(super) fn gain_all<const N: usize>(&mut self, covered_s: f64, rates: [f64; N]) {
        let (angles, times): (&[f64; N], &[f64; N]) = (narrow(&self.angle_rad), narrow(&self.observed_s));
        let angles = array::from_fn(|lane| angles[lane] + rates[lane] * covered_s);
        let times = array::from_fn(|lane| times[lane] + covered_s);
        put::<N>(&mut self.angle_rad, angles);
        put::<N>(&mut self.observed_s, times);
    }

    /// Writes one gyro's part of it into its ring.
    pub(super) fn write(&self, lane: usize, ring: &mut Ring) {
        if let Some(cell) = ring.cells.get_mut(self.slot) {
            *cell = Cell { angle_rad: self.angle_rad[lane], observed_s: self.observed_s[lane] };
        }
    }
}

/// The cells of one gyro.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Ring {
    cells: Vec<Cell>,
    /// Number of the newest cell, counted from the clock's epoch.
    newest: Option<i64>,
}

impl Ring {
    pub(super) fn new() -> Self {
        Self { cells: alloc::vec![Cell::default(); RING_CELLS.into()], newest: None }
    }

    pub(super) fn clear(&mut self) {
        self.cells.fill(Cell::default());
        self.newest = None;
    }

    /// Shares the mean rate (rad/s) of a tick out to the cells that it covers; `None` where nothing was observed.
    pub(super) fn take(&mut self, tick: &Covered, rate: Option<f64>) {
        if self.newest != Some(tick.last) {
            self.reach(tick.last);
        }
        let Some(rate) = rate else { return };
        if tick.first != tick.last || self.newest != Some(tick.last) {
            return self.share_out(tick, rate);
        }
        self.gain(tick.slot, tick.in_last_s, rate);
    }

    /// Makes room up to a cell, without anything observed.
    #[cold]
    fn reach(&mut self, number: i64) {
        let before = self.newest.unwrap_or(i64::MIN);
        let oldest_new = before.saturating_add(1).max(number.saturating_sub(i64::from(RING_CELLS) - 1));
        for new in oldest_new..=number {
            if let Some(cell) = self.cells.get_mut(slot(new)) {
                *cell = Cell::default();
            }
        }
        self.newest = Some(before.max(number));
    }

    /// Likewise for a tick that covers several cells, or one of before.
    #[cold]
    fn share_out(&mut self, tick: &Covered, rate: f64) {
        let oldest = self.oldest();
        for number in tick.first.max(oldest)..tick.last {
            self.gain(slot(number), overlap(number, tick.start, tick.end).as_s(), rate);
        }
        if oldest <= tick.last {
            self.gain(tick.slot, tick.in_last_s, rate);
        }
    }

    #[inline]
    fn gain(&mut self, slot: usize, covered_s: f64, rate: f64) {
        if let Some(cell) = self.cells.get_mut(slot) {
            cell.angle_rad += rate * covered_s;
            cell.observed_s += covered_s;
        }
    }

    /// Mean rate over a span whose last cell is complete.
    pub(super) fn mean(&self, reference: &Reference) -> Result<Mean, ReferenceRefusal> {
        let Reference { start, end, .. } = *reference;
        let (first, last) = (start.cell(CELL), last_number(end));
        if first < self.oldest() {
            return Err(ReferenceRefusal::TooOld);
        }
        let span_s = end.since(start).as_s();
        let used = || {
            (first..=last).map(|number| {
                let share = overlap(number, start, end).as_s() / CELL.as_s();
                let Cell { angle_rad, observed_s } = self.cell(number);
                (angle_rad * share, observed_s * share)
            })
        };
        let (angle_rad, observed_s) =
            used().fold((0.0, 0.0), |(angle, observed), (a, s)| (angle + a, observed + s));
        let unobserved = (1.0 - observed_s / span_s).max(0.0);
        // Clocks that count a tick's duration and its end time differ by some parts in a thousand, not more.
        if unobserved > LARGEST_UNOBSERVED_SHARE || observed_s > span_s * (1.0 + LARGEST_UNOBSERVED_SHARE) {
            return Err(ReferenceRefusal::Gap);
        }
        let rate = angle_rad / observed_s;
        let scatter = used().fold(0.0, |sum, (angle, s)| {
            let off = if s > 0.0 { angle / s - rate } else { 0.0 };
            sum + s * off * off
        }) / observed_s;
        let first_end = self.end_error_rad(first, first + 1, overlap(first, start, end));
        let last_end = self.end_error_rad(last - 1, last, overlap(last, start, end));
        let ends = (first_end * first_end + last_end * last_end) / (span_s * span_s);
        Ok(Mean { rate, variance: unobserved * unobserved * scatter + ends })
    }

    /// `Δω·c·f(1 − f)/2` at an end that uses `part` of its cell; Δω from two neighbouring cells.
    fn end_error_rad(&self, one: i64, other: i64, part: Span) -> f64 {
        let f = part.as_s() / CELL.as_s();
        let change = self.cell(other).rate() - self.cell(one).rate();
        0.5 * change * CELL.as_s() * f * (1.0 - f)
    }

    fn cell(&self, number: i64) -> Cell {
        self.cells.get(slot(number)).copied().unwrap_or_default()
    }

    fn oldest(&self) -> i64 {
        self.newest.map_or(i64::MAX, |newest| newest.saturating_sub(i64::from(RING_CELLS) - 1))
    }
}

/// End of the cell in which a span ends.
pub(super) fn cell_end(end: Timestamp) -> Timestamp {
    Timestamp::of_cell(last_number(end).saturating_add(1), CELL)
}

/// Number of the cell in which a span ends.
const fn last_number(end: Timestamp) -> i64 {
    Timestamp::from_ns(end.as_ns().saturating_sub(1)).cell(CELL)
}

/// Place of a cell in the ring.
fn slot(number: i64) -> usize {
    usize::try_from(number.rem_euclid(i64::from(RING_CELLS))).unwrap_or(0)
}

/// How much of a cell lies between two times.
fn overlap(number: i64, start: Timestamp, end: Timestamp) -> Span {
    let from = Timestamp::of_cell(number, CELL);
    end.min(from + CELL).since(start.max(from))
}

#[cfg(test)]
mod tests;
