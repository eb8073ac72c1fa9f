//! `isotherm-replay step`.

mod words;

use std::io::{self, BufRead, IsTerminal, Write};
use std::path::PathBuf;

use clap::Args;
use isotherm_cli::Exit;
use isotherm_correction::unit::UnitSettings;
use isotherm_log::offline::{Loaded, load_calibration};
use isotherm_log::part::Part;
use isotherm_log::replica::stepper::Stepper;
use isotherm_log::replica::{Changes, Replica, scan};
use isotherm_protocol::key::UnitId;

use super::{LogArgs, put, show};
use crate::error::Error;

/// What can be typed between two events.
const HELP: &str = "Enter: next event · number, Enter: that many · s SEQ: to gyro tick SEQ · q: end";

/// Walk through the events of a unit's state machine one by one
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  \
    isotherm-replay simulate --preset mems-chamber --duration 10 --out mems.csv\n  \
    isotherm-replay step mems.csv --calibration config/calibration/MEMS-0001.toml --from 100 --count 3\n\n\
    Without --from, --count and --json, on a terminal, it stops after each event: Enter for the next, a number and Enter for that many, s SEQ to go to gyro tick SEQ, q to end.\n\n\
    A recording is followed by its own journal, as in `isotherm-replay correct`.")]
pub(super) struct StepArgs {
    #[command(flatten)]
    log: LogArgs,
    /// Calibration document (TOML) of a text log, or of a recording without a journal
    #[arg(long, short, value_name = "FILE")]
    calibration: Option<PathBuf>,
    /// Begin to print at this gyro tick
    #[arg(long, value_name = "SEQ")]
    from: Option<u64>,
    /// Stop after N events
    #[arg(long, value_name = "N")]
    count: Option<u64>,
    /// Print each event as one JSON object on a line
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub(super) fn run(args: &StepArgs) -> Result<Exit, Error> {
    let loaded = args.calibration.as_deref().map(load_calibration).transpose()?;
    let mut stepper = open(args, loaded.as_ref())?;
    let terminal = io::stdin().is_terminal() && io::stdout().is_terminal();
    let interactive = terminal && args.from.is_none() && args.count.is_none() && !args.json;
    if interactive {
        converse(&mut stepper, &mut io::stdin().lock())?;
    } else {
        list(&mut stepper, args)?;
    }
    Ok(Exit::of_loss(!stepper.replica().report().is_exact()))
}

/// Opens the log of one unit.
fn open(args: &StepArgs, loaded: Option<&Loaded>) -> Result<Stepper, Error> {
    let settings = UnitSettings::default();
    if !args.log.is_recording()? {
        let Some(loaded) = loaded else {
            return Err(Error::Usage("a text log needs --calibration FILE".to_owned()));
        };
        args.log.refuse_document_of_another(loaded.unit.as_str())?;
        let files = args.log.files(1, Some(&loaded.unit))?;
        let replica = Replica::without_journal(loaded.unit.clone(), settings, Some(loaded));
        return Ok(Stepper::open(files, args.log.part()?, replica)?);
    }
    let files = args.log.files(1, None)?;
    let mut outlines = scan(&args.log.log, files.end_ns(&args.log.part()?)?)?;
    outlines.damaged.iter().for_each(show::warn);
    let wanted = args.log.units();
    let holds = |unit: &UnitId| wanted.is_empty() || wanted.contains(unit);
    let units: Vec<_> = outlines
        .units
        .iter()
        .filter(|(unit, outline)| outline.has_raw && holds(unit))
        .map(|(unit, _)| unit.clone())
        .collect();
    let [unit] = units.as_slice() else {
        let names: Vec<_> = units.iter().map(UnitId::as_str).collect();
        return Err(Error::Usage(match names.len() {
            0 => "the log has no raw messages to step through".to_owned(),
            _ => format!("the log has {}: choose one with --unit", names.join(", ")),
        }));
    };
    let journal = outlines.units.remove(unit).unwrap_or_default().journal;
    let part = Part { units: [unit.clone()].into(), ..args.log.part()? };
    let replica = match loaded {
        Some(loaded) if loaded.unit != *unit => {
            return Err(Error::Usage(format!(
                "--calibration is for unit {}, the log is of {unit}: give the document of {unit}",
                loaded.unit
            )));
        }
        _ if !journal.is_empty() => {
            let changes = Changes { calibration: loaded.cloned(), ignore_swaps: false };
            Replica::new(unit.clone(), journal, changes)
        }
        Some(loaded) => Replica::without_journal(unit.clone(), settings, Some(loaded)),
        None => {
            let words = format!("unit {unit} has no journal to follow: give --calibration FILE");
            return Err(Error::Usage(words));
        }
    };
    Ok(Stepper::open(files, part, replica)?)
}

/// Prints what was asked for.
fn list(stepper: &mut Stepper, args: &StepArgs) -> Result<(), Error> {
    let mut next = match args.from {
        Some(sequence) => stepper.go_to(sequence)?,
        None => stepper.next_step()?,
    };
    if next.is_none() {
        return Err(match args.from.zip(stepper.passed()) {
            Some((from, last)) => Error::EndsBefore { last, from },
            None => Error::Nothing("stepped through", "raw message"),
        });
    }
    let mut left = args.count.unwrap_or(u64::MAX);
    while let Some(step) = next.filter(|_| left > 0) {
        put(&mut io::stdout(), &if args.json { show::json(&step) } else { words::step(&step) })?;
        left -= 1;
        next = if left > 0 { stepper.next_step()? } else { None };
    }
    Ok(())
}

/// What somebody at a terminal wants next.
#[derive(Debug, PartialEq, Eq)]
enum Wish {
    Next(u64),
    GoTo(u64),
    Quit,
    Help,
}

fn wish(line: &str) -> Wish {
    let line = line.trim();
    match line.split_once(' ') {
        Some(("s", sequence)) => sequence.trim().parse().map_or(Wish::Help, Wish::GoTo),
        _ if line.is_empty() => Wish::Next(1),
        _ if line == "q" => Wish::Quit,
        _ => line.parse().map_or(Wish::Help, Wish::Next),
    }
}

/// Steps as it is told to.
fn converse(stepper: &mut Stepper, input: &mut dyn BufRead) -> Result<(), Error> {
    let _ = writeln!(io::stderr(), "{HELP}");
    let mut line = String::new();
    loop {
        let step = match wish(&line) {
            Wish::Quit => return Ok(()),
            Wish::Help => {
                let _ = writeln!(io::stderr(), "{HELP}");
                None
            }
            Wish::GoTo(sequence) => match stepper.go_to(sequence)? {
                Some(step) => Some(step),
                None => return over(),
            },
            Wish::Next(count) => {
                let mut last = None;
                for _ in 0..count {
                    let Some(step) = stepper.next_step()? else { return over() };
                    last = Some(step);
                }
                last
            }
        };
        step.iter().try_for_each(|step| put(&mut io::stdout(), &words::step(step)))?;
        line.clear();
        match input.read_line(&mut line) {
            Ok(0) => return Ok(()),
            Ok(_) => {}
            Err(source) => return Err(Error::file("standard input".as_ref(), "read", source)),
        }
    }
}

/// Says that there is no further event.
fn over() -> Result<(), Error> {
    put(&mut io::stdout(), "end of the log\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_typed_is_understood() {
        for (line, expected) in [
            ("\n", Wish::Next(1)),
            ("12\n", Wish::Next(12)),
            ("s 4711\n", Wish::GoTo(4711)),
            ("q\n", Wish::Quit),
            ("s x\n", Wish::Help),
            ("what?\n", Wish::Help),
        ] {
            assert_eq!(wish(line), expected, "{line:?}");
        }
    }
}
