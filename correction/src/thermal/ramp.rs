//! Values that move on a straight line from one to the next.

use serde::{Deserialize, Serialize};

use crate::units::{Span, Timestamp};

/// When a way begins, and what part of it is made in a second; a way that is over at once has no pace.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub(crate) struct Pace {
    start: Timestamp,
    per_second: f64,
}

impl Pace {
    /// A way that takes this long from `start` on.
    pub(crate) fn new(start: Timestamp, over: Span) -> Self {
        if over == Span::ZERO { Self::default() } else { Self { start, per_second: 1.0 / over.as_s() } }
    }

    /// Whether the way begins at `time`.
    pub(crate) fn starts(&self, time: Timestamp) -> bool {
        self.per_second > 0.0 && self.start == time
    }

    /// How far along the way `time` is, 0…1: exactly 0 before the start, exactly 1 at and after the end; 0 without a pace.
    #[inline]
    pub(crate) fn share(&self, time: Timestamp) -> f64 {
        let way = time.seconds_from(self.start) * self.per_second;
        // Not `clamp`: without a pace −0 is to become 0, and these are two instructions without a branch.
        let way = if way > 0.0 { way } else { 0.0 };
        if way < 1.0 { way } else { 1.0 }
    }
}

/// A value on its way.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct Ramp {
    pace: Pace,
    from: f64,
    step: f64,
}

impl Ramp {
    /// A value that stands still.
    pub(crate) fn hold(value: f64) -> Self {
        Self { pace: Pace::default(), from: value, step: 0.0 }
    }

    /// The value at `time`: exactly the starting one before the start.
    pub(crate) fn at(&self, time: Timestamp) -> f64 {
        self.from + self.step * self.share(time)
    }

    /// Turns towards `target`, to be reached `over` later; from where the value is at `start`.
    pub(crate) fn turn(&mut self, start: Timestamp, over: Span, target: f64) {
        let from = self.at(start);
        *self = if over == Span::ZERO {
            Self::hold(target)
        } else {
            Self { pace: Pace::new(start, over), from, step: target - from }
        };
    }

    /// Arrives at once.
    pub(crate) fn settle(&mut self) {
        *self = Self::hold(self.from + self.step);
    }

    /// How far along its way the value is, 0…1; 0 for one that stands still.
    #[inline]
    pub(crate) fn share(&self, time: Timestamp) -> f64 {
        self.pace.share(time)
    }
}

#[cfg(test)]
#[expect(clippy::float_cmp, reason = "continuity is to the bit")]
mod tests {
    use super::*;

    #[test]
    fn a_turn_in_mid_way_is_continuous() {
        let at = |ms: i64| Timestamp::from_ns(ms * 1_000_000);
        for (from, to) in [(1.0, 2.0), (-1.0, -3.0)] {
            let mut ramp = Ramp::hold(from);
            ramp.turn(at(0), Span::from_ms(100), to);
            let before = ramp.at(at(40));
            ramp.turn(at(40), Span::from_ms(100), 0.0);
            assert_eq!(ramp.at(at(40)), before);
            assert_eq!(ramp.at(at(39)), before);
            assert!(ramp.at(at(140)).abs() < 1e-15);
        }
    }
}
