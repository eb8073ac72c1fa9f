//! Values that move on a straight line from one to the next.

use serde::{Deserialize, Serialize};

use crate::units::{Span, Timestamp};

/// `N` values on their way from one thermal evaluation to the next.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Ramp<const N: usize> {
    start: Timestamp,
    per_second: f64,
    #[serde(with = "crate::written::array")]
    from: [f64; N],
    #[serde(with = "crate::written::array")]
    step: [f64; N],
}

impl<const N: usize> Ramp<N> {
    /// Values that stand still.
    #[must_use]
    pub const fn hold(values: [f64; N]) -> Self {
        Self { start: Timestamp::from_ns(0), per_second: 0.0, from: values, step: [0.0; N] }
    }

    /// The values at `time`: exactly the starting ones before the start, exactly the target at and after the end.
    #[must_use]
    pub fn at(&self, time: Timestamp) -> [f64; N] {
        let share = self.share(time);
        core::array::from_fn(|i| match (self.from.get(i), self.step.get(i)) {
            (Some(from), Some(step)) => from + step * share,
            _ => 0.0,
        })
    }

    /// Turns towards `target`, to be reached `over` later; from where the values are at `start`.
    pub fn turn(&mut self, start: Timestamp, over: Span, target: [f64; N]) {
        let from = self.at(start);
        if over == Span::ZERO {
            *self = Self::hold(target);
            return;
        }
        self.start = start;
        self.per_second = 1.0 / over.as_s();
        self.from = from;
        self.step = core::array::from_fn(|i| match (target.get(i), from.get(i)) {
            (Some(to), Some(from)) => to - from,
            _ => 0.0,
        });
    }

    /// Arrives at once.
    pub fn settle(&mut self) {
        *self = Self::hold(core::array::from_fn(|i| match (self.from.get(i), self.step.get(i)) {
            (Some(from), Some(step)) => from + step,
            _ => 0.0,
        }));
    }

    /// How far along the line `time` is, 0…1; 0 for values that stand still.
    #[must_use]
    pub fn share(&self, time: Timestamp) -> f64 {
        // Nothing to work out, as for every term of a unit without temperatures.
        if self.per_second == 0.0 { 0.0 } else { share(time.seconds_from(self.start), self.per_second) }
    }

    /// Where the values begin, and how far they go, each.
    pub(crate) const fn line(&self) -> (&[f64; N], &[f64; N]) {
        (&self.from, &self.step)
    }

    /// When they begin, and what part of their way they make in a second.
    pub(crate) const fn pace(&self) -> (Timestamp, f64) {
        (self.start, self.per_second)
    }
}

/// How far along a line one is so long after its beginning (s), 0…1.
pub(crate) fn share(since_start_s: f64, per_second: f64) -> f64 {
    let way = since_start_s * per_second;
    // Not `clamp`: for values that stand still −0 is to become 0, and these are two instructions without a branch.
    let way = if way > 0.0 { way } else { 0.0 };
    if way < 1.0 { way } else { 1.0 }
}

/// A ramp that is turned after each evaluation of the terms it carries.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Follower<const N: usize> {
    ramp: Ramp<N>,
    clamped: bool,
    /// Whether a reading was seen: the first one is not approached from the assumed temperature, but met.
    started: bool,
}

impl<const N: usize> Follower<N> {
    /// Starts with the terms as they are at the assumed temperature.
    #[must_use]
    pub const fn assumed(values: [f64; N], clamped: bool) -> Self {
        Self { ramp: Ramp::hold(values), clamped, started: false }
    }

    /// Turns towards new values; `clamped` says whether an argument was outside its fitted range.
    pub fn follow(&mut self, values: [f64; N], clamped: bool, start: Timestamp, over: Span) {
        self.ramp.turn(start, if self.started { over } else { Span::ZERO }, values);
        self.clamped = clamped;
        self.started = true;
    }

    /// Arrives at once: after a step of the producer's clock the way there means nothing.
    pub fn settle(&mut self) {
        self.ramp.settle();
    }

    /// The values in use at `time`.
    #[must_use]
    pub fn at(&self, time: Timestamp) -> [f64; N] {
        self.ramp.at(time)
    }

    /// Whether an argument was outside its fitted range at the last evaluation.
    #[must_use]
    pub const fn clamped(&self) -> bool {
        self.clamped
    }

    /// The way that the values are on.
    pub(crate) const fn ramp(&self) -> &Ramp<N> {
        &self.ramp
    }
}

#[cfg(test)]
#[expect(clippy::float_cmp, reason = "continuity is to the bit")]
mod tests {
    use super::*;

    #[test]
    fn a_turn_in_mid_way_is_continuous() {
        let at = |ms: i64| Timestamp::from_ns(ms * 1_000_000);
        let mut ramp = Ramp::hold([1.0, -1.0]);
        ramp.turn(at(0), Span::from_ms(100), [2.0, -3.0]);
        let before = ramp.at(at(40));
        ramp.turn(at(40), Span::from_ms(100), [0.0, 0.0]);
        assert_eq!(ramp.at(at(40)), before);
        assert_eq!(ramp.at(at(39)), before);
        assert!(ramp.at(at(140))[0].abs() < 1e-15);
    }
}
