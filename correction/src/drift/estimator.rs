//! The estimator of a unit: feeds each gyro's filter from ticks and references, and says what to subtract.

use alloc::vec::Vec;
use core::array;

use serde::{Deserialize, Serialize};

use super::DriftModel;
use super::gyro::{DriftEstimate, GRID, GyroDrift};
use super::reference::{Reference, ReferenceCounters, ReferenceRefusal, Waiting};
use super::ring::{Covered, OpenCell, cell_end};
use crate::lanes::within;
use crate::observation::{GyroLanes, Observation, SOUND};
use crate::sample::{MAX_SENSORS, SensorFlags, Sensors};
use crate::units::{Span, Timestamp};

/// Settings of an estimator that are not part of the calibration.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct DriftSettings {
    /// A reference takes effect for ticks that end after its span plus this.
    pub delay: Span,
    /// Whether the drift is subtracted; it is estimated in any case.
    pub subtract: bool,
}

/// Follows the drift of every gyro of a unit whose calibration states one.
///
/// Everything is a function of the ticks, the references and their own time: a reference takes effect at the first tick
/// that ends after the end of its span plus a fixed delay (and after the 0.25 s cell in which the span ends). What arrives
/// later still is counted and applies from the next tick on.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DriftEstimator {
    /// In the order of the calibration, `None` for a gyro without a stated drift; empty where none states one.
    gyros: Vec<Option<GyroDrift>>,
    settings: DriftSettings,
    waiting: Waiting,
    counters: ReferenceCounters,
    /// Number of the grid cell in which the tick of the last [`advance`](Self::advance) ends.
    grid: i64,
    /// End of the last tick.
    observed_until: Option<Timestamp>,
    /// End of the last reference that was measured against the readings.
    used_until: Option<Timestamp>,
    /// The cell that the next tick most likely adds to.
    open: Option<OpenCell>,
}

impl DriftEstimator {
    /// An estimator for the gyros of a unit, in the calibration's order; `None` for a gyro that states no drift.
    ///
    /// Allocates here and never again, and nothing where no gyro states a drift: then a tick costs one branch.
    #[must_use]
    pub fn new(models: &[Option<DriftModel>], settings: DriftSettings) -> Self {
        let gyros = if models.iter().any(Option::is_some) { models } else { &[] };
        Self {
            gyros: gyros.iter().map(|model| model.map(GyroDrift::new)).collect(),
            settings,
            waiting: if gyros.is_empty() { Waiting::default() } else { Waiting::with_room() },
            counters: ReferenceCounters::default(),
            grid: 0,
            observed_until: None,
            used_until: None,
            open: None,
        }
    }

    /// Whether no gyro states a drift: there is nothing to feed.
    #[must_use]
    pub fn is_idle(&self) -> bool {
        self.gyros.is_empty()
    }

    /// Goes on where `before` is, after a swap of the calibration, for each gyro whose drift parameters are the same and
    /// for which `same_bias` says that the other biases are too; what is left of a bias that changed is another drift.
    pub fn carry(&mut self, mut before: Self, same_bias: impl Fn(usize) -> bool) {
        before.close_cell();
        let old = core::mem::take(&mut before.gyros);
        let mut gyros = core::mem::take(&mut self.gyros);
        for (index, (new, old)) in gyros.iter_mut().zip(old).enumerate() {
            if let (Some(new), Some(old)) = (new, old)
                && new.filter.model == old.filter.model
                && same_bias(index)
            {
                *new = old;
            }
        }
        *self = Self { gyros, settings: self.settings, ..before };
    }

    /// Takes a reference from an aiding source.
    ///
    /// # Errors
    ///
    /// What is wrong with it by itself, or that too many wait. What shows only when it takes effect is counted then.
    pub fn submit(&mut self, reference: &Reference) -> Result<(), ReferenceRefusal> {
        self.submit_at_rest(reference)?;
        if self.observed_until.is_some_and(|until| self.effective(reference) < until) {
            self.counters.late += 1;
        }
        Ok(())
    }

    /// Takes a reference that the unit's owner made at rest, from ticks that are long past: it is never late.
    ///
    /// # Errors
    ///
    /// As [`submit`](Self::submit).
    pub fn submit_at_rest(&mut self, reference: &Reference) -> Result<(), ReferenceRefusal> {
        self.counters.received += 1;
        let idle = if self.is_idle() { Err(ReferenceRefusal::NoDrift) } else { Ok(()) };
        if let Err(refusal) = idle.and_then(|()| reference.check()) {
            self.counters.refuse(refusal);
            return Err(refusal);
        }
        if let Some(over) = self.waiting.push(reference) {
            self.counters.refuse(ReferenceRefusal::TooMany);
            if over == *reference {
                return Err(ReferenceRefusal::TooMany);
            }
        }
        Ok(())
    }

    /// Ticks that end after this time feel the reference.
    fn effective(&self, reference: &Reference) -> Timestamp {
        (reference.end + self.settings.delay).max(cell_end(reference.end))
    }

    /// Goes on to the tick that ends at `end_time`, before it is corrected: applies every reference that takes effect.
    ///
    /// `restart`: sequence or time starts anew at this tick ([`TickFlags::RESTART`](crate::sample::TickFlags::RESTART)).
    /// `project` gives the rates along the input axes for a rate in case axes, as
    /// [`Orientation::forward`](crate::orientation::Orientation::forward) does at the present temperature; it is called
    /// once per reference. Ticks that end up to [`rests_until`](Self::rests_until) can do without.
    pub fn advance(
        &mut self,
        end_time: Timestamp,
        restart: bool,
        project: &dyn Fn([f64; 3]) -> Sensors<f64>,
    ) {
        if self.is_idle() {
            return;
        }
        let grid = end_time.cell(GRID);
        if restart {
            self.restart(end_time, grid);
        } else if grid != self.grid || self.observed_until.is_none() {
            self.gyros.iter_mut().flatten().for_each(|gyro| gyro.draw(grid));
        }
        self.grid = grid;
        self.take_effective(end_time, project);
    }

    /// Up to when ticks need no [`advance`](Self::advance): while no reference waits, to the end of the grid cell.
    #[must_use]
    pub fn rests_until(&self) -> Option<Timestamp> {
        if self.is_idle() {
            return Some(Timestamp::from_ns(i64::MAX));
        }
        let cell_end = Timestamp::of_cell(self.grid.saturating_add(1), GRID) - Span::from_ns(1);
        self.waiting.references.is_empty().then_some(cell_end)
    }

    /// Applies every reference that takes effect before the tick that ends at `end_time`.
    fn take_effective(&mut self, end_time: Timestamp, project: &dyn Fn([f64; 3]) -> Sensors<f64>) {
        let Some(observed_until) = self.observed_until else { return };
        let delay = self.settings.delay;
        let due = |r: &Reference| r.end + delay < end_time && cell_end(r.end) <= observed_until;
        while let Some(reference) = self.waiting.pop_if(due) {
            self.close_cell();
            match self.apply(&reference, end_time, project) {
                Ok(()) => self.counters.used += 1,
                Err(refusal) => self.counters.refuse(refusal),
            }
        }
    }

    /// Measures the drift of every gyro against a reference.
    fn apply(
        &mut self,
        reference: &Reference,
        now: Timestamp,
        project: &dyn Fn([f64; 3]) -> Sensors<f64>,
    ) -> Result<(), ReferenceRefusal> {
        if self.used_until.is_some_and(|until| reference.start < until) {
            return Err(ReferenceRefusal::Overlap);
        }
        let grid = self.grid;
        let gyros = self.gyros.iter_mut().zip(project(reference.angular_rate));
        let measured =
            gyros.filter_map(|(gyro, rate)| Some(gyro.as_mut()?.measure(reference, rate, grid, now)));
        let measured: Sensors<_> = measured.collect();
        let furthest = [Ok(()), Err(ReferenceRefusal::Gated), Err(ReferenceRefusal::Gap)];
        let furthest = furthest.into_iter().find(|furthest| measured.contains(furthest));
        let furthest = furthest.unwrap_or(Err(ReferenceRefusal::TooOld));
        if matches!(furthest, Ok(()) | Err(ReferenceRefusal::Gated)) {
            self.used_until = Some(reference.end);
        }
        furthest
    }

    /// The producer restarted: its readings are forgotten, the estimate goes on by prediction. Where time stepped back,
    /// nobody knows how long the producer was away, and the estimate starts anew about its constant part.
    #[cold]
    fn restart(&mut self, end_time: Timestamp, grid: i64) {
        self.open = None;
        let last = self.observed_until.take();
        let goes_on = last.is_none_or(|last| last < end_time);
        for gyro in self.gyros.iter_mut().flatten() {
            gyro.ring.clear();
            let before = last.map_or(0.0, |last| gyro.subtrahend(self.grid, last));
            if !goes_on {
                gyro.filter.lose_time();
            }
            gyro.hand_over(before, grid, end_time);
        }
        if !goes_on {
            self.used_until = None;
        }
        for _ in 0..self.waiting.restart(end_time) {
            self.counters.refuse(ReferenceRefusal::Restarted);
        }
    }

    /// Takes a tick after its correction.
    pub fn observe(&mut self, observation: &Observation) {
        if !self.is_idle() {
            self.add::<MAX_SENSORS>(observation);
        }
    }

    /// Adds the tick's residual rates to what is kept of each gyro; there are at most `N`.
    pub(crate) fn add<const N: usize>(&mut self, observation: &Observation) {
        let end = observation.end_time;
        let start = end - observation.duration;
        let GyroLanes { count, rate, bias, flags, .. } = &observation.gyros;
        let residual = |lane: usize| {
            let residual = rate[lane] - bias[lane];
            let counts =
                observation.settled & flags[lane].contains(SensorFlags::VALID) & residual.is_finite();
            counts.then_some(residual)
        };
        let lanes = || 0..MAX_SENSORS.min(*count);
        match self.open.as_mut().and_then(|open| Some((open.within(start, end)?, open))) {
            Some((covered_s, open)) => {
                let all: [f64; N] = array::from_fn(|lane| rate[lane] - bias[lane]);
                let whole = within(&all, &[f64::INFINITY; N]) & observation.settled;
                if whole && *flags == SOUND {
                    open.gain_all(covered_s, all);
                } else {
                    lanes().filter_map(|lane| Some((lane, residual(lane)?))).for_each(|(lane, rate)| {
                        open.gain(lane, covered_s, rate);
                    });
                }
            }
            None => self.go_on((start, end), lanes().len(), residual),
        }
        self.observed_until = Some(end);
    }

    /// Likewise of a tick that does not lie in the open cell; the cell in which it ends is open then.
    #[cold]
    #[inline(never)]
    fn go_on(
        &mut self,
        (start, end): (Timestamp, Timestamp),
        count: usize,
        residual: impl Fn(usize) -> Option<f64>,
    ) {
        let covered = Covered::new(start, end);
        self.close_cell();
        for (lane, gyro) in self.gyros.iter_mut().enumerate().take(count) {
            let Some(gyro) = gyro else { continue };
            gyro.filter.start(start);
            gyro.ring.take(&covered, residual(lane));
        }
        let gyros = self.gyros.iter().enumerate();
        let rings = gyros.filter_map(|(lane, gyro)| Some((lane, &gyro.as_ref()?.ring)));
        self.open = OpenCell::new(&covered, rings);
    }

    /// Has the rings know what the open cell holds.
    fn close_cell(&mut self) {
        let Some(open) = self.open.take() else { return };
        for (lane, gyro) in self.gyros.iter_mut().enumerate() {
            if let Some(gyro) = gyro {
                open.write(lane, &mut gyro.ring);
            }
        }
    }

    /// Whether [`subtrahend`](Self::subtrahend) may be anything but zero.
    #[must_use]
    pub fn subtracts(&self) -> bool {
        self.settings.subtract && !self.is_idle()
    }

    /// What to subtract from gyro `gyro` at the end of the present tick, `time` (rad/s): the prediction, without a step at
    /// updates. Zero for a gyro without a stated drift, and where the settings do not ask for it.
    #[must_use]
    pub fn subtrahend(&self, gyro: usize, time: Timestamp) -> f64 {
        let gyro = self.gyros.get(gyro).filter(|_| self.settings.subtract).and_then(Option::as_ref);
        gyro.map_or(0.0, |gyro| gyro.subtrahend(self.grid, time))
    }

    /// The drift of every gyro as it is known at the last tick, in the calibration's order; `None` for a gyro without a
    /// stated drift, nothing where none states one.
    ///
    /// The rate comes from a grid of 1 s and moves linearly in between; sigma and trend are evaluated here.
    pub fn estimates(&self) -> impl Iterator<Item = Option<DriftEstimate>> + '_ {
        let now = self.observed_until.unwrap_or_default();
        self.gyros.iter().map(move |gyro| Some(gyro.as_ref()?.estimate(self.grid, now)))
    }

    /// What became of the references.
    #[must_use]
    pub const fn counters(&self) -> &ReferenceCounters {
        &self.counters
    }
}

#[cfg(test)]
mod tests;
