//! How cost grows with the number of units, and how fast a log is corrected offline.

mod fit;
mod offline;
mod table;

use isotherm_cli::Bar;
use serde::Serialize;

pub(crate) use offline::Offline;
pub(crate) use table::table;

use crate::chain::{Case, Measure, Profile, Row, Run, Subject, take_turns};
use crate::error::Error;
use crate::machine::Machine;
use crate::part::Pace;

/// Arguments of `scale`.
#[derive(Debug, Clone, clap::Args)]
#[expect(clippy::struct_excessive_bools, reason = "each is a switch of the command line")]
pub(crate) struct ScaleArgs {
    /// Numbers of units
    #[arg(long, value_delimiter = ',', default_values = ["1", "10", "100", "1000", "5000"], value_parser = clap::value_parser!(u32).range(1..=10_000))]
    units: Vec<u32>,
    /// Rounds
    #[arg(long, default_value_t = 3)]
    rounds: usize,
    /// Only the running service
    #[arg(long, conflicts_with = "offline")]
    live: bool,
    /// Only the offline correction
    #[arg(long)]
    offline: bool,
    /// One short round, without the largest numbers: whether all works, not how fast
    #[arg(long)]
    quick: bool,
    /// Print JSON
    #[arg(long)]
    pub(crate) json: bool,
}

/// All that was measured.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Report {
    /// On what.
    pub(crate) machine: Machine,
    /// The service with as much as will go through, by number of units.
    pub(crate) units: Vec<Row>,
    /// The relay that declares its keys under the same loads: what Zenoh takes by itself.
    pub(crate) zenoh: Vec<Row>,
    /// How both grow.
    pub(crate) growth: Vec<Growth>,
    /// The greatest number of units at 200 Hz, in the service and in the relay that declares its keys.
    pub(crate) rated: Vec<Row>,
    /// A log from a recording.
    pub(crate) offline: Option<Offline>,
    /// What was left out, and why.
    pub(crate) skipped: Vec<String>,
}

/// How something grows with the number of units.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Growth {
    /// What.
    pub(crate) what: String,
    /// Slope of its logarithm over that of the number of units.
    pub(crate) exponent: f64,
}

/// Ticks in a message.
const BATCH: usize = 20;
/// Ticks of all units where nothing waits.
const TICKS: usize = 2_000_000;
/// How long the source goes on there at most (s).
const LIMIT_S: f64 = 10.0;
/// Swaps that are timed.
const SWAPS: usize = 50;
/// How long the greatest number of units is run at its rate (s).
const RATED_S: f64 = 4.0;
/// That rate (Hz).
const RATE_HZ: u32 = 200;

/// Runs the bench.
pub(crate) fn measure(args: &ScaleArgs) -> Result<Report, Error> {
    let machine = Machine::look();
    let mut report = Report {
        machine: machine.clone(),
        units: Vec::new(),
        zenoh: Vec::new(),
        growth: Vec::new(),
        rated: Vec::new(),
        offline: None,
        skipped: Vec::new(),
    };
    let rounds = if args.quick { 1 } else { args.rounds.max(1) };
    if !args.offline {
        live(args, rounds, &mut report)?;
    }
    if !args.live {
        let (offline, skipped) = offline::measure(rounds, args.quick)?;
        report.offline = Some(offline);
        report.skipped.extend(skipped);
    }
    report.machine = machine.measured();
    Ok(report)
}

fn live(args: &ScaleArgs, rounds: usize, report: &mut Report) -> Result<(), Error> {
    let units: Vec<usize> =
        args.units.iter().map(|units| *units as usize).filter(|units| !args.quick || *units <= 100).collect();
    let ticks = if args.quick { TICKS / 10 } else { TICKS };
    let cases: Vec<Case> = units
        .iter()
        .map(|units| Case {
            rate_hz: RATE_HZ,
            state: false,
            timed_swaps: SWAPS,
            ..Case::saturated(*units, BATCH, ticks, LIMIT_S)
        })
        .collect();
    let own = Profile::own();
    let bar = Bar::counting("", (2 * cases.len() + 2) * rounds);
    let subjects =
        |case: &Case| [Subject::Keyed, Subject::Service].map(|subject| (case.clone(), own.clone(), subject));
    let runs: Vec<Run> = cases.iter().flat_map(subjects).collect();
    let outcomes = take_turns(&runs, rounds, false, &bar)?;
    for ((case, _, subject), outcomes) in runs.iter().zip(outcomes) {
        let row = Row::new(Measure::Saturation, case, (*subject, &own.name), outcomes.clone(), &outcomes);
        if *subject == Subject::Service { report.units.push(row) } else { report.zenoh.push(row) }
    }
    report.growth = growth(&report.units, &report.zenoh);

    let most = units.iter().copied().max().unwrap_or(1);
    let rated = Case {
        pace: Pace::Spread,
        state: false,
        ..Case::paced(most, RATE_HZ, BATCH, if args.quick { 1.0 } else { RATED_S })
    };
    // Beside thousands of units the other relay is no reference: it looks for the subscribers of every message among all keys.
    let runs = subjects(&rated);
    let outcomes = take_turns(&runs, rounds, false, &bar)?;
    bar.finish();
    let reference = outcomes.first().cloned().unwrap_or_default();
    let row = |((case, _, subject), outcomes): (&Run, Vec<_>)| {
        Row::new(Measure::Latency, case, (*subject, &own.name), outcomes, &reference)
    };
    report.rated = runs.iter().zip(outcomes).map(row).collect();
    Ok(())
}

/// Exponents of what grows; what the first unit costs alone is taken off where it is there without any unit.
#[expect(clippy::cast_precision_loss, reason = "far below 2⁵³")]
fn growth(service: &[Row], zenoh: &[Row]) -> Vec<Growth> {
    let over = |rows: &[Row], what: &str, alone: bool, of: &dyn Fn(&Row) -> f64| {
        let first = rows.first().map_or(0.0, of);
        let rows = rows.iter().skip(usize::from(!alone));
        let points: Vec<[f64; 2]> =
            rows.map(|row| [row.case.units as f64, if alone { of(row) } else { of(row) - first }]).collect();
        Growth { what: what.to_owned(), exponent: fit::exponent(&points) }
    };
    let time = |row: &Row| row.median.cpu_us_per_tick * row.case.units as f64;
    let memory = |row: &Row| row.median.resident_kib as f64;
    let growth = [
        over(service, "processor time of all units, each at one rate", true, &time),
        over(zenoh, "the same of Zenoh alone", true, &time),
        over(service, "resident memory beyond that of one unit", false, &memory),
        over(zenoh, "the same of Zenoh alone", false, &memory),
        over(service, "start-up beyond that of one unit", false, &|row| row.median.start_s),
        over(service, "time of one swap", true, &|row| row.median.swap_ms),
    ];
    // Of a single point there is none.
    growth.into_iter().filter(|growth| growth.exponent.is_finite()).collect()
}
