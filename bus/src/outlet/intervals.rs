//! Which sequence numbers of a series have been sent.

use std::collections::VecDeque;

/// Most stretches that are remembered; what lies before them counts as sent.
const MAX_STRETCHES: usize = 1024;

/// Sequence numbers as stretches without holes, ascending.
#[derive(Debug, Default)]
pub(super) struct Intervals {
    /// First and last of each stretch.
    stretches: VecDeque<(u64, u64)>,
    /// Everything up to here counts as in it.
    forgotten: Option<u64>,
    /// The smallest number ever added.
    smallest: Option<u64>,
    /// How many there are.
    count: u64,
}

impl Intervals {
    /// The largest number.
    pub(super) fn last(&self) -> Option<u64> {
        self.stretches.back().map(|(_, last)| *last)
    }

    /// Numbers between the smallest and the largest that are not in it.
    pub(super) fn missing(&self) -> u64 {
        let ends = self.last().zip(self.smallest);
        ends.map_or(0, |(last, smallest)| (last - smallest).saturating_add(1).saturating_sub(self.count))
    }

    /// Adds the numbers from `first` to `last`; gives those that are new, as stretches.
    pub(super) fn add(&mut self, first: u64, last: u64) -> Vec<(u64, u64)> {
        let first = self.forgotten.map_or(first, |forgotten| first.max(forgotten.saturating_add(1)));
        if first > last {
            return Vec::new();
        }
        // What touches them becomes one stretch with them.
        let from = self.stretches.partition_point(|(_, end)| end.saturating_add(1) < first);
        let to = self.stretches.partition_point(|(begin, _)| *begin <= last.saturating_add(1));
        let (mut new, mut next, mut joined) = (Vec::new(), first, (first, last));
        for (begin, end) in self.stretches.drain(from..to) {
            if next < begin {
                new.push((next, begin - 1));
            }
            next = next.max(end.saturating_add(1));
            joined = (joined.0.min(begin), joined.1.max(end));
        }
        if next <= last {
            new.push((next, last));
        }
        self.stretches.insert(from, joined);
        let count: u64 = new.iter().map(|(first, last)| last - first + 1).sum();
        self.count = self.count.saturating_add(count);
        self.smallest = Some(self.smallest.map_or(first, |smallest| smallest.min(first)));
        if self.stretches.len() > MAX_STRETCHES {
            self.forgotten = self.stretches.pop_front().map(|(_, last)| last);
        }
        new
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_new_and_what_is_missing_is_right_for_any_order() {
        // Against a plain set, over orders made by a small congruential sequence.
        let mut state = 1u64;
        for _ in 0..200 {
            let (mut intervals, mut set) = (Intervals::default(), std::collections::BTreeSet::new());
            for _ in 0..40 {
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                let (first, count) = (100 + (state >> 33) % 60, 1 + (state >> 50) % 5);
                let last = first + count - 1;
                let new: Vec<_> = intervals.add(first, last).iter().flat_map(|&(a, b)| a..=b).collect();
                let expected: Vec<_> = (first..=last).filter(|number| set.insert(*number)).collect();
                assert_eq!(new, expected);
                let span = set.last().unwrap() - set.first().unwrap() + 1;
                assert_eq!(intervals.missing(), span - set.len() as u64, "{set:?}");
                assert_eq!(intervals.last(), set.last().copied());
            }
        }
    }

    #[test]
    fn its_memory_is_bounded() {
        let mut intervals = Intervals::default();
        for number in 0..10_000 {
            assert_eq!(intervals.add(2 * number, 2 * number).len(), 1);
        }
        assert_eq!((intervals.stretches.len(), intervals.missing()), (MAX_STRETCHES, 9_999));
        assert!(intervals.add(1, 1).is_empty(), "counts as sent");
    }
}
