//! What a unit says of itself: status, totals, counters.

use std::time::{Instant, SystemTime};

use isotherm_protocol::digest::Digest;
use isotherm_protocol::service_status::UnitSummary;
use isotherm_protocol::status::{Counter, Latency, MAX_FAULTS, PreLaunchVerdict, Status, Swaps};
use isotherm_protocol::stream::{Edge, unfit};

use super::{REFUSALS, UnitActor};
use crate::observe::totals::UnitTotals;
use crate::receive::fault::{FaultKind, standing};

/// What the swap manager tells a unit of its swaps, for its status.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(crate) struct SwapAccount {
    /// Accepted and refused ones.
    pub(crate) swaps: Swaps,
    /// Overlay that the last pre-launch calibration was stored as.
    pub(crate) overlay: Option<Digest>,
    /// What is wrong with the calibration in force: kinds of faults, with words.
    pub(crate) problems: Vec<(&'static str, String)>,
}

/// What a counter has counted; 0 where it is not there.
pub(super) fn value_of(counters: &[Counter], name: &str) -> u64 {
    counters.iter().find(|counter| counter.name == name).map_or(0, |counter| counter.value)
}

impl UnitActor {
    /// Enters what the swap manager has to say of the unit's swaps.
    pub(crate) fn tell_swaps(&mut self, account: SwapAccount) {
        if self.account != account {
            self.account = account;
            self.status_due = true;
        }
    }

    /// Counters of the stream, those before a reset included.
    pub(super) fn counters(&self) -> Vec<Counter> {
        let mut counters = self.stream.counters();
        for counter in &mut counters {
            let before = self.before_reset.iter().find(|before| before.name == counter.name);
            counter.value += before.map_or(0, |before| before.value);
        }
        counters
    }

    /// Measures the input rates anew: what the status shows until the next call.
    pub fn measure_rates(&mut self, now: Instant) {
        let counters = self.counters();
        if let Some(words) = self.arrivals.look(now, &counters) {
            self.fault(FaultKind::TwoProducers, 1, || words);
        }
        self.look_for_unfit(&counters);
    }

    /// Reports ticks that the calibration in force cannot take.
    fn look_for_unfit(&mut self, counters: &[Counter]) {
        let values = unfit::COUNTERS.map(|name| value_of(counters, name));
        let more = values.iter().sum::<u64>().saturating_sub(self.faults.count(FaultKind::Unfit));
        let Some((calibration, _)) = self.stream.unit().calibration().filter(|_| more > 0) else { return };
        let named = unfit::COUNTERS.into_iter().zip(values).find(|(_, value)| *value > 0);
        let words = named.and_then(|(name, _)| unfit::words(name, calibration)).unwrap_or_default();
        self.fault(FaultKind::Unfit, more, || format!("ticks are refused: {words}"));
    }

    /// What the unit says of itself; `instance` is the service's name for itself.
    pub(crate) fn status(&self, instance: &str) -> Status {
        let now = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH);
        let mut status = self.stream.status(Edge {
            instance,
            version: env!("CARGO_PKG_VERSION"),
            now_unix_s: now.ok().and_then(|since| i64::try_from(since.as_secs()).ok()),
            input_rates: self.arrivals.rates,
            latency: self.latency(),
            swaps: self.account.swaps.clone(),
            overlay: self.account.overlay,
            faults: self.faults.faults(),
            last_fault: self.faults.last().map(ToOwned::to_owned),
        });
        status.counters = self.counters();
        status.counters.extend(self.faults.counters());
        let problems = self.account.problems.iter().map(|(kind, words)| standing(kind, 1, words.clone()));
        let unknown = self.unknown_channels.fault(self.stream.unit(), Instant::now());
        for fault in problems.chain(unknown) {
            status.faults.truncate(MAX_FAULTS - 1);
            status.faults.push(fault);
        }
        // The core knows that it was given up, not what for.
        if let (Some(outcome), Some(reason)) = (&mut status.pre_launch_outcome, &self.notices.given_up)
            && outcome.verdict == PreLaunchVerdict::Aborted
        {
            outcome.verdict = PreLaunchVerdict::Refused(vec![format!("given up: {reason}")]);
        }
        status
    }

    /// What the unit is doing, and what becomes of its ticks.
    pub(crate) fn summary(&self) -> UnitSummary {
        let (state, output) = self.doing();
        UnitSummary { unit: self.id().to_string(), state, output }
    }

    /// Sum of the latencies that the status counts (ns).
    pub(crate) fn latency_sum_ns(&self) -> u64 {
        self.latency.sum_ns()
    }

    fn latency(&self) -> Latency {
        Latency {
            p50_ns: self.latency.quantile(0.5),
            p99_ns: self.latency.quantile(0.99),
            p999_ns: self.latency.quantile(0.999),
            max_ns: self.latency.quantile(1.0),
            buckets: self.latency.buckets(),
        }
    }

    /// The account of the unit since the service started.
    pub(crate) fn totals(&self) -> UnitTotals {
        let counters = self.counters();
        let value = |name| value_of(&counters, name);
        UnitTotals {
            ticks_in: value("gyro_ticks_in"),
            ticks_out: value("ticks_out"),
            gaps: value("gaps"),
            ticks_missed: value("ticks_missed"),
            ticks_refused: REFUSALS.iter().map(|name| value(name)).sum(),
            bad: self.faults.refused(),
            unpublished: self.faults.count(FaultKind::Unpublished),
            alarms: self.faults.count(FaultKind::Alarm),
            added_latency_p50_ns: self.latency.quantile(0.5),
            added_latency_p99_ns: self.latency.quantile(0.99),
        }
    }
}
