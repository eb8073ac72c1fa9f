//! Text logs: one unit with one calibration.

use std::io::{self, Write};
use std::path::{Path, PathBuf};

use isotherm_cli::{Bar, Exit};
use isotherm_log::file::refuse_overwriting;
use isotherm_log::offline::{Offline, load_calibration};
use isotherm_log::text::ReadReport;
use serde::Serialize;

use super::CorrectArgs;
use crate::cli::{print, show};
use crate::error::Error;
use crate::output::{Format, Output, write_frame, write_header, write_tick};
use crate::summary::{Summary, Sums};

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
    let format = args.format.unwrap_or_default();
    let calibration = calibration(args)?;
    if args.out.as_ref().and_then(|out| out.extension()).is_some_and(|extension| extension == "mcap") {
        return super::recording::run_text(args, calibration);
    }
    let loaded = load_calibration(calibration)?;
    for warning in &loaded.warnings {
        show::warn(&warning.to_string());
    }
    let mut events = args.log.events()?;
    if let Some(out) = &args.out {
        let mapping = args.log.mapping_file();
        let inputs = events.inner().paths().iter().chain(&mapping).map(PathBuf::as_path);
        refuse_overwriting(out, &inputs.chain([calibration]).collect::<Vec<_>>())?;
    }
    let out = args.out.as_deref();
    let mut output = out.map(|out| Output::create(out, args.overwrite)).transpose()?;
    if let Some(output) = output.as_mut().filter(|_| format == Format::Csv) {
        output.write(|writer| write_header(writer))?;
    }
    let mut unit = Offline::new(&loaded, settings);
    let mut sums = Sums::default();
    let mut bar = Bar::over_log(events.inner().progress().watch());
    for event in &mut events {
        unit.handle(&event?);
        if unit.ready() >= BLOCK {
            take(&mut unit, &mut sums, output.as_mut(), format)?;
        }
        bar.step_saying(|| Some(format!("{} ticks", sums.ticks())));
    }
    unit.finish();
    take(&mut unit, &mut sums, output.as_mut(), format)?;
    output.map(Output::finish).transpose()?;
    bar.finish();

    for trouble in unit.troubles() {
        show::warn(&trouble);
    }
    let (summary, log) = (sums.summary(), events.inner().report());
    let digest = format!("{:016x}", u64::from_be_bytes(loaded.digest));
    let report = Report {
        unit: loaded.unit.as_str(),
        calibration_digest: digest,
        summary: &summary,
        counters: unit.counters().into_iter().collect(),
        log: &log,
    };
    let text = if args.json { show::json(&report) } else { human(&report) };
    if args.out.as_deref() == Some(Path::new("-")) {
        let _ = io::stderr().write_all(text.as_bytes());
    } else {
        print(text.as_bytes())?;
    }
    Ok(Exit::of_loss(log.lost_data() || unit.refused() > 0))
}

/// Takes what is ready, sums it up and writes it.
fn take(
    unit: &mut Offline,
    sums: &mut Sums,
    output: Option<&mut Output>,
    format: Format,
) -> Result<(), Error> {
    unit.peek().for_each(|tick| sums.add(tick));
    match (output, format) {
        (None, _) => unit.take().clear(),
        (Some(output), Format::Csv) => {
            let ticks = unit.take();
            output.write(|writer| ticks.iter().try_for_each(|tick| write_tick(writer, tick)))?;
        }
        (Some(output), Format::Wire) => {
            let mut frame = Vec::new();
            while unit.next_frame(&mut frame) {
                output.write(|writer| write_frame(writer, &frame))?;
            }
        }
    }
    Ok(())
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
