//! Recordings: every unit by its own journal, all at once.

use std::collections::BTreeMap;

use isotherm_cli::Exit;
use isotherm_document::few;
use isotherm_log::offline::{Basis, Loaded, UnitPlan};
use isotherm_log::replica::{Changes, Outlines, scan};
use isotherm_protocol::key::UnitId;

use super::{CorrectArgs, corrected, loaded, report};
use crate::cli::show;
use crate::error::Error;

/// Runs the command on recordings.
pub(super) fn run(args: &CorrectArgs) -> Result<Exit, Error> {
    let files = args.log.files(1, None)?;
    let outlines = scan(&args.log.log, files.end_ns(&args.log.part()?)?)?;
    let (mut calibrations, mut documents) = (BTreeMap::new(), BTreeMap::new());
    for path in &args.calibration {
        let calibration = loaded(path)?;
        let unit = calibration.unit.clone();
        if let Some(before) = documents.insert(unit.clone(), path.as_path()) {
            let words =
                format!("--calibration is given twice for unit {unit}: leave out {}", before.display());
            return Err(Error::Usage(words));
        }
        calibrations.insert(unit, calibration);
    }
    outlines.damaged.iter().for_each(show::warn);
    let (plans, without) = plans(args, outlines, calibrations)?;
    without.iter().for_each(show::warn);
    let documents: Vec<_> = documents.into_values().collect();
    let (units, log) = corrected(args, files, plans, &documents)?;
    let outcome = report::print(args, &units, &log);
    Ok(if without.is_some() { Exit::DataLoss } else { outcome })
}

/// What each unit of the log is corrected by; and what is said of units that nothing is known to correct by.
fn plans(
    args: &CorrectArgs,
    outlines: Outlines,
    mut calibrations: BTreeMap<UnitId, Loaded>,
) -> Result<(Vec<UnitPlan>, Option<String>), Error> {
    let wanted = args.log.units();
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
