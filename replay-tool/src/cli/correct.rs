//! `isotherm-replay correct`.

use std::io::{self, Write};
use std::path::{Path, PathBuf};

use clap::Args;
use isotherm_correction::navigation::NavigationStep;
use isotherm_correction::unit::UnitSettings;
use isotherm_correction::units::Span;
use serde::Serialize;

use super::{LogArgs, Outcome, print, show};
use crate::error::Error;
use crate::output::{Format, Output, write_frame, write_header, write_tick};
use crate::progress::Bar;
use crate::summary::{Summary, Sums};
use isotherm_log::file::refuse_overwriting;
use isotherm_log::offline::{Offline, load_calibration};
use isotherm_log::text::ReadReport;

/// Outputs that are written together.
const BLOCK: usize = 512;

/// Correct a log offline, through the state machine of the service
#[derive(Debug, Args)]
#[command(after_help = "Example, in two steps:\n  \
    isotherm-replay simulate --preset mems-chamber --duration 60 --out mems.csv\n  \
    isotherm-replay correct mems.csv --mapping mems.mapping.toml --calibration config/calibration/MEMS-0001.toml --out corrected.csv\n\n\
    The CSV's columns are named with their units; its numbers read back to the bit.")]
pub(super) struct CorrectArgs {
    #[command(flatten)]
    log: LogArgs,
    /// Calibration document (TOML)
    #[arg(long, short, value_name = "FILE")]
    calibration: PathBuf,
    /// Where the corrected ticks go; - is standard output; without it, only the summary is printed
    #[arg(long, short, value_name = "FILE")]
    out: Option<PathBuf>,
    /// How they are written
    #[arg(long, value_enum, default_value_t)]
    format: Format,
    /// How long a gyro tick waits for its accelerometer tick, in the log's time (ms), as the service's
    #[arg(long, value_name = "MS", default_value_t = 50)]
    pairing_window_ms: u32,
    /// A temperature reading takes effect for ticks that end this long after it (ms), as the service's
    #[arg(long, value_name = "MS", default_value_t = 50)]
    temperature_delay_ms: u32,
    /// Ticks that are summed to one navigation step (1…1000), as the service's
    #[arg(long, value_name = "TICKS", default_value_t = 1)]
    navigation_ticks: u16,
    /// Apply coning and sculling terms to navigation steps, as the service's
    #[arg(long)]
    coning_sculling: bool,
    /// Print the summary as one JSON object
    #[arg(long)]
    json: bool,
}

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

impl CorrectArgs {
    /// The unit's settings.
    fn settings(&self) -> Result<UnitSettings, Error> {
        let navigation = NavigationStep::new(self.navigation_ticks, self.coning_sculling)
            .map_err(|error| Error::Usage(format!("--navigation-ticks: {error}")))?;
        Ok(UnitSettings {
            pairing_window: Span::from_ms(self.pairing_window_ms),
            temperature_delay: Span::from_ms(self.temperature_delay_ms),
            navigation,
            ..UnitSettings::default()
        })
    }
}

/// Runs the command.
pub(super) fn run(args: &CorrectArgs) -> Result<Outcome, Error> {
    let settings = args.settings()?;
    let loaded = load_calibration(&args.calibration)?;
    for warning in &loaded.warnings {
        show::warn(&warning.to_string());
    }
    let mut events = args.log.open()?;
    if let Some(out) = &args.out {
        let inputs = events.inner().paths().iter().chain([&args.log.mapping, &args.calibration]);
        refuse_overwriting(out, &inputs.map(PathBuf::as_path).collect::<Vec<_>>())?;
    }
    let mut output = args.out.as_deref().map(Output::create).transpose()?;
    if let Some(output) = output.as_mut().filter(|_| args.format == Format::Csv) {
        output.write(|writer| write_header(writer))?;
    }
    let mut unit = Offline::new(&loaded, settings);
    let mut sums = Sums::default();
    let mut bar = Bar::over_log(events.inner().progress());
    for event in &mut events {
        unit.handle(&event?);
        if unit.ready() >= BLOCK {
            take(&mut unit, &mut sums, output.as_mut(), args.format)?;
        }
        bar.step(|| format!("{} ticks", sums.ticks()));
    }
    unit.finish();
    take(&mut unit, &mut sums, output.as_mut(), args.format)?;
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
    Ok(if log.lost_data() || unit.refused() > 0 { Outcome::DataLoss } else { Outcome::Complete })
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
