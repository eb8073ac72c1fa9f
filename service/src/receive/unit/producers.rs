//! Whether a unit's gyro ticks come from two producers at once: that looks like an input of twice the rate, and is none.

use std::time::{Duration, Instant};

use isotherm_protocol::status::Counter;

/// How long a run that another one has followed is remembered.
const REMEMBERED: Duration = Duration::from_secs(10);
/// Returns to such a run from which on two producers are at work: one is what a late message does.
const RETURNS: u32 = 3;
/// Fewest ticks in an interval, and their smallest share, that contradict the others.
const FEWEST: u64 = 20;
const ONE_IN: u64 = 5;
/// Counters of ticks that a second producer's become.
const CONTRADICTING: [&str; 3] = ["gyro_late", "gyro_implausible", "gyro_duplicates"];

/// The runs that were heard last.
#[derive(Debug, Default)]
pub(super) struct Producers {
    current: Option<u64>,
    previous: Option<(u64, Instant)>,
    returns: u32,
    /// Ticks in, and those that contradict others, at the last look.
    before: [u64; 2],
}

impl Producers {
    /// Ticks of a run have come.
    pub(super) fn heard(&mut self, series: u64, now: Instant) {
        let Some(current) = self.current.replace(series) else { return };
        if current == series {
            return;
        }
        let remembered = |at: Instant| now.saturating_duration_since(at) < REMEMBERED;
        let returns = self.previous.is_some_and(|(previous, at)| previous == series && remembered(at));
        self.returns = if returns { self.returns.saturating_add(1) } else { 0 };
        self.previous = Some((current, now));
    }

    /// Looks at what has come since the last look; in words where two producers are at work.
    pub(super) fn look(&mut self, counters: &[Counter]) -> Option<String> {
        let value =
            |name: &str| counters.iter().find(|counter| counter.name == name).map_or(0, |it| it.value);
        let now = [value("gyro_ticks_in"), CONTRADICTING.iter().map(|name| value(name)).sum()];
        let [ticks, contradicting] = [0, 1].map(|index: usize| {
            now.get(index).zip(self.before.get(index)).map_or(0, |(now, before)| now.saturating_sub(*before))
        });
        self.before = now;
        if std::mem::take(&mut self.returns) >= RETURNS {
            let (one, other) = (self.previous.map_or(0, |(series, _)| series), self.current.unwrap_or(0));
            return Some(format!(
                "two producers: ticks of series {one} and {other} alternate; stop one of them"
            ));
        }
        let two = contradicting >= FEWEST && contradicting * ONE_IN >= ticks;
        two.then(|| {
            format!(
                "probably two producers: {contradicting} of {ticks} gyro ticks were late, contradictory or \
                 duplicates; stop one of them"
            )
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn counters(ticks: u64, late: u64) -> Vec<Counter> {
        let counter = |name: &str, value| Counter { name: name.to_owned(), value };
        vec![counter("gyro_ticks_in", ticks), counter("gyro_late", late)]
    }

    #[test]
    fn one_producer_is_one_though_it_restarts_and_sends_a_late_message() {
        let (mut producers, now) = (Producers::default(), Instant::now());
        for series in [1, 1, 2, 2, 1, 2, 2, 3, 3] {
            producers.heard(series, now);
        }
        assert_eq!(producers.look(&counters(400, 19)), None);
        assert_eq!(producers.look(&counters(800, 60)), None, "41 of 400 is below a fifth");
    }

    #[test]
    fn runs_by_turns_and_late_ticks_galore_are_two() {
        let (mut producers, now) = (Producers::default(), Instant::now());
        for series in [1, 2, 1, 2, 1] {
            producers.heard(series, now);
        }
        assert!(producers.look(&counters(400, 0)).unwrap().contains("series 2 and 1"));
        assert_eq!(producers.look(&counters(800, 0)), None, "it is over");
        assert!(producers.look(&counters(1200, 200)).unwrap().contains("200 of 400"));
    }
}
