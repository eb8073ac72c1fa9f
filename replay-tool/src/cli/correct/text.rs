//! Text logs: one unit with one calibration.

use std::path::Path;

use isotherm_cli::{Bar, Exit};
use isotherm_log::offline::sums::{Summary, Sums};
use isotherm_log::offline::{Form, Made, Offline, load_calibration};
use isotherm_log::text::ReadReport;
use serde::Serialize;

use super::sink::Sink;
use super::{CorrectArgs, print_summary};
use crate::cli::show;
use crate::error::Error;

/// Outputs that are written together.
const BLOCK: usize = 512;

/// Everything that the summary says.
#[derive(Debug, Serialize)]
struct Report<'a> {
    unit: &'a str,
    calibration_digest: String,
    #[serde(flatten)]
    summary: &'a Summary,
    counters: std::collections::BTreeMap<String, u64>,
    log: &'a ReadReport,
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
    let calibration = calibration(args)?;
    if args.out.as_ref().and_then(|out| out.extension()).is_some_and(|extension| extension == "mcap") {
        return super::recording::run_text(args, calibration);
    }
    let loaded = load_calibration(calibration)?;
    args.log.refuse_document_of_another(loaded.unit.as_str())?;
    for warning in &loaded.warnings {
        show::warn(&warning.to_string());
    }
    let mut events = args.log.events()?;
    let mut inputs = events.inner().paths().to_vec();
    inputs.extend(args.log.mapping_file().into_iter().chain([calibration.to_owned()]));
    let mut sink = Sink::open(args, std::slice::from_ref(&loaded.unit), &inputs)?;
    let form = sink.form(args.format);
    let mut unit = Offline::new(&loaded, settings);
    let mut sums = Sums::default();
    let mut bar = Bar::over_log(events.inner().progress().watch());
    for event in &mut events {
        unit.handle(&event?);
        if unit.ready() >= BLOCK {
            sink.write(take(&mut unit, &mut sums, form))?;
        }
        bar.step_saying(|| Some(format!("{} ticks", sums.ticks())));
    }
    unit.finish();
    if unit.unit().counters().gyro_ticks_in == 0 && !events.inner().report().lost_data() {
        return Err(Error::Nothing("corrected"));
    }
    sink.write(take(&mut unit, &mut sums, form))?;
    sink.finish(&inputs)?;
    bar.finish();

    let (summary, log) = (sums.summary(), events.inner().report());
    for trouble in unit.troubles().into_iter().chain(summary.doubts()) {
        show::warn(&trouble);
    }
    let digest = format!("{:016x}", u64::from_be_bytes(loaded.digest));
    let report = Report {
        unit: loaded.unit.as_str(),
        calibration_digest: digest,
        summary: &summary,
        counters: unit.counters().into_iter().collect(),
        log: &log,
    };
    print_summary(args, &if args.json { show::json(&report) } else { human(&report) })?;
    Ok(Exit::of_loss(log.lost_data() || unit.refused() > 0))
}

/// Takes what is ready and sums it up.
fn take(unit: &mut Offline, sums: &mut Sums, form: Form) -> Made {
    unit.peek().for_each(|tick| sums.add(tick));
    vec![(0, unit.give_out(form))]
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
    show::table(&rows) + &show::axes(&means) + &show::rows(report.log)
}
