//! Ticks of two logs brought side by side.
//!
//! A tick is known by its sequence number and its end. Within one run of the producer both only rise, so that of two
//! different ticks the lesser one is missing in the other log. Where a restart has set one of them back, the other log is
//! searched for the tick among the next [`LOOK_AHEAD`].

use std::collections::VecDeque;

use super::account::Side;
use super::tick::LogTick;

/// How many ticks are searched where sequence number and time contradict each other.
pub const LOOK_AHEAD: usize = 1024;
/// Most ticks of one unit that wait for those of the other log; beyond them the oldest counts as missing there.
pub const MOST_WAITING: usize = 1 << 16;

/// A tick of the first log beside that of the second; at least one of them is there.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Row {
    /// Of the first log.
    pub a: Option<LogTick>,
    /// Of the second log.
    pub b: Option<LogTick>,
}

/// Aligns the ticks of one unit.
#[derive(Debug, Default)]
pub struct Aligner {
    a: VecDeque<LogTick>,
    b: VecDeque<LogTick>,
    over: bool,
}

/// Which of two fronts has no partner.
enum Step {
    Pair,
    OnlyA,
    OnlyB,
    Wait,
}

fn key(tick: &LogTick) -> (u64, i64) {
    (tick.tick.sequence, tick.tick.end_time.as_ns())
}

impl Aligner {
    /// Takes a tick of one log.
    pub fn push(&mut self, side: Side, tick: LogTick) {
        match side {
            Side::A => self.a.push_back(tick),
            Side::B => self.b.push_back(tick),
        }
    }

    /// Nothing more comes from either log.
    pub fn finish(&mut self) {
        self.over = true;
    }

    /// Ticks that wait for the other log: of the first and of the second.
    #[must_use]
    pub fn waiting(&self) -> (usize, usize) {
        (self.a.len(), self.b.len())
    }

    /// The next ticks side by side; `None` until more has been taken.
    pub fn next_row(&mut self) -> Option<Row> {
        let step = match (self.a.front(), self.b.front()) {
            (Some(a), Some(b)) => self.compare(key(a), key(b)),
            (Some(_), None) if self.over || self.a.len() > MOST_WAITING => Step::OnlyA,
            (None, Some(_)) if self.over || self.b.len() > MOST_WAITING => Step::OnlyB,
            _ => Step::Wait,
        };
        match step {
            Step::Pair => Some(Row { a: self.a.pop_front(), b: self.b.pop_front() }),
            Step::OnlyA => Some(Row { a: self.a.pop_front(), b: None }),
            Step::OnlyB => Some(Row { a: None, b: self.b.pop_front() }),
            Step::Wait => None,
        }
    }

    fn compare(&self, a: (u64, i64), b: (u64, i64)) -> Step {
        if a == b {
            return Step::Pair;
        }
        if a.0 < b.0 && a.1 < b.1 {
            return Step::OnlyA;
        }
        if a.0 > b.0 && a.1 > b.1 {
            return Step::OnlyB;
        }
        let place = |ticks: &VecDeque<LogTick>, wanted| {
            ticks.iter().take(LOOK_AHEAD).position(|tick| key(tick) == wanted)
        };
        match (place(&self.b, a), place(&self.a, b)) {
            (Some(in_b), Some(in_a)) => return if in_a <= in_b { Step::OnlyA } else { Step::OnlyB },
            (Some(_), None) => return Step::OnlyB,
            (None, Some(_)) => return Step::OnlyA,
            (None, None) => {}
        }
        if !self.over && self.a.len().min(self.b.len()) < LOOK_AHEAD {
            return Step::Wait;
        }
        match (a.0.cmp(&b.0), a.1.cmp(&b.1)) {
            // The same tick with another time, or with another number.
            (std::cmp::Ordering::Equal, _) | (_, std::cmp::Ordering::Equal) => Step::Pair,
            (_, std::cmp::Ordering::Less) => Step::OnlyA,
            (_, std::cmp::Ordering::Greater) => Step::OnlyB,
        }
    }
}

#[cfg(test)]
mod tests {
    use isotherm_correction::sample::CorrectedTick;
    use isotherm_correction::units::Timestamp;

    use super::*;

    fn tick((sequence, end_ns): (u64, i64)) -> LogTick {
        let tick =
            CorrectedTick { sequence, end_time: Timestamp::from_ns(end_ns), ..CorrectedTick::default() };
        LogTick { tick, ..LogTick::default() }
    }

    /// What becomes of two logs: `=` in both, `a` and `b` in one.
    fn align(a: &[(u64, i64)], b: &[(u64, i64)]) -> String {
        let mut aligner = Aligner::default();
        for key in a {
            aligner.push(Side::A, tick(*key));
        }
        for key in b {
            aligner.push(Side::B, tick(*key));
        }
        aligner.finish();
        let mut words = String::new();
        while let Some(row) = aligner.next_row() {
            words.push(match (row.a, row.b) {
                (Some(_), Some(_)) => '=',
                (Some(_), None) => 'a',
                _ => 'b',
            });
        }
        words
    }

    #[test]
    fn ticks_find_their_partners() {
        let run = |from: u64, to: u64, zero_ns: i64| -> Vec<(u64, i64)> {
            (from..to).map(|n| (n, zero_ns + i64::try_from(n).unwrap() * 5)).collect()
        };
        let both = |first: Vec<_>, second: Vec<_>| [first, second].concat();
        for (what, a, b, expected) in [
            ("equal", run(0, 5, 0), run(0, 5, 0), "====="),
            ("lost in b", run(0, 5, 0), both(run(0, 2, 0), run(4, 5, 0)), "==aa="),
            ("lost in a", run(3, 5, 0), run(0, 5, 0), "bbb=="),
            ("b ends early", run(0, 4, 0), run(0, 2, 0), "==aa"),
            (
                "a restart of the sequence, the last ticks before it lost in b",
                both(run(0, 5, 0), run(0, 3, 100)),
                both(run(0, 3, 0), run(0, 3, 100)),
                "===aa===",
            ),
            (
                "a restart of the clock, the first ticks behind it lost in b",
                both(run(0, 3, 1000), run(3, 6, 0)),
                both(run(0, 3, 1000), run(5, 6, 0)),
                "===aa=",
            ),
            ("another time for the same tick", vec![(0, 0), (1, 5)], vec![(0, 0), (1, 6)], "=="),
            ("nothing in common", run(0, 2, 0), run(7, 9, 0), "aabb"),
        ] {
            assert_eq!(align(&a, &b), expected, "{what}");
            let mirrored: String = expected
                .chars()
                .map(|c| {
                    if c == 'a' {
                        'b'
                    } else if c == 'b' {
                        'a'
                    } else {
                        c
                    }
                })
                .collect();
            assert_eq!(align(&b, &a), mirrored, "{what}, the other way round");
        }
    }
}
