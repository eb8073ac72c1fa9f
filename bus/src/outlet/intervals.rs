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
    /// Numbers between the first and the last that are not in it.
    missing: u64,
}

impl Intervals {
    /// The largest number.
    pub(super) fn last(&self) -> Option<u64> {
        self.stretches.back().map(|(_, last)| *last)
    }

    /// Numbers between the smallest and the largest that are not in it.
    pub(super) fn missing(&self) -> u64 {
        self.missing
    }

    /// Adds the numbers from `first` to `last`; gives those that are new, as stretches.
    pub(super) fn add(&mut self, first: u64, last: u64) -> Vec<(u64, u64)> {
        let first = self.forgotten.map_or(first, |forgotten| first.max(forgotten.saturating_add(1)));
        if first > last {
            return Vec::new();
        }
        // The usual case: it goes on where the last stretch ends, or behind a hole.
        match self.stretches.back_mut() {
            None => {
                self.stretches.push_back((first, last));
                return vec![(first, last)];
            }
            Some((_, end)) if first.checked_sub(1) == Some(*end) => {
                *end = last;
                return vec![(first, last)];
            }
            Some((_, end)) if first > *end => {
                self.missing = self.missing.saturating_add(first - *end - 1);
                self.push_back(first, last);
                return vec![(first, last)];
            }
            Some(_) => {}
        }
        self.fill(first, last)
    }

    /// Adds numbers of which some lie before the last.
    fn fill(&mut self, first: u64, last: u64) -> Vec<(u64, u64)> {
        let (mut new, mut next) = (Vec::new(), first);
        for &(begin, end) in &self.stretches {
            if next > last || begin > last {
                break;
            }
            if next < begin {
                new.push((next, begin - 1));
            }
            next = next.max(end.saturating_add(1));
        }
        if next <= last {
            new.push((next, last));
        }
        let (smallest, largest) = match (self.stretches.front(), self.stretches.back()) {
            (Some((smallest, _)), Some((_, largest))) => (*smallest, *largest),
            _ => (first, last),
        };
        for &(begin, end) in &new {
            if end < smallest {
                self.missing = self.missing.saturating_add(smallest - end - 1);
            } else if begin <= largest {
                self.missing = self.missing.saturating_sub(end - begin + 1);
            }
        }
        self.join(first, last);
        new
    }

    /// Makes one stretch of `first` to `last` and of what touches them.
    fn join(&mut self, first: u64, last: u64) {
        let touches =
            |&(begin, end): &(u64, u64)| begin <= last.saturating_add(1) && first <= end.saturating_add(1);
        let at = self.stretches.iter().position(|stretch| stretch.1.saturating_add(1) >= first);
        let at = at.unwrap_or(self.stretches.len());
        let (mut begin, mut end) = (first, last);
        while self.stretches.get(at).is_some_and(touches) {
            if let Some((other_begin, other_end)) = self.stretches.remove(at) {
                (begin, end) = (begin.min(other_begin), end.max(other_end));
            }
        }
        self.stretches.insert(at, (begin, end));
    }

    fn push_back(&mut self, first: u64, last: u64) {
        self.stretches.push_back((first, last));
        if self.stretches.len() > MAX_STRETCHES
            && let Some((_, last)) = self.stretches.pop_front()
        {
            self.forgotten = Some(last);
        }
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
