//! `isotherm-replay plot`.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use clap::Args;
use isotherm_cli::{Bar, Exit, print};
use isotherm_correction::units::Span;
use isotherm_log::diff::is_csv;
use isotherm_log::file::write_whole;
use isotherm_log::offline::read_document;
use isotherm_log::part::Messages;
use isotherm_log::plot::{PlotLog, PlotOptions, PlotSummary, plot};
use isotherm_log::source::LogReport;
use isotherm_log::text::LogEvent;
use isotherm_protocol::key::UnitId;
use serde::Serialize;

use super::log_args::{LogArgs, unnamed};
use super::{check_outputs, show};
use crate::error::Error;

/// Most ticks in one batch of a text log.
const BATCH: u64 = 256;
/// Longest batch of a text log (ns): a batch of corrected ticks has one temperature of each channel.
const LONGEST_NS: u64 = 1_000_000_000;
/// Events of a text log that its first gyro tick is looked for among.
const LOOK_AHEAD: usize = 4096;
/// Most bins of a quantity where nobody says.
const DETAIL: u32 = 32_768;

/// Plot a log, or two over one time axis, as one HTML file with zoom
#[derive(Debug, Args)]
#[command(after_help = "Example, in two steps:\n  \
    isotherm-replay simulate --preset mems-chamber --duration 60 --out mems.csv\n  \
    isotherm-replay plot mems.csv --calibration config/calibration/MEMS-0001.toml --out mems.html\n\n\
    The file needs no network and no other file. Two logs: isotherm-replay plot a.mcap --beside b.mcap --out both.html")]
pub(super) struct PlotArgs {
    #[command(flatten)]
    log: LogArgs,
    /// Second log, or a CSV of `isotherm-replay correct`, plotted with the difference; repeatable for files of one log
    #[arg(long, value_name = "LOG")]
    beside: Vec<PathBuf>,
    /// Column mapping of the second log (default: that of the first)
    #[arg(long, value_name = "FILE", requires = "beside")]
    beside_mapping: Option<PathBuf>,
    /// Unit of the second log (default: --unit)
    #[arg(long, value_name = "SERIAL", requires = "beside", value_parser = UnitId::new)]
    beside_unit: Vec<UnitId>,
    /// Calibration document (TOML) that corrects a text log and scales counts (recordings: as recorded)
    #[arg(long, short, value_name = "FILE")]
    calibration: Option<PathBuf>,
    /// HTML file to write
    #[arg(long, short, value_name = "FILE")]
    out: PathBuf,
    /// Replace an existing file
    #[arg(long)]
    overwrite: bool,
    /// Most bins per curve; up to three times as many ticks are drawn one by one
    #[arg(long, value_name = "BINS", default_value_t = DETAIL, value_parser = clap::value_parser!(u32).range(64..=1_048_576))]
    detail: u32,
    /// Print the summary as one JSON object
    #[arg(long)]
    json: bool,
}

/// What the summary says.
#[derive(Debug, Serialize)]
struct Report<'a> {
    page: String,
    bytes: usize,
    #[serde(flatten)]
    summary: &'a PlotSummary,
}

impl PlotArgs {
    /// How the other log is named and read.
    fn other(&self) -> Option<LogArgs> {
        if self.beside.is_empty() {
            return None;
        }
        let mut other = self.log.clone();
        other.log.clone_from(&self.beside);
        let own = |path: &PathBuf| isotherm_log::source::is_recording(path) || is_csv(path);
        let recording = other.log.first().is_some_and(own);
        other.mapping = self.beside_mapping.clone().or_else(|| other.mapping.filter(|_| !recording));
        if !self.beside_unit.is_empty() {
            other.unit.clone_from(&self.beside_unit);
        }
        Some(other)
    }
}

/// Runs the command.
pub(super) fn run(args: &PlotArgs) -> Result<Exit, Error> {
    let (bytes, summary) = draw(args)?;
    let report = Report { page: args.out.display().to_string(), bytes, summary: &summary };
    summary.troubles.iter().for_each(show::warn);
    let lost = summary.reading.iter().any(LogReport::lost_data) || summary.refused_ticks > 0;
    Ok(print(&if args.json { show::json(&report) } else { human(&report) }, Exit::of_loss(lost)))
}

/// Draws a text log that a mapping reads.
pub(super) fn first_plot(log: &LogArgs, out: &Path) -> Result<(), Error> {
    let args = PlotArgs {
        log: log.clone(),
        beside: Vec::new(),
        beside_mapping: None,
        beside_unit: Vec::new(),
        calibration: None,
        out: out.to_owned(),
        overwrite: true,
        detail: DETAIL,
        json: false,
    };
    draw(&args).map(drop)
}

/// A CSV that `isotherm-replay correct` wrote, which needs no mapping; it is of the unit that is given, else of `unnamed`.
fn corrected(log: &LogArgs, unnamed: Option<&UnitId>) -> Result<Option<Messages>, Error> {
    let [path] = log.log.as_slice() else { return Ok(None) };
    if !is_csv(path) {
        return Ok(None);
    }
    let unit = log.units().pop_first().or_else(|| unnamed.cloned());
    unit.map(|unit| Ok(Messages::of_corrected(path, &unit, &log.part()?)?)).transpose()
}

/// Ticks in one batch of a text log, of which the first gyro tick lasts so long.
fn batch_ticks(first: Option<Span>) -> u64 {
    let first_ns = first.and_then(|first| u64::try_from(first.as_ns()).ok()).unwrap_or(0);
    (LONGEST_NS / first_ns.max(1)).clamp(1, BATCH)
}

/// How long the first gyro tick of a text log lasts.
fn first_tick(log: &LogArgs) -> Result<Option<Span>, Error> {
    Ok(log.text_log()?.within(&log.part()?).take(LOOK_AHEAD).find_map(|event| match event {
        Ok(LogEvent::Gyro { tick, .. }) => Some(tick.duration),
        _ => None,
    }))
}

/// Writes the page; its length, and what it shows.
fn draw(args: &PlotArgs) -> Result<(usize, PlotSummary), Error> {
    let other = args.other();
    let mut inputs = args.log.inputs();
    inputs.extend(other.iter().flat_map(LogArgs::inputs));
    inputs.extend(args.calibration.clone());
    check_outputs([args.out.as_path()], inputs.iter().map(PathBuf::as_path), args.overwrite)?;
    let calibration = args.calibration.as_deref();
    let calibration = calibration.map(read_document).transpose()?;

    let unnamed = unnamed();
    let first_units = args.log.units();
    let mut logs = Vec::new();
    let mut bar = None;
    for log in std::iter::once(&args.log).chain(&other) {
        let mut correct_from = None;
        let messages = if let Some(messages) = corrected(log, unnamed.as_ref())? {
            messages
        } else {
            let document = calibration.as_ref().map(|parsed| parsed.document.unit.as_str());
            document.map_or(Ok(()), |unit| log.refuse_document_of_another(unit))?;
            let recording = log.is_recording()?;
            let batch_ticks = batch_ticks(if recording { None } else { first_tick(log)? });
            let batch_ticks = usize::try_from(batch_ticks).unwrap_or(1);
            let (mut files, mut part) = (log.files(batch_ticks, unnamed.as_ref())?, log.part()?);
            if calibration.is_some() && !recording {
                correct_from = Some(files.from_beginning(&mut part)?);
            }
            files.open(&part)?
        };
        bar.get_or_insert_with(|| Bar::over_log(messages.progress().watch()));
        let names: Vec<_> = log.log.iter().filter_map(|path| path.file_name()).collect();
        let name = names.iter().map(|name| name.to_string_lossy()).collect::<Vec<_>>().join(", ");
        // Units of different serials are compared where each log has one that was asked for.
        let one =
            |units: &std::collections::BTreeSet<UnitId>| units.first().filter(|_| units.len() == 1).cloned();
        let shown_as = one(&first_units).filter(|_| log.units().len() == 1);
        logs.push(PlotLog { name, messages, shown_as, correct_from });
    }
    let options = PlotOptions { detail: usize::try_from(args.detail).unwrap_or(usize::MAX), calibration };
    let (page, summary) = plot(logs, &options, &mut |messages| {
        if let Some(bar) = &mut bar {
            bar.show(format!("{messages} messages"));
        }
    })?;
    let html = page.to_html();
    write_whole(&args.out, html.as_bytes(), true)
        .map_err(|source| Error::file(&args.out, "write the page", source))?;
    if let Some(bar) = &bar {
        bar.finish();
    }
    Ok((html.len(), summary))
}

/// The summary in words.
fn human(report: &Report<'_>) -> String {
    let Report { page, bytes, summary } = report;
    let mut text = format!("{page}: {} kB\n", bytes / 1000);
    for (unit, logs) in &summary.units {
        for (index, (log, shown)) in summary.logs.iter().zip(logs).enumerate() {
            let Some(shown) = shown else { continue };
            let unit = summary.serial_in(index, unit);
            let _ = writeln!(
                text,
                "unit {unit} in {log}: {} raw ticks, {} corrected{}, {} announced as missing, {} marks",
                shown.raw_ticks,
                shown.corrected_ticks,
                shown.undrawn(),
                shown.missed_ticks,
                shown.marks
            );
            if shown.marks_left_out + shown.unreadable_messages > 0 {
                let _ = writeln!(
                    text,
                    "  {} further marks left out, {} messages cannot be read",
                    shown.marks_left_out, shown.unreadable_messages
                );
            }
        }
    }
    for (unit, difference) in &summary.differences {
        let _ = writeln!(
            text,
            "unit {}: {} corrected ticks in both, {} of them differ; {} only in the first, {} only in the second",
            summary.serials(unit),
            difference.common_ticks,
            difference.differing_ticks,
            difference.only_first,
            difference.only_second
        );
    }
    if summary.units_left_out > 0 {
        let _ = writeln!(text, "{} further units are left out: choose with --unit", summary.units_left_out);
    }
    summary.reading.iter().for_each(|report| text += &show::reading(report));
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_batch_lasts_a_second_at_most() {
        let ticks = [1, 5, 10, 1000, 4000].map(|ms| batch_ticks(Some(Span::from_ms(ms))));
        assert_eq!(ticks, [256, 200, 100, 1, 1]);
        assert_eq!(batch_ticks(None), 256);
    }
}
