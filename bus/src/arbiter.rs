//! Several services correct one unit: each tick is used from the one that sends it first.

use isotherm_protocol::corrected::CorrectedTick;

/// Runs of the producer that are remembered, the present one included: a service may lag behind as many restarts less one.
pub const RUNS: usize = 4;
/// Longest duration of a raw tick that counts (ns).
const LONGEST_NS: i128 = 10_000_000_000;
/// Most ticks between two of one run.
const MOST_STEPS: i128 = 1 << 20;

/// The last tick used of a run of the producer.
#[derive(Debug, Clone, Copy)]
struct Run {
    series: u64,
    sequence: u64,
    end_time_ns: i64,
}

impl Run {
    /// Whether a tick is of this run's series, and its sequence and time on this run's line.
    fn has(&self, tick: &CorrectedTick) -> bool {
        let CorrectedTick { series, sequence, end_time, duration, ticks, .. } = *tick;
        if series != self.series {
            return false;
        }
        let steps = i128::from(sequence) - i128::from(self.sequence);
        if steps.abs() > MOST_STEPS {
            return false;
        }
        let duration = i128::from(duration.as_ns().unsigned_abs() / u64::from(ticks.max(1))).min(LONGEST_NS);
        let line = steps * duration;
        let apart = (i128::from(end_time.as_ns()) - i128::from(self.end_time_ns) - line).abs();
        apart <= duration / 2 + line.abs() / 8
    }
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
        let CorrectedTick { series, sequence, end_time, ticks, .. } = *tick;
        let [current, before @ ..] = &self.runs;
        let is_of = |run: &Option<Run>| run.is_some_and(|run| run.has(tick));
        let wins = match current {
            Some(run) if is_of(current) => {
                sequence.saturating_sub(u64::from(ticks.max(1)) - 1) > run.sequence
            }
            _ if before.iter().any(is_of) => false,
            _ => {
                self.runs.rotate_right(1);
                true
            }
        };
        if wins {
            if let Some(current) = self.runs.first_mut() {
                *current = Some(Run { series, sequence, end_time_ns: end_time.as_ns() });
            }
        } else {
            self.dropped += 1;
        }
        wins
    }

    /// Outputs that were dropped: they, or a part of them, had been used.
    #[must_use]
    pub fn dropped(&self) -> u64 {
        self.dropped
    }
}

#[cfg(test)]
mod tests {
    use isotherm_correction::sample::TickFlags;
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
