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

use clap::builder::RangedU64ValueParser;
use isotherm_cli::{Bar, number};
use serde::{Deserialize, Serialize};

pub(crate) use case::{Beside, Case, Pace};
use profile::Profile;
use row::Row;
pub(crate) use subject::Subject;
pub(crate) use table::table;

use crate::error::Error;
use crate::machine::Machine;
use crate::rounds::rounds;

/// What of a chain is measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, clap::ValueEnum)]
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
    #[arg(long, value_delimiter = ',', value_parser = RangedU64ValueParser::<usize>::new().range(1..=10_000))]
    units: Vec<usize>,
    /// Ticks per second of each unit
    #[arg(long, value_delimiter = ',', value_parser = clap::value_parser!(u32).range(1..=10_000))]
    rate: Vec<u32>,
    /// Ticks in a message
    #[arg(long, value_delimiter = ',', value_parser = RangedU64ValueParser::<usize>::new().range(1..=4096))]
    batch: Vec<usize>,
    /// Rounds; every subject runs once in each
    #[arg(long, default_value_t = 5, value_parser = rounds())]
    rounds: usize,
    /// How long a round of latency is measured (s)
    #[arg(long, default_value_t = 3.0, value_parser = number(" of seconds", 0.05..=600.0))]
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
const UNITS: [usize; 5] = [1, 10, 100, 1000, 5000];
const TICKS_OF_UNITS: usize = 2_000_000;
const BATCH_OF_UNITS: usize = 20;
const UNITS_S: f64 = 10.0;
/// Swaps that are timed there.
const SWAPS: usize = 50;

/// What is given, else what is usual.
fn or<T: Copy>(given: &[T], usual: &[T]) -> Vec<T> {
    if given.is_empty() { usual.to_vec() } else { given.to_vec() }
}

impl ChainArgs {
    /// All cases of a measure, each as a list of variants that are to be compared.
    fn cases(&self, measure: Measure) -> Vec<Vec<Case>> {
        let seconds = if self.quick { 1.0 } else { self.seconds };
        let fewer = if self.quick { 10 } else { 1 };
        match measure {
            Measure::Latency => {
                let case = |(units, rate, batch)| vec![Case::paced(units, rate, batch, seconds)];
                self.loads().into_iter().map(case).collect()
            }
            Measure::Saturation => {
                let units = or(&self.units, &[20]);
                let cases = units.into_iter().flat_map(|units| {
                    SATURATED_TICKS
                        .map(|(batch, ticks)| vec![Case::saturated(units, batch, ticks / fewer, SATURATED_S)])
                });
                cases.collect()
            }
            Measure::Units => {
                let units = or(&self.units, &UNITS).into_iter().filter(|units| !self.quick || *units <= 100);
                let cases = units.map(|units| {
                    let case = Case::saturated(units, BATCH_OF_UNITS, TICKS_OF_UNITS / fewer, UNITS_S);
                    vec![Case { rate_hz: 200, state: false, timed_swaps: SWAPS, ..case }]
                });
                cases.collect()
            }
            Measure::Swap => self.with_and_without(Beside::Swaps, 100),
            Measure::Pair => self.with_and_without(Beside::Standby, 20),
            Measure::Console => self.with_and_without(Beside::Pages, 200),
        }
    }

    /// Units, rate and ticks in a message of each load.
    fn loads(&self) -> Vec<(usize, u32, usize)> {
        if self.units.is_empty() && self.rate.is_empty() && self.batch.is_empty() {
            let at = |rate| [1, 20, 100].map(|units| (units, rate, 1));
            return at(200).into_iter().chain(at(1000)).chain([(100, 1000, 10)]).collect();
        }
        let mut loads = Vec::new();
        for units in or(&self.units, &[20]) {
            for rate in or(&self.rate, &[1000]) {
                loads.extend(or(&self.batch, &[1]).into_iter().map(|batch| (units, rate, batch)));
            }
        }
        loads
    }

    /// Without what goes on beside the ticks, and with it; and how many units it takes to show.
    fn with_and_without(&self, beside: Beside, units: usize) -> Vec<Vec<Case>> {
        let rate = self.rate.first().copied().unwrap_or(200);
        let lasting = if self.quick { 2.0 } else { self.seconds.max(4.0) };
        let cases = or(&self.units, &[units]).into_iter().map(|units| {
            let without = Case::paced(units, rate, 1, lasting);
            vec![without.clone(), Case { beside: Some(beside), ..without }]
        });
        cases.collect()
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
    let mut measures = args.measure.clone();
    measures.sort_unstable();
    measures.dedup();
    let cases = measures
        .into_iter()
        .flat_map(|measure| args.cases(measure).into_iter().map(move |variants| (measure, variants)));
    let cases = cases.map(|(measure, variants)| (measure, runs(&variants, &args.profile, &subjects)));
    let cases: Vec<_> = cases.collect();
    let rounds = if args.quick { 1 } else { args.rounds };
    let bar = Bar::counting("", cases.iter().map(|(_, runs)| runs.len() * rounds).sum());
    for (measure, runs) in cases {
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
            Row::new(measure, case, (*subject, &profile.name), outcomes, of)
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
            outcomes.push(round::run(case, *subject, profile)?);
            bar.done_one();
        }
    }
    Ok(outcomes)
}

/// What takes turns in a round.
fn runs(variants: &[Case], profiles: &[Profile], subjects: &[Subject]) -> Vec<Run> {
    // What goes on beside the ticks is compared at the service; a relay without any is the reference of these too.
    let compared = variants.len() > 1;
    let mut runs = Vec::new();
    for profile in profiles {
        for case in variants {
            let relay = (compared && runs.is_empty()).then_some(Subject::Relay);
            let able = subjects.iter().copied().filter(|subject| !compared || *subject == Subject::Service);
            runs.extend(
                relay.into_iter().chain(able).map(|subject| (case.clone(), profile.clone(), subject)),
            );
        }
    }
    runs
}
