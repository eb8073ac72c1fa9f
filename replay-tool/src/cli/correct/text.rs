//! Text logs: one unit with one calibration.

use std::path::Path;

use isotherm_cli::{Bar, Exit};
use isotherm_log::offline::sums::{Summary, Sums};
use isotherm_log::offline::{Form, Made, Output, counters, load_calibration, troubles};
use isotherm_log::text::ReadReport;
use isotherm_protocol::stream::UnitStream;
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
    let mut part = args.log.part()?;
    // A unit's state rests on all that came before the part: that is corrected and not given out.
    let from_ns = args.log.files(1, Some(&loaded.unit))?.from_beginning(&mut part)?;
    let mut events = args.log.events(&part)?;
    let mut inputs = events.paths().to_vec();
    inputs.extend(args.log.mapping_file().into_iter().chain([calibration.to_owned()]));
    let mut sink = Sink::open(args, std::slice::from_ref(&loaded.unit), &inputs)?;
    let form = sink.form(args.format);
    let mut stream = loaded.stream(settings);
    let mut sums = Sums::default();
    let mut bar = Bar::over_log(events.progress().watch());
    let mut ticks_before = 0;
    for event in &mut events {
        let event = event?;
        stream.handle((&event).into());
        if u64::try_from(event.time().as_ns()).unwrap_or(0) < from_ns {
            stream.drop_ready();
            ticks_before = stream.unit().counters().gyro_ticks_in;
        }
        if stream.ready().len() >= BLOCK {
            sink.write(take(&mut stream, &mut sums, form))?;
        }
        bar.step_saying(|| Some(format!("{} ticks", sums.ticks())));
    }
    stream.flush();
    let ticks_in = stream.unit().counters().gyro_ticks_in;
    if ticks_in == ticks_before && !events.report().lost_data() {
        return Err(Error::Nothing("corrected", "raw message"));
    }
    sink.write(take(&mut stream, &mut sums, form))?;
    sink.finish(&inputs)?;
    bar.finish();

    let (summary, log) = (sums.summary(), events.report());
    for trouble in troubles(&stream, 0).into_iter().chain(summary.doubts()) {
        show::warn(&trouble);
    }
    let digest = format!("{:016x}", u64::from_be_bytes(loaded.digest));
    let report = Report {
        unit: loaded.unit.as_str(),
        calibration_digest: digest,
        summary: &summary,
        counters: counters(&stream).collect(),
        log: &log,
    };
    print_summary(args, &if args.json { show::json(&report) } else { human(&report) })?;
    // What went in did not all go out corrected, though the log has it.
    let refused = ticks_in > stream.unit().counters().ticks_out;
    Ok(Exit::of_loss(log.lost_data() || refused))
}

/// Takes what is ready and sums it up.
fn take(stream: &mut UnitStream, sums: &mut Sums, form: Form) -> Made {
    stream.ready().ticks().iter().for_each(|tick| sums.add(tick));
    let mut output = Output::default();
    output.give_out(stream, form, &mut Vec::new());
    vec![(0, output)]
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
