//! References: spans over which the true rate of the case is known. Checks, waiting, refusals.

use core::cmp::Ordering;

use serde::{Deserialize, Serialize};

use crate::counting::counters;
use crate::later::Later;
use crate::units::{Span, Timestamp};

/// Shortest span of a reference.
pub const SHORTEST_REFERENCE: Span = Span::from_ms(1_000);
/// Longest span of a reference: the ring holds 128 s, of which the delay and late arrivals need some.
pub const LONGEST_REFERENCE: Span = Span::from_ms(120_000);
/// Most references that wait to take effect.
pub const MAX_WAITING_REFERENCES: usize = 16;

/// Largest rate of a reference (rad/s), far beyond any gyro.
const LARGEST_RATE_RAD_PER_S: f64 = 1e3;
/// Largest sigma of a reference (rad/s): one that knows less says nothing.
const LARGEST_SIGMA_RAD_PER_S: f64 = 1.0;

/// A span over which the true rate of the case is known.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Reference {
    /// Start of the span on the producer's clock.
    pub start: Timestamp,
    /// End of the span on the producer's clock; 1 s to 120 s after its start.
    pub end: Timestamp,
    /// Mean inertial angular rate of the case over the span, in case axes (rad/s).
    pub angular_rate: [f64; 3],
    /// Standard error of that rate along any axis (rad/s, 0…1), independent from one reference to the next. An error that
    /// stays (a wrong latitude) cannot be told from ε0 and ends up in it.
    pub sigma: f64,
}

/// Why a reference was refused.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error, Serialize, Deserialize)]
#[non_exhaustive]
pub enum ReferenceRefusal {
    /// No gyro of the calibration in force states a drift: there is nothing to feed.
    #[error("no gyro of the calibration in force states a drift to estimate")]
    NoDrift,
    /// A rate or sigma is no number, or far outside what can be.
    #[error("a rate must be finite and at most 1000 rad/s, sigma 0 to 1 rad/s")]
    NotPlausible,
    /// The span is shorter than [`SHORTEST_REFERENCE`]; also one that ends before it starts.
    #[error("the span is {got_s:.3} s, at least {min_s:.0} s are needed")]
    TooShort {
        /// Its length (s); negative where it ends before it starts.
        got_s: f64,
        /// The shortest allowed (s).
        min_s: f64,
    },
    /// The span is longer than [`LONGEST_REFERENCE`].
    #[error("the span is {got_s:.3} s, at most {max_s:.0} s are kept")]
    TooLong {
        /// Its length (s).
        got_s: f64,
        /// The longest allowed (s).
        max_s: f64,
    },
    /// Too many wait already, and this one lies furthest in the future.
    #[error("{MAX_WAITING_REFERENCES} earlier references are already waiting")]
    TooMany,
    /// The span begins before the readings that are kept.
    #[error("the readings at the start of the span are no longer kept, or were never received")]
    TooOld,
    /// The span begins before the end of the last one used.
    #[error("the span begins before the end of the last one used")]
    Overlap,
    /// Too many readings of the span are missing or unusable.
    #[error("more than 2 % of the span has no good reading")]
    Gap,
    /// The rate is too far from the predicted drift of every gyro.
    #[error("the measured drift is more than 5 sigma from the predicted one")]
    Gated,
    /// The producer restarted, and the span belongs to another time.
    #[error("the producer restarted before it took effect")]
    Restarted,
}

counters! {
    /// What became of the references of a unit; they only ever grow.
    ReferenceCounters {
        /// References received from outside or made at rest.
        received,
        /// Used by at least one gyro.
        used,
        /// Came after ticks that should have felt it; applied from the next tick on.
        late,
        /// Refused: the calibration in force states no drift.
        no_drift,
        /// Refused: no number, or far outside what can be.
        not_plausible,
        /// Refused: span too short.
        too_short,
        /// Refused: span too long.
        too_long,
        /// Dropped because too many were waiting.
        overflow,
        /// Refused: the readings of its time are no longer kept.
        too_old,
        /// Refused: the span overlaps one that was used, or lies before it.
        overlap,
        /// Refused: too many readings of the span are missing or unusable, for every gyro.
        gap,
        /// Refused by the gate of every gyro that had the readings.
        gated,
        /// Dropped: the producer restarted.
        restarted,
    }
}

impl ReferenceCounters {
    /// Counts a refusal.
    pub(super) fn refuse(&mut self, refusal: ReferenceRefusal) {
        let counter = match refusal {
            ReferenceRefusal::NoDrift => &mut self.no_drift,
            ReferenceRefusal::NotPlausible => &mut self.not_plausible,
            ReferenceRefusal::TooShort { .. } => &mut self.too_short,
            ReferenceRefusal::TooLong { .. } => &mut self.too_long,
            ReferenceRefusal::TooMany => &mut self.overflow,
            ReferenceRefusal::TooOld => &mut self.too_old,
            ReferenceRefusal::Overlap => &mut self.overlap,
            ReferenceRefusal::Gap => &mut self.gap,
            ReferenceRefusal::Gated => &mut self.gated,
            ReferenceRefusal::Restarted => &mut self.restarted,
        };
        *counter += 1;
    }
}

impl Reference {
    /// Checks what can be said of a reference by itself.
    pub(super) fn check(&self) -> Result<(), ReferenceRefusal> {
        let rates = self.angular_rate.iter().all(|rate| rate.abs() <= LARGEST_RATE_RAD_PER_S);
        if !rates || !(0.0..=LARGEST_SIGMA_RAD_PER_S).contains(&self.sigma) {
            return Err(ReferenceRefusal::NotPlausible);
        }
        let (span, got_s) = (self.end.since(self.start), self.end.seconds_from(self.start));
        if span < SHORTEST_REFERENCE {
            return Err(ReferenceRefusal::TooShort { got_s, min_s: SHORTEST_REFERENCE.as_s() });
        }
        if span > LONGEST_REFERENCE {
            return Err(ReferenceRefusal::TooLong { got_s, max_s: LONGEST_REFERENCE.as_s() });
        }
        Ok(())
    }

    /// An order that leaves nothing to the order of arrival.
    fn order(&self, other: &Self) -> Ordering {
        let rates = || self.angular_rate.iter().zip(&other.angular_rate).map(|(a, b)| a.total_cmp(b));
        self.end
            .cmp(&other.end)
            .then(self.start.cmp(&other.start))
            .then(self.sigma.total_cmp(&other.sigma))
            .then_with(|| rates().fold(Ordering::Equal, Ordering::then))
    }
}

/// References that wait for the first tick which is to feel them, the earliest first.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub(super) struct Waiting {
    pub(super) references: Later<Reference, MAX_WAITING_REFERENCES>,
}

impl Waiting {
    /// None, with room for all that may wait.
    pub(super) fn with_room() -> Self {
        let mut waiting = Self::default();
        waiting.references.room();
        waiting
    }

    /// Puts a reference in its place; gives back the one furthest in the future where that is one too many.
    pub(super) fn push(&mut self, reference: &Reference) -> Option<Reference> {
        let references = self.references.room();
        let place = references.partition_point(|waiting| reference.order(waiting).is_ge());
        if references.is_full() && place == references.len() {
            return Some(*reference);
        }
        let over = if references.is_full() { references.pop() } else { None };
        // There is room: one was taken out.
        references.try_insert(place, *reference).ok();
        over
    }

    /// The next reference that `due` holds for.
    pub(super) fn pop_if(&mut self, due: impl Fn(&Reference) -> bool) -> Option<Reference> {
        if self.references.first().is_some_and(due) { self.references.room().pop_at(0) } else { None }
    }

    /// Drops references from another time, after a step of the producer's clock; how many.
    pub(super) fn restart(&mut self, now: Timestamp) -> usize {
        let before = self.references.len();
        if before == 0 {
            return 0;
        }
        // What ends before the first tick of the new time has no readings any more.
        self.references.room().retain(|r| r.end > now && r.end.since(now) < Span::HOUR);
        before - self.references.len()
    }
}

#[cfg(test)]
mod tests;
