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
    /// Number that a row stated last.
    stated: Option<u64>,
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
            stated: None,
            last_stamp: None,
        }
    }

    /// The tick of a row whose stamp marks its end, or its start where the duration is known already.
    ///
    /// `sequence` and `duration` are what the row states itself.
    pub fn tick(&mut self, stamp: i64, sequence: Option<u64>, duration: Option<Span>) -> Timing {
        let measured = self.step(stamp);
        let measured = self.one_tick(measured, sequence);
        self.stated = sequence.or(self.stated);
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

    /// Measured duration of a tick that began at `stamp`, once the next one began, which may state its number.
    pub(super) fn until(&self, stamp: i64, next: Option<(i64, Option<u64>)>) -> Span {
        let Some((next, sequence)) = next else { return self.tick };
        let duration = Span::from_ns(next.saturating_sub(stamp));
        if self.longest.is_some_and(|longest| duration > longest) {
            return self.tick;
        }
        self.one_tick(duration, sequence)
    }

    /// Whether the number that a row states begins anew: rows come in order of time, so that it is neither late nor double.
    pub(super) fn begins_anew(&self, sequence: Option<u64>) -> bool {
        sequence.zip(self.stated).is_some_and(|(sequence, last)| sequence <= last)
    }

    /// What of a time between two stamps is one tick: not the ticks that the second one's number shows to be missing, nor a pause
    /// before numbers that begin anew.
    fn one_tick(&self, measured: Span, sequence: Option<u64>) -> Span {
        let gap = sequence.is_some_and(|sequence| sequence > self.next);
        let pause = self.begins_anew(sequence) && missing(measured, self.tick) > 0;
        if gap || pause { self.tick } else { measured }
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
    fn a_number_that_jumps_or_begins_anew_leaves_its_tick_as_long_as_others() {
        // Stamp, number, and the duration that comes of it.
        let rows = [
            (100, 7, 10),
            (111, 8, 11),
            (131, 10, 10),
            (140, 11, 9),
            (180, 15, 10),
            (191, 0, 11),
            (900, 0, 10),
        ];
        let mut timeline = timeline(Marks::End, true, None);
        for (stamp, sequence, duration) in rows {
            let timing = timeline.tick(stamp, Some(sequence), None);
            assert_eq!((timing.sequence, timing.duration.as_ns()), (sequence, duration), "{stamp}");
        }
        for (next, duration) in [(Some(1), 12), (Some(3), 10), (Some(0), 12), (None, 12)] {
            assert_eq!(timeline.until(900, Some((912, next))).as_ns(), duration, "{next:?}");
        }
        assert_eq!(timeline.until(900, Some((925, Some(0)))).as_ns(), 10, "a pause");
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
