//! Which ticks of a stream are there: gaps, duplicates, late ones, beginnings anew.

use std::collections::VecDeque;

use serde::Serialize;

/// Gaps that may still be filled by late ticks; older ones are taken as final.
const OPEN_HOLES: usize = 256;
/// So many ticks in a row whose sequence and time both lie in the past are a stream that has begun anew.
const ANEW_AFTER: u64 = 256;

/// A gap: ticks that are nowhere in the log.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Gap {
    /// Ticks missing.
    pub ticks: u64,
    /// Sequence number of the first of them.
    pub first_sequence: u64,
    /// End of the tick before it (ns on the producer's clock).
    pub after_ns: i64,
}

/// The gaps of a stream.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
pub struct Gaps {
    /// How many.
    pub count: u64,
    /// Ticks missing in all of them.
    pub missing_ticks: u64,
    /// The longest, the first of several.
    pub longest: Option<Gap>,
}

/// What a stream's sequence numbers come to.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
pub struct Order {
    /// Ticks that are nowhere in the log.
    pub gaps: Gaps,
    /// Ticks that came once more.
    pub duplicates: u64,
    /// Ticks that came behind later ones.
    pub late: u64,
    /// Times that the sequence began anew, another series or not.
    pub restarts: u64,
    /// Times that the number of the producer's run changed.
    pub series_changes: u64,
}

/// Consecutive ticks, as a batch has them.
#[derive(Debug, Clone, Copy)]
pub(super) struct Run {
    /// `None` where nothing says it.
    pub(super) series: Option<u64>,
    pub(super) first: u64,
    pub(super) ticks: u64,
    /// End of the first tick (ns).
    pub(super) first_end_ns: i64,
    /// End of the last tick (ns).
    pub(super) last_end_ns: i64,
}

/// How a run stands to what came before.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Place {
    /// It is the first, or the first of a sequence that begins anew.
    Start,
    /// It begins right behind the newest tick.
    Next,
    /// It begins behind a gap.
    BehindGap,
    /// Some of it, or all, was passed already.
    Old,
}

/// Follows the sequence numbers of one stream.
#[derive(Debug, Clone, Default)]
pub(super) struct Sequence {
    series: Option<u64>,
    /// The series that the present one took over from.
    superseded: Option<u64>,
    /// The number behind the newest tick.
    next: Option<u64>,
    newest_end_ns: i64,
    /// Gaps that may still be filled, by their place.
    open: VecDeque<Gap>,
    /// Old ticks in a row: the number behind them, and how many.
    old: Option<(u64, u64)>,
    order: Order,
}

impl Sequence {
    /// Takes the next run.
    pub(super) fn take(&mut self, run: Run) -> Place {
        if self.series.zip(run.series).is_some_and(|(series, of_run)| series != of_run) {
            if self.superseded == run.series {
                // Stragglers end; a run that goes on was interrupted by a stray tick of another.
                let in_a_row = self.in_a_row(run);
                self.order.late += run.ticks;
                self.old = Some((run.first.saturating_add(run.ticks), in_a_row));
                if in_a_row <= ANEW_AFTER {
                    return Place::Old;
                }
                self.order.late = self.order.late.saturating_sub(in_a_row);
            } else if let Some((next, ticks)) = self.old
                && next == run.first
            {
                // Accelerometers may come before the gyros that state their series.
                self.order.duplicates = self.order.duplicates.saturating_sub(ticks);
            }
            self.superseded = self.series;
            self.order.series_changes += 1;
            self.series = run.series;
            return self.begin_anew(run);
        }
        self.series = run.series.or(self.series);
        let end = run.first.saturating_add(run.ticks);
        let Some(next) = self.next else {
            self.go_on(run);
            return Place::Start;
        };
        let later = run.last_end_ns > self.newest_end_ns;
        if end <= next {
            return if run.first_end_ns > self.newest_end_ns {
                self.begin_anew(run)
            } else {
                self.take_old(run)
            };
        }
        if !later {
            return self.begin_anew(run);
        }
        self.old = None;
        let place = match run.first.checked_sub(next) {
            Some(0) => Place::Next,
            Some(missing) => {
                let after_ns = self.newest_end_ns;
                self.open.push_back(Gap { ticks: missing, first_sequence: next, after_ns });
                if self.open.len() > OPEN_HOLES
                    && let Some(gap) = self.open.pop_front()
                {
                    close(&mut self.order.gaps, gap);
                }
                Place::BehindGap
            }
            None => {
                self.fill(run.first, next - run.first);
                Place::Old
            }
        };
        self.go_on(run);
        place
    }

    /// What it comes to so far.
    pub(super) fn order(&self) -> Order {
        let mut order = self.order;
        self.open.iter().for_each(|gap| close(&mut order.gaps, *gap));
        order
    }

    fn go_on(&mut self, run: Run) {
        self.next = Some(run.first.saturating_add(run.ticks));
        self.newest_end_ns = run.last_end_ns;
    }

    fn begin_anew(&mut self, run: Run) -> Place {
        while let Some(gap) = self.open.pop_front() {
            close(&mut self.order.gaps, gap);
        }
        self.order.restarts += 1;
        self.old = None;
        self.go_on(run);
        Place::Start
    }

    /// A run that lies in the past altogether.
    fn take_old(&mut self, run: Run) -> Place {
        let end = run.first.saturating_add(run.ticks);
        let in_a_row = self.in_a_row(run);
        let doubled = self.fill(run.first, run.ticks);
        // Ticks that fill gaps are late; a stretch that repeats what is there may be a producer that was switched off and on.
        if doubled == run.ticks && in_a_row > ANEW_AFTER {
            self.order.duplicates = self.order.duplicates.saturating_sub(in_a_row);
            return self.begin_anew(run);
        }
        self.old = (doubled == run.ticks).then_some((end, in_a_row));
        Place::Old
    }

    /// Old ticks in a row, this run's included.
    fn in_a_row(&self, run: Run) -> u64 {
        match self.old {
            Some((next, ticks)) if run.first >= next => ticks + run.ticks,
            _ => run.ticks,
        }
    }

    /// Enters ticks that are older than the newest: late where they were missing, else doubled. Gives the doubled ones.
    fn fill(&mut self, first: u64, ticks: u64) -> u64 {
        let end = first.saturating_add(ticks);
        let mut late = 0;
        let mut index = 0;
        while let Some(gap) = self.open.get(index).copied() {
            let gap_end = gap.first_sequence + gap.ticks;
            let (from, to) = (gap.first_sequence.max(first), gap_end.min(end));
            if from >= to {
                index += 1;
                continue;
            }
            late += to - from;
            self.open.remove(index);
            let rests = [(gap.first_sequence, from), (to, gap_end)];
            for (from, to) in rests.into_iter().filter(|(from, to)| to > from) {
                self.open
                    .insert(index, Gap { ticks: to - from, first_sequence: from, after_ns: gap.after_ns });
                index += 1;
            }
        }
        let doubled = ticks - late;
        self.order.late += late;
        self.order.duplicates += doubled;
        doubled
    }
}

/// Takes a gap as final.
fn close(gaps: &mut Gaps, gap: Gap) {
    gaps.count += 1;
    gaps.missing_ticks = gaps.missing_ticks.saturating_add(gap.ticks);
    if gaps.longest.is_none_or(|longest| gap.ticks > longest.ticks) {
        gaps.longest = Some(gap);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Ticks of 10 ns whose time follows their number, in a run.
    fn run(first: u64, ticks: u64) -> Run {
        let end = |sequence: u64| i64::try_from(sequence).unwrap() * 10 + 10;
        Run { series: Some(0), first, ticks, first_end_ns: end(first), last_end_ns: end(first + ticks - 1) }
    }

    fn order(runs: &[Run]) -> Order {
        let mut sequence = Sequence::default();
        for run in runs {
            sequence.take(*run);
        }
        sequence.order()
    }

    #[test]
    fn gaps_are_counted_and_the_longest_is_known() {
        let order = order(&[run(5, 5), run(12, 3), run(15, 5), run(30, 1)]);
        let longest = Gap { ticks: 10, first_sequence: 20, after_ns: 200 };
        assert_eq!(order.gaps, Gaps { count: 2, missing_ticks: 12, longest: Some(longest) });
        assert_eq!((order.duplicates, order.late, order.restarts), (0, 0, 0));
    }

    #[test]
    fn late_ticks_fill_gaps_and_what_was_there_is_doubled() {
        let order = order(&[run(0, 10), run(20, 10), run(12, 3), run(5, 2), run(8, 3), run(28, 4)]);
        // Of 10…19, ticks 12, 13, 14 and 10 came late; 5, 6, 8, 9 and 28, 29 came twice.
        assert_eq!((order.late, order.duplicates), (4, 6));
        assert_eq!((order.gaps.count, order.gaps.missing_ticks), (2, 6));
        assert_eq!(order.gaps.longest.map(|gap| (gap.first_sequence, gap.ticks)), Some((15, 5)));
    }

    #[test]
    fn another_series_or_a_sequence_that_falls_back_begins_anew() {
        let mut other = run(0, 10);
        other.series = Some(1);
        let found = order(&[run(100, 10), other, run(110, 5)]);
        assert_eq!((found.series_changes, found.restarts, found.late, found.gaps.count), (1, 1, 5, 0));

        let mut later = run(0, 10);
        (later.first_end_ns, later.last_end_ns) = (5000, 5090);
        assert_eq!(order(&[run(100, 10), later]).restarts, 1, "time goes on, the sequence does not");

        let mut runs: Vec<_> = (0..100).map(|batch| run(batch * 10, 10)).collect();
        runs.extend((0..60).map(|batch| run(batch * 10, 10)));
        let found = order(&runs);
        assert_eq!((found.restarts, found.duplicates), (1, 0), "switched off and on: {found:?}");
    }

    #[test]
    fn open_gaps_are_bounded() {
        let mut sequence = Sequence::default();
        (0..10_000).for_each(|index| {
            sequence.take(run(index * 2, 1));
        });
        assert!(sequence.open.len() <= OPEN_HOLES);
        assert_eq!(sequence.order().gaps.count, 9_999);
        assert_eq!(sequence.take(run(19_000 + 501, 1)), Place::Old);
        assert_eq!(sequence.order().late, 1);
    }
}
