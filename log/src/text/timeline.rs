//! Sequence number, end and duration of the ticks of one kind in a file.

use isotherm_correction::units::Span;

use crate::mapping::{Marks, TimeMapping};

/// When a tick was, and its number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Timing {
    /// Sequence number.
    pub sequence: u64,
    /// End (ns).
    pub end_ns: i64,
    /// Duration.
    pub duration: Span,
}

/// Numbers the ticks of one kind and measures their durations.
#[derive(Debug, Clone)]
pub struct Timeline {
    /// Nominal duration; zero where every tick states its own.
    tick: Span,
    /// Which end of a tick its stamp marks.
    marks: Marks,
    /// Durations are differences of stamps.
    measured: bool,
    /// Longest difference of stamps without a gap.
    longest: Option<Span>,
    /// Number of the next tick.
    next: u64,
    /// Stamp of the row before, where it is known.
    last_stamp: Option<i64>,
}

impl Timeline {
    /// Nothing numbered yet.
    #[must_use]
    pub fn new(mapping: &TimeMapping) -> Self {
        let tick = mapping.tick.unwrap_or(Span::ZERO);
        Self {
            tick,
            marks: mapping.marks,
            measured: mapping.measured,
            longest: mapping.gap_after_ticks.map(|ticks| Span::from_s(tick.as_s() * ticks)),
            next: 0,
            last_stamp: None,
        }
    }

    /// The tick of a row whose stamp marks its end, or its start where the duration is known already.
    ///
    /// `sequence` and `duration` are what the row states itself.
    pub fn tick(&mut self, stamp: i64, sequence: Option<u64>, duration: Option<Span>) -> Timing {
        let measured = self.step(stamp);
        let sequence = sequence.unwrap_or(self.next);
        self.next = sequence.saturating_add(1);
        let nominal = if self.measured && self.marks == Marks::End { measured } else { self.tick };
        let duration = duration.unwrap_or(nominal);
        let end_ns = match self.marks {
            Marks::End => stamp,
            Marks::Start => stamp.saturating_add(duration.as_ns()),
        };
        Timing { sequence, end_ns, duration }
    }

    /// Time since the stamp before, noting the gap that it may be.
    fn step(&mut self, stamp: i64) -> Span {
        let since = self.last_stamp.replace(stamp).map(|last| Span::from_ns(stamp.saturating_sub(last)));
        match (since, self.longest) {
            (Some(since), Some(longest)) if since > longest => {
                self.next = self.next.saturating_add(missing(since, self.tick));
                self.tick
            }
            (since, _) => since.unwrap_or(self.tick),
        }
    }

    /// Measured duration of a tick that began at `stamp`, once the next one began.
    pub(super) fn until(&self, stamp: i64, next: Option<i64>) -> Span {
        let Some(next) = next else { return self.tick };
        let duration = Span::from_ns(next.saturating_sub(stamp));
        if self.longest.is_some_and(|longest| duration > longest) { self.tick } else { duration }
    }

    /// Ticks that are missing before a row with this stamp, as far as stamps say.
    #[must_use]
    pub fn missing(&self, stamp: i64) -> u64 {
        let since = self.last_stamp.map(|last| Span::from_ns(stamp.saturating_sub(last)));
        match (since, self.longest) {
            (Some(since), Some(longest)) if since > longest => missing(since, self.tick),
            _ => 0,
        }
    }

    /// Whether a tick's duration is known only when the next one begins.
    pub(super) fn waits(&self, has_duration: bool) -> bool {
        self.measured && self.marks == Marks::Start && !has_duration
    }

    /// A row that could not be read: its tick becomes a gap.
    pub(super) fn skip(&mut self, stamp: Option<i64>) {
        self.next = self.next.saturating_add(1);
        self.last_stamp = stamp;
    }
}

/// Ticks that are missing where two stamps are `since` apart.
fn missing(since: Span, tick: Span) -> u64 {
    let tick = tick.as_ns().unsigned_abs().max(1);
    ((since.as_ns().unsigned_abs() + tick / 2) / tick).saturating_sub(1)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A timeline with ticks of 10 ns.
    fn timeline(marks: Marks, measured: bool, gap_after_ticks: Option<f64>) -> Timeline {
        let tick = Some(Span::from_ns(10));
        Timeline::new(&TimeMapping { stamps: None, marks, tick, measured, gap_after_ticks, origin_ns: 0 })
    }

    /// Sequence, end and duration of each stamp.
    fn run(mut timeline: Timeline, stamps: &[i64]) -> Vec<(u64, i64, i64)> {
        let timing = |stamp: &i64| {
            let timing = timeline.tick(*stamp, None, None);
            (timing.sequence, timing.end_ns, timing.duration.as_ns())
        };
        stamps.iter().map(timing).collect()
    }

    #[test]
    fn ends_durations_and_gaps() {
        let stamps = [100, 111, 120, 151];
        let measured = run(timeline(Marks::End, true, None), &stamps);
        assert_eq!(measured, [(0, 100, 10), (1, 111, 11), (2, 120, 9), (3, 151, 31)]);
        let gaps = run(timeline(Marks::End, true, Some(1.5)), &stamps);
        assert_eq!(gaps, [(0, 100, 10), (1, 111, 11), (2, 120, 9), (5, 151, 10)]);
        let starts = run(timeline(Marks::Start, false, Some(1.5)), &stamps);
        assert_eq!(starts, [(0, 110, 10), (1, 121, 10), (2, 130, 10), (5, 161, 10)]);
    }

    #[test]
    fn a_skipped_row_is_a_gap_and_does_not_stretch_the_next_tick() {
        let mut timeline = timeline(Marks::End, true, None);
        timeline.tick(100, None, None);
        timeline.skip(None);
        assert_eq!(
            timeline.tick(120, None, None),
            Timing { sequence: 2, end_ns: 120, duration: Span::from_ns(10) }
        );
        timeline.skip(Some(131));
        assert_eq!(timeline.tick(140, None, None).duration, Span::from_ns(9));
    }
}
