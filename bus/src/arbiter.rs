//! Several services correct one unit: each tick is used from the one that sends it first.

use isotherm_correction::sample::TickFlags;
use isotherm_protocol::corrected::CorrectedTick;

/// Runs of the producer that are remembered, the present one included: a service may lag behind as many restarts less one.
pub const RUNS: usize = 4;
/// Outputs that a service may lag behind: about as many as one holds.
const MOST_BEHIND: u64 = 8192;
/// With `RESTART`: beyond, a producer counts from the beginning again.
const MOST_BEHIND_RESTART: u64 = 512;

/// What was used of a run of the producer.
#[derive(Debug, Clone, Copy)]
struct Run {
    series: u64,
    /// The highest number.
    sequence: u64,
    /// The latest end: the clock may have stepped back since.
    end_time_ns: i64,
}

/// First wins, for one unit (docs/wire.md).
///
/// What is late is dropped: a tick that one service's message lost is not filled in from the other after a later one was used.
#[derive(Debug, Clone, Default)]
pub struct FirstWins {
    /// The present one first.
    runs: [Option<Run>; RUNS],
    dropped: u64,
}

impl FirstWins {
    /// Whether a tick is to be used.
    pub fn wins(&mut self, tick: &CorrectedTick) -> bool {
        let CorrectedTick { series, sequence, end_time, flags, .. } = *tick;
        let (end_time_ns, ticks) = (end_time.as_ns(), u64::from(tick.ticks.max(1)));
        let first = sequence.saturating_sub(ticks - 1);
        let restarts = flags.contains(TickFlags::RESTART);
        let most = if restarts { MOST_BEHIND_RESTART } else { MOST_BEHIND };
        let is_near = |distance: u64| distance / ticks < most;

        let [current, before @ ..] = &self.runs;
        let current = current.filter(|run| run.series == series);
        let goes_on = current.filter(|run| first > run.sequence && is_near(first - run.sequence));
        let is_used = current.is_some_and(|run| {
            let overlaps = sequence > run.sequence;
            first <= run.sequence
                && (end_time_ns <= run.end_time_ns || overlaps)
                && is_near(run.sequence.saturating_sub(sequence))
        });
        let is_of_before = before.iter().flatten().filter(|run| run.series == series).any(|run| {
            if first > run.sequence {
                // The end of a run, which the other service's message lost.
                return current.is_none() && !restarts && is_near(first - run.sequence);
            }
            let back = run.sequence.saturating_sub(sequence);
            // Numbers and time began again: the present run comes past this one's.
            let passes = |now: Run| end_time_ns > now.end_time_ns && first - now.sequence - 1 <= back;
            end_time_ns <= run.end_time_ns && is_near(back) && !goes_on.is_some_and(passes)
        });
        if is_used || is_of_before {
            self.dropped += 1;
            return false;
        }
        if goes_on.is_none() {
            self.runs.rotate_right(1);
        }
        let latest = goes_on.map_or(end_time_ns, |run| run.end_time_ns.max(end_time_ns));
        if let Some(current) = self.runs.first_mut() {
            *current = Some(Run { series, sequence, end_time_ns: latest });
        }
        true
    }

    /// Outputs that were dropped: they, or a part of them, had been used.
    #[must_use]
    pub fn dropped(&self) -> u64 {
        self.dropped
    }
}

#[cfg(test)]
mod tests {
    use isotherm_correction::units::{Span, Timestamp};

    use super::*;
    use crate::Continuity;

    /// What the clients in every language make of these ticks.
    const CASES: &str = include_str!("../../clients/cases.txt");

    #[test]
    fn the_cases_of_all_clients_hold() {
        let (mut name, mut arbiter, mut account) = ("", None, Continuity::default());
        let (mut verdicts, mut cases) = (String::new(), 0);
        for line in CASES.lines().filter(|line| !line.starts_with('#') && !line.is_empty()) {
            let words: Vec<&str> = line.split_whitespace().collect();
            match words.as_slice() {
                ["=", case, which] => {
                    name = case;
                    arbiter = (*which == "first-wins").then(FirstWins::default);
                    (account, verdicts) = (Continuity::default(), String::new());
                }
                [">", expected, figures @ ..] => {
                    let Continuity { ticks, announced_missing, lost, duplicated, restarts, .. } = account;
                    let own = [ticks, announced_missing, lost, duplicated, restarts];
                    let figures: Vec<u64> = figures.iter().map(|figure| figure.parse().unwrap()).collect();
                    assert_eq!(
                        (verdicts.as_str(), own.as_slice()),
                        (*expected, figures.as_slice()),
                        "{name}"
                    );
                    cases += 1;
                }
                [series, sequence, end_time_ns, duration_ns, ticks, missed, restart] => {
                    let tick = CorrectedTick {
                        series: series.parse().unwrap(),
                        sequence: sequence.parse().unwrap(),
                        end_time: Timestamp::from_ns(end_time_ns.parse().unwrap()),
                        duration: Span::from_ns(duration_ns.parse().unwrap()),
                        ticks: ticks.parse().unwrap(),
                        missed: missed.parse().unwrap(),
                        flags: if *restart == "1" { TickFlags::RESTART } else { TickFlags::empty() },
                        ..CorrectedTick::default()
                    };
                    let used = arbiter.as_mut().is_none_or(|it| it.wins(&tick));
                    verdicts.push(if used { 'u' } else { 'd' });
                    if used {
                        account.feed(&tick);
                    }
                }
                other => panic!("{other:?}"),
            }
        }
        assert!(cases > 10, "{cases}");
    }
}
