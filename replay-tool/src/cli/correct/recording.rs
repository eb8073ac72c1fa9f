//! Recordings: every unit by its own journal, all at once.

use std::collections::BTreeMap;
use std::path::Path;
use std::thread::available_parallelism;

use isotherm_cli::{Bar, Exit};
use isotherm_document::few;
use isotherm_log::file::read_small_text;
use isotherm_log::offline::{Basis, Loaded, RunOptions, UnitPlan, correct, load_calibration};
use isotherm_log::part::{LogFiles, Part};
use isotherm_log::replica::{Changes, Outlines, scan};
use isotherm_protocol::key::UnitId;

use super::report::Report;
use super::sink::Sink;
use super::{CorrectArgs, print_summary};
use crate::cli::show;
use crate::error::Error;

/// Gyro ticks in a message of a text log.
const TEXT_BATCH: usize = 64;

/// Runs the command on recordings.
pub(super) fn run(args: &CorrectArgs) -> Result<Exit, Error> {
    let mut files = args.log.files(1, None)?;
    let part = args.log.part()?;
    let outlines = scan(&args.log.log, files.end_ns(&part)?)?;
    let mut loaded = BTreeMap::new();
    for path in &args.calibration {
        let calibration = load_calibration(path)?;
        calibration.warnings.iter().for_each(|warning| show::warn(&warning.to_string()));
        if let Some(before) = loaded.insert(calibration.unit.clone(), (path, calibration)) {
            let words = format!(
                "--calibration is given twice for unit {}: leave out {}",
                before.1.unit,
                before.0.display()
            );
            return Err(Error::Usage(words));
        }
    }
    let calibrations =
        loaded.iter().map(|(unit, (_, calibration))| (unit.clone(), calibration.clone())).collect();
    outlines.damaged.iter().for_each(|words| show::warn(words));
    let (plans, without) = plans(args, outlines, calibrations)?;
    if let Some(words) = &without {
        show::warn(words);
    }
    let documents: Vec<_> = loaded.values().map(|(path, _)| path.as_path()).collect();
    let outcome = make(args, &mut files, part, plans, &documents)?;
    Ok(if without.is_some() { Exit::DataLoss } else { outcome })
}

/// Runs the command on a text log whose corrected ticks go into a recording.
pub(super) fn run_text(args: &CorrectArgs, calibration: &Path) -> Result<Exit, Error> {
    let loaded = load_calibration(calibration)?;
    loaded.warnings.iter().for_each(|warning| show::warn(&warning.to_string()));
    args.log.refuse_document_of_another(loaded.unit.as_str())?;
    let mut files = args.log.files(TEXT_BATCH, Some(&loaded.unit))?;
    let id = loaded.unit.clone();
    let basis = Basis::Given { settings: args.settings()?, calibration: Some(loaded) };
    let plans = vec![UnitPlan { id, basis, compare: false }];
    make(args, &mut files, args.log.part()?, plans, &[calibration])
}

/// Corrects the units as planned, and writes what comes of it with the documents beside it.
fn make(
    args: &CorrectArgs,
    files: &mut LogFiles,
    mut part: Part,
    plans: Vec<UnitPlan>,
    documents: &[&Path],
) -> Result<Exit, Error> {
    let units: Vec<_> = plans.iter().map(|plan| plan.id.clone()).collect();
    let inputs: Vec<_> = args.log.inputs().into_iter().chain(args.calibration.iter().cloned()).collect();
    let mut sink = Sink::open(args, &units, &inputs)?;
    for path in documents {
        sink.document(read_small_text(path, "read the calibration document")?.into_bytes())?;
    }
    // A unit's state rests on all that came before the part: that is corrected and not given out.
    let from_ns = files.from_beginning(&mut part)?;
    let cores = available_parallelism().map_or(1, usize::from);
    let options = RunOptions {
        threads: args.threads.map_or(cores, usize::from),
        form: sink.form(args.format),
        from_ns,
    };
    let (mut bar, mut ticks) = (None, 0);
    let result = correct(files, &part, plans, options, &mut |made, progress| {
        let bar = bar.get_or_insert_with(|| Bar::over_log(progress.watch()));
        ticks += made.iter().map(|(_, output)| output.ticks).sum::<u64>();
        bar.show(format!("{ticks} ticks"));
        sink.write(made).map_err(|error| match error {
            Error::Log(error) => error,
            other => isotherm_log::error::Error::Usage(other.to_string()),
        })
    });
    bar.iter().for_each(Bar::finish);
    let (units, log) = result?;
    let is_empty = units.iter().all(|unit| unit.summary.ticks == 0 && !unit.lost_data());
    if is_empty && matches!(files, LogFiles::Text { .. }) && !log.lost_data() {
        return Err(Error::Nothing("corrected", "raw message"));
    }
    sink.finish(&args.log.log)?;
    let report = Report::new(&units, &log);
    report.warn();
    print_summary(args, &if args.json { show::json(&report) } else { report.human() })?;
    Ok(Exit::of_loss(report.lost_data()))
}

/// What each unit of the log is corrected by; and what is said of units that nothing is known to correct by.
fn plans(
    args: &CorrectArgs,
    outlines: Outlines,
    mut calibrations: BTreeMap<UnitId, Loaded>,
) -> Result<(Vec<UnitPlan>, Option<String>), Error> {
    let wanted = args.log.units()?;
    let (mut plans, mut without) = (Vec::new(), Vec::new());
    for (id, outline) in outlines.units {
        if !outline.has_raw || !(wanted.is_empty() || wanted.contains(&id)) {
            continue;
        }
        let calibration = calibrations.remove(&id);
        let by_journal = !outline.journal.is_empty() && !args.ignore_journal;
        if !by_journal && calibration.is_none() {
            without.push(id.to_string());
            continue;
        }
        let changed = calibration.is_some() || args.ignore_swaps || !by_journal;
        let compare = outline.has_corrected && !args.no_compare && (args.compare || !changed);
        let basis = if by_journal {
            if let Some(setting) = args.given_setting() {
                return Err(Error::Usage(format!(
                    "{setting}: the journal of unit {id} has its settings: leave the option out, or add \
                     --ignore-journal"
                )));
            }
            Basis::Journal {
                outline: outline.journal,
                changes: Changes { calibration, ignore_swaps: args.ignore_swaps },
            }
        } else {
            Basis::Given { settings: args.settings()?, calibration }
        };
        plans.push(UnitPlan { id, basis, compare });
    }
    let without = (!without.is_empty()).then(|| {
        format!(
            "there is no journal to correct {} by: give --calibration FILE for each, or choose the other units with --unit",
            few(&without)
        )
    });
    // What was asked for by name must be there.
    if let Some(words) = without.clone().filter(|_| plans.is_empty() || !wanted.is_empty()) {
        return Err(Error::Usage(words));
    }
    if let Some(unit) = calibrations.keys().next() {
        return Err(Error::Usage(format!("--calibration: the log has no raw messages of unit {unit}")));
    }
    if plans.is_empty() {
        return Err(Error::Usage("the log has no raw messages to correct".to_owned()));
    }
    Ok((plans, without))
}
