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
    /// Takes one tick (its end and its duration) and whether the unit stands still in it; gives a reference over a minute
    /// that was spent at rest and that another minute of rest has confirmed.
    ///
    /// Each whole minute of event time is given at most once. A step back of time ends the rest. `earth_rate` gives the
    /// Earth's rate in case axes (rad/s) and its sigma (rad/s), and is asked only where a minute is complete; `None` from it
    /// gives no reference.
    pub fn reference(
        &mut self,
        (end_time, duration): (Timestamp, Span),
        at_rest: bool,
        earth_rate: impl FnOnce() -> Option<([f64; 3], f64)>,
    ) -> Option<Reference> {
        let start = end_time - duration;
        let last = self.last.replace(end_time).unwrap_or(start);
        if !at_rest || end_time < last || start.since(last) > LONGEST_GAP {
            self.since = None;
        }
        if !at_rest {
            return None;
        }
        let since = *self.since.get_or_insert(start);
        let [before, confirmed] = [last, end_time].map(|time| (time - REST_CONFIRMATION).cell(REST_SPAN));
        let end = Timestamp::of_cell(confirmed, REST_SPAN);
        let start = end - REST_SPAN;
        if confirmed <= before || start < since {
            return None;
        }
        let (angular_rate, sigma) = earth_rate()?;
        Some(Reference { start, end, angular_rate, sigma })
    }
}

#[cfg(test)]
mod tests;
