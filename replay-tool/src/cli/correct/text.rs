//! Text logs: one unit with one calibration.

use std::collections::BTreeMap;
use std::path::Path;

use isotherm_cli::Exit;
use isotherm_log::offline::sums::Summary;
use isotherm_log::offline::{Basis, UnitPlan};
use isotherm_log::source::LogReport;
use serde::Serialize;

use super::{CorrectArgs, corrected, loaded, print_summary, report, sink};
use crate::cli::show;
use crate::error::Error;

/// Gyro ticks in a message.
const BATCH: usize = 64;

/// Everything that the summary says.
#[derive(Debug, Serialize)]
struct Report<'a> {
    unit: &'a str,
    calibration_digest: String,
    #[serde(flatten)]
    summary: &'a Summary,
    counters: &'a BTreeMap<String, u64>,
    log: &'a LogReport,
}

/// The calibration document, of which there must be one.
fn calibration(args: &CorrectArgs) -> Result<&Path, Error> {
    let only = [
        ("--ignore-swaps", args.ignore_swaps),
        ("--ignore-journal", args.ignore_journal),
        ("--compare", args.compare),
        ("--no-compare", args.no_compare),
    ];
    if let Some((name, _)) = only.into_iter().find(|(_, given)| *given) {
        return Err(Error::Usage(format!(
            "{name} is for recordings: a text log has no journal and no corrected ticks"
        )));
    }
    match args.calibration.as_slice() {
        [calibration] => Ok(calibration),
        [] => Err(Error::Usage("a text log needs --calibration FILE".to_owned())),
        _ => Err(Error::Usage("a text log is of one unit: give --calibration once".to_owned())),
    }
}

/// Runs the command on a text log.
pub(super) fn run(args: &CorrectArgs) -> Result<Exit, Error> {
    let settings = args.settings()?;
    let path = calibration(args)?;
    let loaded = loaded(path)?;
    let unit = loaded.unit.clone();
    args.log.refuse_document_of_another(unit.as_str())?;
    let files = args.log.files(BATCH, Some(&unit))?;
    let calibration_digest = show::hexadecimal(loaded.digest);
    let basis = Basis::Given { settings, calibration: Some(loaded) };
    let plan = UnitPlan { id: unit.clone(), basis, compare: false };
    let (units, log) = corrected(args, files, vec![plan], &[path])?;
    let ([corrected], false) = (units.as_slice(), args.out.as_deref().is_some_and(sink::is_recording)) else {
        return Ok(report::print(args, &units, &log));
    };
    let summary = &corrected.summary;
    corrected.troubles.iter().for_each(show::warn);
    summary.doubts().iter().for_each(show::warn);
    let (unit, counters) = (unit.as_str(), &corrected.counters);
    let report = Report { unit, calibration_digest, summary, counters, log: &log };
    let text = if args.json { show::json(&report) } else { human(&report) };
    // What went in did not all go out corrected, though the log has it.
    Ok(print_summary(args, &text, Exit::of_loss(log.lost_data() || corrected.unanswered() > 0)))
}

/// The summary as tables.
fn human(report: &Report<'_>) -> String {
    let summary = report.summary;
    let mut rows = vec![
        ("unit", report.unit.to_owned()),
        ("ticks", summary.ticks.to_string()),
        ("outputs", summary.outputs.to_string()),
        ("gaps", summary.gaps.to_string()),
        ("missing ticks", summary.missed_ticks.to_string()),
        ("duration (s)", format!("{:.3}", summary.duration_s)),
    ];
    let flags = summary.flags.iter().chain(&summary.sensor_flags);
    rows.extend(flags.map(|(flag, count)| (*flag, count.to_string())));
    let means = [
        ("mean rate (°/h)", summary.mean_rate_deg_per_h, 4),
        ("mean specific force (m/s²)", summary.mean_specific_force_m_per_s2, 6),
    ];
    show::table(&rows) + &show::axes(&means) + &show::reading(report.log)
}
