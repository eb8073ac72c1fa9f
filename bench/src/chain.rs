//! The chain: source, middle and sink in three processes over TCP loopback; the service beside a bare relay.
//!
//! The relay is the reference: the same Zenoh configuration, and a callback that only puts what came in on the output key.
//! Subjects take turns in every round, and a ratio is one of two rounds that follow one another.

mod case;
mod check;
mod page;
mod profile;
mod python;
mod round;
mod row;
mod subject;
mod swap;
mod table;

use isotherm_cli::Bar;
use serde::{Deserialize, Serialize};

use case::{Beside, Case};
use profile::Profile;
use row::Row;
use subject::Subject;
pub(crate) use table::table;

use crate::error::Error;
use crate::machine::Machine;

/// What of a chain is measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, clap::ValueEnum)]
pub(crate) enum Measure {
    /// Latency at given rates.
    Latency,
    /// Throughput where nothing waits.
    Saturation,
    /// Memory, start-up, swaps and cost by number of units.
    Units,
    /// Latency while every unit is given another calibration each second, beside latency without.
    Swap,
    /// Latency of a pair to a sink that takes each tick from the service that sends it first, beside latency of one service.
    Pair,
    /// Latency while pages of the console in the browser are open, beside latency of a service without it.
    Console,
}

/// Arguments of `chain`.
#[derive(Debug, Clone, clap::Args)]
pub(crate) struct ChainArgs {
    /// What is measured
    #[arg(long, value_delimiter = ',', default_values = ["latency", "saturation", "swap"])]
    measure: Vec<Measure>,
    /// What stands in the middle; a relay is always among them
    #[arg(long, value_delimiter = ',', default_values = ["relay", "service", "python"])]
    subject: Vec<Subject>,
    /// Numbers of units; with `--rate` and `--batch` instead of the usual cases
    #[arg(long, value_delimiter = ',', value_parser = clap::value_parser!(u32).range(1..=10_000))]
    units: Vec<u32>,
    /// Ticks per second of each unit
    #[arg(long, value_delimiter = ',', value_parser = clap::value_parser!(u32).range(1..=10_000))]
    rate: Vec<u32>,
    /// Ticks in a message
    #[arg(long, value_delimiter = ',', value_parser = clap::value_parser!(u32).range(1..=4096))]
    batch: Vec<u32>,
    /// Rounds; every subject runs once in each
    #[arg(long, default_value_t = 5)]
    rounds: usize,
    /// How long a round of latency is measured (s)
    #[arg(long, default_value_t = 3.0)]
    seconds: f64,
    /// One round of a second for each case: whether all works, not how fast
    #[arg(long)]
    quick: bool,
    /// Threads of Zenoh in the middle, a name or what `ZENOH_RUNTIME` is to be (RON); several are compared with one another, the
    /// first is the reference
    #[arg(long, value_name = "PROFILE", default_value = "default")]
    profile: Vec<Profile>,
    /// Print JSON
    #[arg(long)]
    pub(crate) json: bool,
}

/// All that was measured.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Report {
    /// On what.
    pub(crate) machine: Machine,
    /// Rows, by case and then by subject.
    pub(crate) rows: Vec<Row>,
    /// What was left out, and why.
    pub(crate) skipped: Vec<String>,
    /// What went wrong: cases of which no figure is told.
    pub(crate) failed: Vec<String>,
}

/// Ticks of all units that are sent at most where nothing waits.
const SATURATED_TICKS: [(usize, usize); 2] = [(1, 1_500_000), (32, 6_400_000)];
/// How long the source goes on there at most (s).
const SATURATED_S: f64 = 5.0;
/// Numbers of units that are compared, the ticks of all of them, of a message, and how long the source goes on at most (s).
const UNITS: [u32; 5] = [1, 10, 100, 1000, 5000];
const TICKS_OF_UNITS: usize = 2_000_000;
const BATCH_OF_UNITS: usize = 20;
const UNITS_S: f64 = 10.0;
/// Swaps that are timed there.
const SWAPS: usize = 50;

impl ChainArgs {
    /// All cases, each as a list of variants that are to be compared.
    fn cases(&self) -> Vec<(Measure, Vec<Case>)> {
        let seconds = if self.quick { 1.0 } else { self.seconds };
        let mut cases = Vec::new();
        let usize_of = |numbers: &[u32], or: usize| match numbers {
            [] => vec![or],
            numbers => numbers.iter().map(|number| *number as usize).collect(),
        };
        if self.measure.contains(&Measure::Latency) {
            let chosen = !(self.units.is_empty() && self.rate.is_empty() && self.batch.is_empty());
            let loads: Vec<(usize, u32, usize)> = if chosen {
                let rates = if self.rate.is_empty() { vec![1000] } else { self.rate.clone() };
                let mut loads = Vec::new();
                for units in usize_of(&self.units, 20) {
                    for rate in &rates {
                        loads.extend(usize_of(&self.batch, 1).into_iter().map(|batch| (units, *rate, batch)));
                    }
                }
                loads
            } else {
                let at = |rate| [1, 20, 100].map(|units| (units, rate, 1));
                at(200).into_iter().chain(at(1000)).chain([(100, 1000, 10)]).collect()
            };
            cases.extend(loads.into_iter().map(|(units, rate, batch)| {
                (Measure::Latency, vec![Case::paced(units, rate, batch, seconds)])
            }));
        }
        if self.measure.contains(&Measure::Saturation) {
            let units = usize_of(&self.units, 20);
            cases.extend(units.iter().flat_map(|units| {
                SATURATED_TICKS.map(|(batch, ticks)| {
                    let ticks = if self.quick { ticks / 10 } else { ticks };
                    (Measure::Saturation, vec![Case::saturated(*units, batch, ticks, SATURATED_S)])
                })
            }));
        }
        if self.measure.contains(&Measure::Units) {
            let units = if self.units.is_empty() { UNITS.as_slice() } else { &self.units };
            let ticks = if self.quick { TICKS_OF_UNITS / 10 } else { TICKS_OF_UNITS };
            cases.extend(units.iter().filter(|units| !self.quick || **units <= 100).map(|units| {
                let case = Case::saturated(*units as usize, BATCH_OF_UNITS, ticks, UNITS_S);
                let case = Case { rate_hz: 200, state: false, timed_swaps: SWAPS, ..case };
                (Measure::Units, vec![case])
            }));
        }
        // What goes on beside the ticks, and how many units it takes to show.
        for (measure, few, beside) in [
            (Measure::Swap, 100, Beside::Swaps),
            (Measure::Pair, 20, Beside::Standby),
            (Measure::Console, 200, Beside::Pages),
        ] {
            if !self.measure.contains(&measure) {
                continue;
            }
            let rate = self.rate.first().copied().unwrap_or(200);
            let lasting = if self.quick { 2.0 } else { seconds.max(4.0) };
            cases.extend(usize_of(&self.units, few).into_iter().map(|units| {
                let without = Case::paced(units, rate, 1, lasting);
                (measure, vec![without.clone(), Case { beside: Some(beside), ..without }])
            }));
        }
        cases
    }
}

/// Runs the chain; a case that goes wrong is told in the report, and the others are measured all the same.
pub(crate) fn measure(args: &ChainArgs) -> Report {
    let machine = Machine::look();
    let (mut rows, mut skipped, mut failed) = (Vec::new(), Vec::new(), Vec::new());
    let mut subjects = args.subject.clone();
    if !subjects.contains(&Subject::Keyed) {
        subjects.push(Subject::Relay);
    }
    subjects.sort_unstable();
    subjects.dedup();
    if subjects.contains(&Subject::Python)
        && let Err(error) = python::interpreter()
    {
        skipped.push(format!("{error}"));
        subjects.retain(|subject| *subject != Subject::Python);
    }
    let cases = args.cases();
    let rounds = if args.quick { 1 } else { args.rounds.max(1) };
    let runs: Vec<_> = cases.iter().map(|(_, variants)| runs(variants, &args.profile, &subjects)).collect();
    let bar = Bar::counting("", runs.iter().map(|runs| runs.len() * rounds).sum());
    for ((measure, _), runs) in cases.iter().zip(runs) {
        let outcomes = match take_turns(&runs, rounds, &bar) {
            Ok(outcomes) => outcomes,
            Err(error) => {
                // The other cases are as good as they were.
                failed.push(error.to_string());
                continue;
            }
        };
        let reference = outcomes.first().cloned().unwrap_or_default();
        let before = outcomes.clone();
        rows.extend(runs.iter().zip(outcomes).map(|((case, profile, subject), outcomes)| {
            // Swaps, pages and a standby are compared with the same subject without them, all else with the relay.
            let without = runs.iter().position(|(other, _, same)| {
                case.beside.is_some() && other.beside.is_none() && same == subject
            });
            let of = without.and_then(|index| before.get(index)).unwrap_or(&reference);
            Row::new(*measure, case, (*subject, &profile.name), outcomes, of)
        }));
    }
    bar.finish();
    Report { machine: machine.measured(), rows, skipped, failed }
}

/// What is run: a load, settings, and what stands in the middle.
type Run = (Case, Profile, Subject);

/// Every run once in each of so many rounds; the outcomes of each.
fn take_turns(runs: &[Run], rounds: usize, bar: &Bar) -> Result<Vec<Vec<round::Outcome>>, Error> {
    let mut outcomes = vec![Vec::with_capacity(rounds); runs.len()];
    for _ in 0..rounds {
        for ((case, profile, subject), outcomes) in runs.iter().zip(&mut outcomes) {
            bar.say(format!("{}: {}", case.words(), subject.name()));
            let outcome = round::run(case, *subject, profile)?;
            check_swaps(case, *subject, &outcome)?;
            outcomes.push(outcome);
            bar.done_one();
        }
    }
    Ok(outcomes)
}

/// What takes turns in a round.
fn runs(variants: &[Case], profiles: &[Profile], subjects: &[Subject]) -> Vec<Run> {
    let mut runs = Vec::new();
    for profile in profiles {
        for case in variants {
            let able = |subject: &&Subject| {
                !variants.iter().any(|case| case.beside.is_some()) || **subject == Subject::Service
            };
            let first = runs.is_empty();
            // The relay is the reference of these too, without any.
            let relay = variants.len() > 1 && first;
            runs.extend(relay.then(|| (case.clone(), profile.clone(), Subject::Relay)));
            runs.extend(
                subjects.iter().filter(able).map(|subject| (case.clone(), profile.clone(), *subject)),
            );
        }
    }
    runs
}

/// Whether every unit was given another calibration at all; how many there were stands in the table.
fn check_swaps(case: &Case, subject: Subject, outcome: &round::Outcome) -> Result<(), Error> {
    if case.beside == Some(Beside::Swaps) && outcome.swaps_per_unit == 0 {
        let what = "a unit was given no other calibration".to_owned();
        return Err(Error::Output { subject: subject.name().to_owned(), what });
    }
    Ok(())
}
