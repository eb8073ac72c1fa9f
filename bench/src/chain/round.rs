//! One round of one subject: three processes from their start to their end.

use std::fs;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::ScopedJoinHandle;
use std::time::{Duration, Instant};

use hdrhistogram::Histogram;
use serde::{Deserialize, Serialize};

use super::case::{Beside, Case};
use super::profile::Profile;
use super::subject::{self, Subject};
use super::{check, page, swap};
use crate::error::Error;
use crate::machine::Usage;
use crate::part::{Plan, Ready, Received, Sent};
use crate::process::{Process, this};

/// How long a part may take to be ready.
const READY_LIMIT: Duration = Duration::from_secs(120);
/// Quantiles that are told.
pub(crate) const QUANTILES: [f64; 4] = [0.5, 0.9, 0.99, 0.999];
/// Longest latency that is told apart (ns).
const LONGEST_NS: u64 = 60_000_000_000;

/// What came of a round.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub(crate) struct Outcome {
    /// End-to-end latency at the quantiles (µs): from before the tick is handed to Zenoh until the sink's callback is called.
    pub(crate) latency_us: [f64; 4],
    /// Greatest latency (µs).
    pub(crate) latency_max_us: f64,
    /// Ticks that the source sent.
    pub(crate) sent: u64,
    /// Ticks that did not come to the sink.
    pub(crate) lost: u64,
    /// Messages per second at the sink.
    pub(crate) messages_per_s: f64,
    /// Ticks per second at the sink.
    pub(crate) ticks_per_s: f64,
    /// Processor time of the middle per tick (µs).
    pub(crate) cpu_us_per_tick: f64,
    /// Share of one core that it took.
    pub(crate) cpu_share: f64,
    /// Its resident memory at the end (KiB).
    pub(crate) resident_kib: u64,
    /// How far the source was behind its times, in the median, 99 of 100 times, and at most (µs).
    pub(crate) source_late_us: [f64; 3],
    /// Calibrations that each unit was given while it ran, at least.
    pub(crate) swaps_per_unit: u64,
    /// From the start of the middle until it was ready (s).
    pub(crate) start_s: f64,
    /// From the question until the answer of a swap, in the median (ms); 0 where none was timed.
    pub(crate) swap_ms: f64,
}

/// Runs one round.
pub(crate) fn run(case: &Case, subject: Subject, profile: &Profile) -> Result<Outcome, Error> {
    let folder = tempfile::tempdir().map_err(|source| Error::file(&std::env::temp_dir(), source))?;
    let mut plan = case.plan(folder.path(), subject);
    let plan_file = folder.path().join("plan.json");
    let write = |plan: &Plan| {
        let text = serde_json::to_string(plan).unwrap_or_default();
        fs::write(&plan_file, text).map_err(|source| Error::file(&plan_file, source))
    };
    write(&plan)?;
    let starting = Instant::now();
    let (middle, locator, http) = subject::start(&plan, &plan_file, profile)?;
    let start_s = starting.elapsed().as_secs_f64();
    plan.connect.push(locator);
    let mut middle = vec![middle];
    let is_pair = case.beside == Some(Beside::Standby);
    if is_pair {
        let (standby, locator, _) = subject::start(&plan, &plan_file, profile)?;
        middle.push(standby);
        plan.connect.push(locator);
    }
    write(&plan)?;
    let part = |name: &'static str| {
        let mut command = std::process::Command::new(this()?);
        command.args(["part", name]).arg(&plan_file);
        Process::start(name, &mut command, &plan.folder)
    };
    let mut sink = part("sink")?;
    let _: Ready = sink.hear(READY_LIMIT)?;
    let mut source = part("source")?;
    let _: Ready = source.hear(READY_LIMIT)?;
    for part in [&mut source, &mut sink] {
        part.tell("prelude")?;
    }
    for part in [&source, &sink] {
        let _: Ready = part.hear(READY_LIMIT)?;
    }

    let before = usage(&middle)?;
    let ended = AtomicBool::new(false);
    let (sent, received) = std::thread::scope(|scope| {
        let beside = scope.spawn(|| match (case.beside, &http) {
            (Some(Beside::Swaps), _) => swap::again_and_again(&plan, &ended),
            (Some(Beside::Pages), Some(address)) => page::look(address, &ended),
            _ => Ok(()),
        });
        let measured = measure(&mut source, &mut sink, case);
        ended.store(true, Ordering::Relaxed);
        let beside = joined(beside);
        measured.and_then(|measured| beside.map(|()| measured))
    })?;
    let after = usage(&middle)?;
    let swap_ms = swap::timed(&plan)?;
    check::check(&plan, &received)?;
    if is_pair {
        check::is_pair(&plan)?;
    }
    let used = Usage { cpu_s: after.cpu_s - before.cpu_s, ..after };
    let outcome = Outcome { start_s, swap_ms, ..outcome(&plan, (&sent, &received), used)? };
    if case.beside == Some(Beside::Swaps) && outcome.swaps_per_unit == 0 {
        return Err(subject.wrong("a unit was given no other calibration".to_owned()));
    }
    Ok(outcome)
}

/// Has the source send everything, and the sink take it.
fn measure(source: &mut Process, sink: &mut Process, case: &Case) -> Result<(Sent, Received), Error> {
    source.tell("go")?;
    let sent: Sent = source.hear(case.limit() + READY_LIMIT)?;
    sink.tell(&sent.messages.to_string())?;
    Ok((sent, sink.hear(READY_LIMIT)?))
}

/// What came of a thread.
pub(super) fn joined(thread: ScopedJoinHandle<'_, Result<(), Error>>) -> Result<(), Error> {
    let gone = |_| Error::of("thread")("has ended with a panic");
    thread.join().map_err(gone)?
}

/// What the processes of the middle have used together.
fn usage(middle: &[Process]) -> Result<Usage, Error> {
    let each: Vec<Usage> = middle.iter().map(Process::usage).collect::<Result<_, _>>()?;
    Ok(Usage {
        cpu_s: each.iter().map(|one| one.cpu_s).sum(),
        resident_kib: each.iter().map(|one| one.resident_kib).sum(),
    })
}

/// Puts together what the parts have written down.
#[expect(clippy::cast_precision_loss, reason = "far below 2⁵³")]
fn outcome(plan: &Plan, (sent, received): (&Sent, &Received), used: Usage) -> Result<Outcome, Error> {
    let case = &plan.case;
    let [sent_ns, came_ns]: [Vec<u64>; 2] = [plan.load("sent.bin")?, plan.load("came.bin")?];
    let latencies = Histogram::<u64>::new_with_bounds(1, LONGEST_NS, 3);
    let mut latencies = latencies.map_err(Error::of("latencies"))?;
    for (unit, came) in came_ns.chunks(plan.ticks().max(1)).enumerate() {
        for (message, came) in came
            .chunks(case.batch)
            .enumerate()
            .take(plan.prelude + sent.messages)
            .skip(plan.prelude + case.warm_up_messages())
        {
            let Some(went) = sent_ns.get(message * case.units + unit) else { continue };
            for came in came.iter().filter(|came| **came > 0) {
                latencies.saturating_record(came.saturating_sub(*went).max(1));
            }
        }
    }
    let us = |ns: u64| ns as f64 * 1e-3;
    let total = (sent.messages * case.units * case.batch) as u64;
    let seconds = (received.between_ns[1] - received.between_ns[0]) as f64 * 1e-9;
    Ok(Outcome {
        latency_us: QUANTILES.map(|share| us(latencies.value_at_quantile(share))),
        latency_max_us: us(latencies.max()),
        sent: total,
        lost: total - received.ticks.min(total),
        messages_per_s: received.messages as f64 / seconds,
        ticks_per_s: received.ticks as f64 / seconds,
        cpu_us_per_tick: used.cpu_s * 1e6 / total as f64,
        cpu_share: used.cpu_s / sent.seconds,
        resident_kib: used.resident_kib,
        source_late_us: sent.late_us,
        swaps_per_unit: received.fewest_changes,
        ..Outcome::default()
    })
}
