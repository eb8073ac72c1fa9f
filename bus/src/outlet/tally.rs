//! The account of one unit's gyro ticks: sent, under way, come back, passed over.

use std::collections::{BTreeSet, VecDeque};

use isotherm_protocol::corrected::CorrectedTick;

use super::intervals::Intervals;
use super::{Account, GyroTicks};
use crate::Continuity;

/// A batch that lies so far behind the newest tick begins anew rather than to come late: the service believes it after a
/// while, and nothing waits as long.
const ANEW: u64 = 8192;

/// The account. Ticks of a series leave the service in the order of their numbers; what is still under way when a later
/// one comes back does not come any more.
#[derive(Debug, Default)]
pub(super) struct TickTally {
    /// What is under way, by run and number.
    under_way: VecDeque<Stretch>,
    /// Ticks in it.
    ticks: u64,
    run: Run,
    /// Every series that was sent.
    series: BTreeSet<u64>,
    /// Run and number of the last tick that came back and had been under way.
    back: Option<(u64, u64)>,
    continuity: Continuity,
    account: Account,
}

/// Consecutive ticks.
#[derive(Debug, Clone, Copy)]
struct Stretch {
    run: u64,
    series: u64,
    first: u64,
    last: u64,
    /// It was sent behind a later one.
    late: bool,
}

/// What is being sent: a series, or what begins anew in one.
#[derive(Debug, Default)]
struct Run {
    number: u64,
    series: Option<u64>,
    sent: Intervals,
}

/// What became of a batch that was entered.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Sent {
    /// Ticks that had not been sent before.
    pub new: u64,
    /// Ticks that had.
    pub again: u64,
}

impl Stretch {
    fn ticks(&self) -> u64 {
        self.last - self.first + 1
    }
}

impl TickTally {
    /// Enters a batch that is about to be sent.
    pub(super) fn sent(&mut self, GyroTicks { series, first, count }: GyroTicks) -> Sent {
        if count == 0 {
            return Sent::default();
        }
        let last = first.saturating_add(count - 1);
        let newest = self.run.sent.last();
        let anew = newest.is_some_and(|newest| last.saturating_add(ANEW) < newest);
        if self.run.series.is_none_or(|run| run < series) || (self.run.series == Some(series) && anew) {
            self.account.ticks_not_sent += self.run.sent.missing();
            self.series.insert(series);
            self.run = Run { number: self.run.number + 1, series: Some(series), sent: Intervals::default() };
        } else if self.run.series != Some(series) {
            // A straggler of a series that is over: the service takes it no more.
            self.account.ticks_sent += count;
            self.account.ticks_late += count;
            return Sent { new: count, again: 0 };
        }
        let late = self.run.sent.last().is_some_and(|newest| first <= newest);
        let mut new = 0;
        for (first, last) in self.run.sent.add(first, last) {
            new += last - first + 1;
            self.enter(Stretch { run: self.run.number, series, first, last, late });
        }
        self.account.ticks_sent += new;
        self.account.ticks_sent_again += count - new;
        Sent { new, again: count - new }
    }

    /// Enters ticks that were not sent before.
    fn enter(&mut self, stretch: Stretch) {
        if self.back.is_some_and(|(run, last)| run == stretch.run && last >= stretch.last) {
            self.passed_over(stretch);
            return;
        }
        self.ticks += stretch.ticks();
        let before = |other: &Stretch| (other.run, other.first) < (stretch.run, stretch.first);
        let at = self.under_way.iter().rposition(before).map_or(0, |index| index + 1);
        self.under_way.insert(at, stretch);
    }

    /// Notes ticks that will not come back.
    fn passed_over(&mut self, stretch: Stretch) {
        let counter = if stretch.late { &mut self.account.ticks_late } else { &mut self.account.ticks_lost };
        *counter += stretch.ticks();
    }

    /// Enters a tick that came back.
    pub(super) fn came_back(&mut self, tick: &CorrectedTick) {
        let last = tick.sequence;
        let first = last.saturating_sub(u64::from(tick.ticks.max(1)) - 1);
        if tick.series != 0 && !self.series.contains(&tick.series) {
            // What was sent before this one began may still come.
            self.account.ticks_of_others += if self.back.is_some() { last - first + 1 } else { 0 };
            return;
        }
        self.continuity.feed(tick);
        // A pair may still send of the series before; without a number of its series, a tick is of any.
        let is_of = |other: &Stretch| {
            (other.first..=other.last).contains(&last) && [0, other.series].contains(&tick.series)
        };
        let Some(index) = self.under_way.iter().position(is_of) else {
            self.account.ticks_duplicated += last - first + 1;
            return;
        };
        let run = self.under_way.get(index).map_or(0, |stretch| stretch.run);
        for mut stretch in self.under_way.drain(..=index).collect::<Vec<_>>() {
            if stretch.run == run && stretch.last > last {
                let rest = Stretch { first: last + 1, ..stretch };
                self.under_way.push_front(rest);
                stretch.last = last;
            }
            self.ticks -= stretch.ticks();
            if stretch.run != run || stretch.last < first {
                self.passed_over(stretch);
                continue;
            }
            if stretch.first < first {
                self.passed_over(Stretch { last: first - 1, ..stretch });
                stretch.first = first;
            }
            self.account.ticks_back += stretch.ticks();
        }
        self.back = Some((run, last));
    }

    /// Ticks under way.
    pub(super) fn under_way(&self) -> u64 {
        self.ticks
    }

    /// The account so far.
    pub(super) fn account(&self) -> Account {
        Account {
            ticks_not_sent: self.account.ticks_not_sent + self.run.sent.missing(),
            ticks_under_way: self.ticks,
            ticks_announced_missing: self.continuity.announced_missing,
            ticks_uncalibrated: self.continuity.uncalibrated,
            restarts: self.continuity.restarts,
            runs: self.run.number,
            ..self.account
        }
    }
}

#[cfg(test)]
mod tests {

    use super::*;

    /// A tick that came back, of so many raw ones.
    fn tick(sequence: u64, ticks: u16) -> CorrectedTick {
        CorrectedTick { sequence, ticks, ..CorrectedTick::default() }
    }

    /// One thing that happens: sent (series, first, count), or back (number, raw ticks).
    enum Step {
        Sent(u64, u64, u64),
        Back(u64, u16),
    }
    use Step::{Back, Sent as Out};

    /// Sent, sent again, back, late, lost, not sent, under way.
    fn run(steps: &[Step]) -> [u64; 7] {
        let mut tally = TickTally::default();
        for step in steps {
            match *step {
                Out(series, first, count) => {
                    tally.sent(GyroTicks { series, first, count });
                }
                Back(sequence, ticks) => tally.came_back(&tick(sequence, ticks)),
            }
        }
        let account = tally.account();
        let Account { ticks_sent, ticks_sent_again, ticks_back, ticks_late, ticks_lost, .. } = account;
        let sum = ticks_back + ticks_late + ticks_lost + account.ticks_under_way;
        assert_eq!(ticks_sent, sum, "every tick that was sent is somewhere");
        let rest = [account.ticks_not_sent, account.ticks_under_way];
        [ticks_sent, ticks_sent_again, ticks_back, ticks_late, ticks_lost, rest[0], rest[1]]
    }

    #[test]
    fn what_another_one_sent_is_no_tick_of_this_one() {
        let mut tally = TickTally::default();
        let of = |series, sequence| CorrectedTick { series, ..tick(sequence, 1) };
        tally.sent(GyroTicks { series: 7, first: 0, count: 4 });
        for (series, sequence) in [(5, 900), (7, 0), (5, 901), (7, 1), (9, 3), (7, 1)] {
            tally.came_back(&of(series, sequence));
        }
        let account = tally.account();
        assert_eq!((account.ticks_back, account.ticks_of_others, account.ticks_duplicated), (2, 2, 1));
        assert_eq!((account.ticks_lost, account.restarts), (0, 0));
    }

    #[test]
    fn every_tick_sent_is_accounted_for() {
        let cases: &[(&str, &[Step], [u64; 7])] = &[
            ("whole", &[Out(1, 10, 2), Back(10, 1), Back(11, 1)], [2, 0, 2, 0, 0, 0, 0]),
            ("steps of four", &[Out(1, 0, 3), Out(1, 3, 5), Back(3, 4)], [8, 0, 4, 0, 0, 0, 4]),
            ("passed over", &[Out(1, 0, 4), Out(1, 4, 4), Back(1, 1), Back(5, 1)], [8, 0, 2, 0, 4, 0, 2]),
            ("an old number", &[Out(1, 0, 4), Back(1, 1), Back(1, 1)], [4, 0, 1, 0, 1, 0, 2]),
            ("withheld", &[Out(1, 0, 2), Out(1, 5, 2), Back(6, 1)], [4, 0, 1, 0, 3, 3, 0]),
            ("sent twice", &[Out(1, 0, 2), Out(1, 0, 2), Out(1, 1, 2), Back(2, 3)], [3, 3, 3, 0, 0, 0, 0]),
            (
                "put in order",
                &[Out(1, 0, 2), Out(1, 4, 2), Out(1, 2, 2), Back(1, 2), Back(3, 2), Back(5, 2)],
                [6, 0, 6, 0, 0, 0, 0],
            ),
            ("late, on its way", &[Out(1, 4, 2), Out(1, 2, 2), Back(5, 2)], [4, 0, 2, 2, 0, 0, 0]),
            ("late when it was sent", &[Out(1, 4, 2), Back(5, 2), Out(1, 2, 2)], [4, 0, 2, 2, 0, 0, 0]),
            ("a new series", &[Out(1, 0, 4), Out(2, 0, 4), Back(3, 4), Back(1, 2)], [8, 0, 6, 0, 0, 0, 2]),
            (
                "its end was lost",
                &[Out(1, 0, 4), Out(2, 9, 4), Back(1, 2), Back(12, 4)],
                [8, 0, 6, 0, 2, 0, 0],
            ),
            (
                "a straggler",
                &[Out(1, 0, 2), Out(2, 0, 2), Out(1, 2, 2), Back(1, 2), Back(1, 2)],
                [6, 0, 4, 2, 0, 0, 0],
            ),
            (
                "anew in a series",
                &[Out(1, 9000, 2), Out(1, 0, 2), Back(9001, 2), Back(1, 2)],
                [4, 0, 4, 0, 0, 0, 0],
            ),
        ];
        for (name, steps, expected) in cases {
            assert_eq!(run(steps), *expected, "{name}");
        }
    }
}
