//! References made at rest: whole minutes of event time over which the unit stood still.

use serde::{Deserialize, Serialize};

use super::Reference;
use crate::units::{Span, Timestamp};

/// Length of a reference made at rest; its ends are multiples of it in event time.
pub const REST_SPAN: Span = Span::from_ms(60_000);
/// The unit must go on standing still for so long after a span before the span counts: whoever watches for motion needs up
/// to a minute to see a slow one.
pub const REST_CONFIRMATION: Span = Span::from_ms(60_000);

/// A unit that was not seen for longer may have moved.
const LONGEST_GAP: Span = Span::from_ms(1_000);

/// Watches for whole minutes at rest.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct RestFeeder {
    /// Start of the first tick of the present rest.
    since: Option<Timestamp>,
    /// End of the last tick.
    last: Option<Timestamp>,
}

impl RestFeeder {
    /// A feeder that has seen nothing.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Takes one tick and whether the unit stands still in it; gives the span of a minute that was spent at rest and
    /// that another minute of rest has confirmed.
    ///
    /// Each whole minute of event time is given at most once. A step back of time ends the rest.
    pub fn observe(
        &mut self,
        end_time: Timestamp,
        duration: Span,
        at_rest: bool,
    ) -> Option<(Timestamp, Timestamp)> {
        let start = end_time - duration;
        let last = self.last.replace(end_time).unwrap_or(start);
        if !at_rest || end_time < last || start.since(last) > LONGEST_GAP {
            self.since = None;
        }
        if !at_rest {
            return None;
        }
        let since = *self.since.get_or_insert(start);
        let confirmed = minute(end_time - REST_CONFIRMATION);
        if confirmed <= minute(last - REST_CONFIRMATION) {
            return None;
        }
        let end = Timestamp::from_ns(confirmed.saturating_mul(REST_SPAN.as_ns()));
        let start = end - REST_SPAN;
        (start >= since).then_some((start, end))
    }

    /// As [`observe`](Self::observe), with the Earth's rate in case axes (rad/s) and its sigma (rad/s), asked for only where
    /// a minute is complete; `None` from it gives no reference.
    pub fn reference(
        &mut self,
        (end_time, duration): (Timestamp, Span),
        at_rest: bool,
        earth_rate: impl FnOnce() -> Option<([f64; 3], f64)>,
    ) -> Option<Reference> {
        let (start, end) = self.observe(end_time, duration, at_rest)?;
        let (angular_rate, sigma) = earth_rate()?;
        Some(Reference { start, end, angular_rate, sigma })
    }
}

/// Number of the minute of event time.
const fn minute(time: Timestamp) -> i64 {
    time.as_ns().div_euclid(REST_SPAN.as_ns())
}

#[cfg(test)]
mod tests;
