//! `isotherm-replay diff`.

mod show_difference;

use std::fmt::Write as _;

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use clap::Args;
use isotherm_cli::{Bar, Exit, print};
use isotherm_log::diff::{AXES, Account, CorrectedLog, DiffOptions, Largest, Tolerance, compare, is_csv};
use isotherm_log::offline::unit_id;
use isotherm_log::part::Part;
use isotherm_log::replica::{check_units, scan};
use isotherm_log::source::is_recording;
use isotherm_protocol::key::UnitId;
use serde::Serialize;

pub(super) use show_difference::first_difference;

use super::show;
use crate::error::Error;

/// Compare two corrected logs tick by tick, and show the first difference
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  \
    isotherm-replay simulate --preset mems-chamber --duration 60 --out mems.csv\n  \
    isotherm-replay correct mems.csv --calibration config/calibration/MEMS-0001.toml --out a.csv\n  \
    isotherm-replay correct mems.csv --calibration config/calibration/MEMS-0001.toml --out b.csv\n  \
    isotherm-replay diff a.csv b.csv\n\n\
    A log is a recording (MCAP) with corrected ticks, or a CSV or wire file of `isotherm-replay correct`. Ticks are matched by sequence number and end, else by either of them, and compared to the bit unless a tolerance is given.\n\n\
    Exit codes: 0 identical, or within the tolerance; 1 different, or one cannot be read; 2 usage.")]
pub(super) struct DiffArgs {
    /// The first log
    #[arg(value_name = "A")]
    a: PathBuf,
    /// The second log
    #[arg(value_name = "B")]
    b: PathBuf,
    /// Unit serial, repeatable (default: all). CSV: the serial to assign
    #[arg(long, short, value_name = "SERIAL", value_parser = UnitId::new)]
    unit: Vec<UnitId>,
    /// Tolerance of angle increments (rad)
    #[arg(long, value_name = "RAD", default_value_t = 0.0, value_parser = not_negative)]
    tolerance_angle: f64,
    /// Tolerance of velocity increments (m/s)
    #[arg(long, value_name = "M/S", default_value_t = 0.0, value_parser = not_negative)]
    tolerance_velocity: f64,
    /// Tolerance of any number that is not an integer, as a share of the larger of the two
    #[arg(long, value_name = "SHARE", default_value_t = 0.0, value_parser = not_negative)]
    tolerance_relative: f64,
    /// Ticks to show before and after the first difference
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u16).range(0..=1000))]
    around: u16,
    /// Print the result as one JSON object
    #[arg(long)]
    json: bool,
}

/// Reads a tolerance.
fn not_negative(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value.is_finite() && value >= 0.0 => Ok(value),
        _ => Err("must be a number from 0 on".into()),
    }
}

/// Everything that was found.
#[derive(Debug, Serialize)]
struct Report<'r> {
    a: String,
    b: String,
    /// To the bit.
    identical: bool,
    /// Whether nothing differs by more than the tolerance.
    within_tolerance: bool,
    tolerance: Tolerance,
    units: &'r BTreeMap<UnitId, Account>,
}

/// Runs the command.
pub(super) fn run(args: &DiffArgs) -> Result<Exit, Error> {
    let units: BTreeSet<_> = args.unit.iter().cloned().collect();
    for recording in [&args.a, &args.b].into_iter().filter(|path| is_recording(path)) {
        check_units(std::slice::from_ref(recording), &units)?;
    }
    let unnamed = unnamed(args, &units)?;
    let named = !(units.is_empty() && is_csv(&args.a) && is_csv(&args.b));
    let part = Part { units, ..Part::default() };
    let mut a = CorrectedLog::open(&args.a, &part, &unnamed)?;
    let mut b = CorrectedLog::open(&args.b, &part, &unnamed)?;
    let tolerance = Tolerance {
        angle_rad: args.tolerance_angle,
        velocity_m_per_s: args.tolerance_velocity,
        relative: args.tolerance_relative,
    };
    let options = DiffOptions { tolerance, around: usize::from(args.around) };
    let mut bar = Bar::over_log(a.progress().watch());
    let accounts =
        compare(&mut a, &mut b, options, |ticks| bar.step_saying(|| Some(format!("{ticks} ticks"))))?;
    bar.finish();
    if accounts.is_empty() {
        return Err(Error::Usage(
            "neither log has corrected ticks: make them with isotherm-replay correct".to_owned(),
        ));
    }
    [a.cut_short(), b.cut_short()].iter().flatten().for_each(show::warn);
    let within_tolerance = accounts.values().all(Account::is_identical);
    let identical = within_tolerance && accounts.values().all(|account| account.within_tolerance == 0);
    let name = |path: &Path| path.display().to_string();
    let report = Report {
        a: name(&args.a),
        b: name(&args.b),
        identical,
        within_tolerance,
        tolerance,
        units: &accounts,
    };
    let exit = if within_tolerance { Exit::Ok } else { Exit::Failed };
    Ok(print(&if args.json { show::json(&report) } else { human(&report, named) }, exit))
}

/// The unit that a CSV is of, where it is not said: the only one of the other log.
fn unnamed(args: &DiffArgs, units: &BTreeSet<UnitId>) -> Result<UnitId, Error> {
    let csv = [&args.a, &args.b].map(|path| is_csv(path));
    let other = match csv {
        [true, false] => &args.b,
        [false, true] => &args.a,
        _ => return Ok(unit_id("unit")?),
    };
    if !units.is_empty() {
        return match units.first().filter(|_| units.len() == 1) {
            Some(unit) => Ok(unit.clone()),
            None => Err(Error::Usage("a CSV is of one unit: give --unit once".to_owned())),
        };
    }
    let of_other: Vec<UnitId> = if is_recording(other) {
        let outlines = scan(std::slice::from_ref(other), None)?;
        outlines.units.into_iter().filter(|(_, unit)| unit.has_corrected).map(|(unit, _)| unit).collect()
    } else {
        let mut log = CorrectedLog::open(other, &Part::default(), &unit_id("unit")?)?;
        log.next_ticks()?.map(|ticks| ticks.unit).into_iter().collect()
    };
    match of_other.as_slice() {
        [unit] => Ok(unit.clone()),
        _ => Err(Error::Usage(format!(
            "{} has {} units, and a CSV does not say which is its own: give --unit SERIAL",
            other.display(),
            of_other.len()
        ))),
    }
}

/// The result as a table, and the first difference of each unit.
/// Where both are CSVs and nobody said of which unit (`named` false), there is none to name.
fn human(report: &Report<'_>, named: bool) -> String {
    let of = |unit: &UnitId| if named { format!("unit {unit}: ") } else { String::new() };
    let row = |(unit, account): (&UnitId, &Account)| {
        let Account { ticks, different, only_a, only_b, .. } = account;
        let counts = [*ticks, *different, only_a.all(), only_b.all()];
        let unit = if named { unit.as_str() } else { "–" };
        std::iter::once(unit.to_owned()).chain(counts.map(|count| count.to_string()))
    };
    let head = ["unit", "ticks in both", "different", "only in A", "only in B"];
    let mut text = show::grid(head, report.units.iter().map(row), 1..);
    for (unit, account) in report.units.iter().filter(|(_, account)| account.other_document > 0) {
        let count = account.other_document;
        let _ =
            writeln!(text, "{}{count} ticks in both were made by different calibration documents", of(unit));
    }
    for (unit, account) in report.units {
        let allowed = account.within_tolerance;
        if allowed > 0 {
            let _ = writeln!(text, "\n{}{allowed} ticks differ within the tolerance", of(unit));
        }
        if let Some(first) = &account.first {
            let _ = writeln!(text, "\n{}the first difference", of(unit));
            text += &first_difference(first, ["A", "B"]);
        }
        if account.different + allowed > 0 {
            text += "\nlargest differences\n";
            text += &largest("angle", "rad", "°/h", &account.angle);
            text += &largest("velocity", "m/s", "mg", &account.velocity);
        }
    }
    text += match (report.identical, report.within_tolerance) {
        (true, _) => "identical\n",
        (false, true) => "\nwithin tolerance\n",
        (false, false) => "\ndifferent\n",
    };
    text
}

fn largest(what: &str, unit_of_measure: &str, as_rate: &str, largest: &[Largest; 3]) -> String {
    let line = |(axis, largest): (&&str, &Largest)| match largest.increment {
        0.0 => format!("  {what} {axis}: none\n"),
        increment => format!(
            "  {what} {axis}: {increment:.3e} {unit_of_measure} ({:.3e} {as_rate}) at tick {}\n",
            largest.equivalent, largest.sequence
        ),
    };
    AXES.iter().zip(largest).map(line).collect()
}
