//! Medians over rounds, and ratios to the reference.

use serde::Serialize;

use super::Measure;
use super::case::Case;
use super::round::Outcome;
use super::subject::Subject;
use crate::rounds::median;

/// One subject under one load.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Row {
    /// The load, in words.
    pub(crate) name: String,
    /// What of it was measured.
    pub(crate) measure: Measure,
    /// The load.
    pub(crate) case: Case,
    /// What stood in the middle.
    pub(crate) subject: Subject,
    /// Settings of Zenoh.
    pub(crate) profile: String,
    /// Medians over the rounds.
    pub(crate) median: Outcome,
    /// Medians of the ratios to the reference in the same round: latency at the quantiles.
    pub(crate) latency_ratio: [f64; 4],
    /// Messages per second.
    pub(crate) throughput_ratio: f64,
    /// Processor time of the middle per tick.
    pub(crate) cpu_ratio: f64,
    /// Every round.
    pub(crate) rounds: Vec<Outcome>,
}

impl Row {
    /// A row of so many rounds; `reference` has as many.
    pub(crate) fn new(
        measure: Measure,
        case: &Case,
        (subject, profile): (Subject, &str),
        rounds: Vec<Outcome>,
        reference: &[Outcome],
    ) -> Self {
        let ratio = |of: &dyn Fn(&Outcome) -> f64| {
            median(rounds.iter().zip(reference).map(|(outcome, reference)| of(outcome) / of(reference)))
        };
        let over = |of: &dyn Fn(&Outcome) -> f64| median(rounds.iter().map(of));
        let sum = |of: fn(&Outcome) -> u64| rounds.iter().map(of).sum();
        Self {
            name: case.words(),
            measure,
            case: case.clone(),
            subject,
            profile: profile.to_owned(),
            latency_ratio: std::array::from_fn(|index| ratio(&|outcome| outcome.latency_us[index])),
            throughput_ratio: ratio(&|outcome| outcome.messages_per_s),
            cpu_ratio: ratio(&|outcome| outcome.cpu_us_per_tick),
            median: Outcome {
                latency_us: std::array::from_fn(|index| over(&|outcome| outcome.latency_us[index])),
                latency_max_us: over(&|outcome| outcome.latency_max_us),
                // These are no matter of medians.
                sent: sum(|outcome| outcome.sent),
                lost: sum(|outcome| outcome.lost),
                messages_per_s: over(&|outcome| outcome.messages_per_s),
                ticks_per_s: over(&|outcome| outcome.ticks_per_s),
                cpu_us_per_tick: over(&|outcome| outcome.cpu_us_per_tick),
                cpu_share: over(&|outcome| outcome.cpu_share),
                resident_kib: rounds.iter().map(|outcome| outcome.resident_kib).max().unwrap_or(0),
                source_late_us: std::array::from_fn(|index| over(&|outcome| outcome.source_late_us[index])),
                swaps_per_unit: rounds.iter().map(|outcome| outcome.swaps_per_unit).min().unwrap_or(0),
                start_s: over(&|outcome| outcome.start_s),
                swap_ms: over(&|outcome| outcome.swap_ms),
            },
            rounds,
        }
    }
}
