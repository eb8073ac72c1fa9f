//! `isotherm-replay play`.

use clap::Args;
use isotherm_bus::SessionOptions;
use isotherm_correction::sample::ChannelName;
use isotherm_protocol::raw::HealthReading;
use serde::Serialize;

use super::{LogArgs, Outcome, print, show};
use crate::error::Error;
use crate::pace::Speed;
use crate::play::{PlayOptions, PlayReport, play};
use crate::progress::Bar;
use isotherm_log::offline::unit_id;
use isotherm_log::text::ReadReport;

/// Gyro ticks that may be under way where nothing else is said.
const IN_FLIGHT: u64 = 4096;

/// Play a log to the raw topics of a unit
#[derive(Debug, Args)]
#[command(after_help = "Example, with `isotherm serve --listen tcp/127.0.0.1:7447` running:\n  \
    isotherm-replay simulate --preset mems-chamber --duration 60 --out mems.csv\n  \
    isotherm-replay play mems.csv --mapping mems.mapping.toml --unit MEMS-0001 --connect tcp/127.0.0.1:7447 --speed max\n\n\
    At any speed, ticks are sent no further ahead of what comes back corrected than --in-flight, so that none is lost.\n\
    Exit code 3: ticks were lost, or rows of the log could not be read.")]
pub(super) struct PlayArgs {
    #[command(flatten)]
    log: LogArgs,
    /// Serial of the unit that the log is played as
    #[arg(long, short, value_name = "SERIAL")]
    unit: String,
    #[command(flatten)]
    session: SessionOptions,
    /// Times as fast as recorded, or max: as fast as the service keeps up without losing a tick
    #[arg(long, value_name = "N|max", default_value = "1")]
    speed: Speed,
    /// Gyro ticks in one message
    #[arg(long, value_name = "TICKS", default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..=4096))]
    batch: u16,
    /// Most gyro ticks sent and not come back; at least 2 × batch + 256
    #[arg(long, value_name = "TICKS")]
    in_flight: Option<u64>,
    /// Do not wait for anything to come back: for listeners other than the service
    #[arg(long, conflicts_with = "in_flight")]
    no_acknowledge: bool,
    /// What the instrument reports of itself, once a second: a voltage (V) or counter that the document tests
    #[arg(long, value_name = "NAME=VALUE", value_parser = health_reading)]
    health: Vec<HealthReading>,
    /// Print the summary as one JSON object
    #[arg(long)]
    json: bool,
}

/// Reads `half-wave x=48.2`.
fn health_reading(text: &str) -> Result<HealthReading, String> {
    let (name, value) = text.split_once('=').ok_or("must be NAME=VALUE")?;
    let name = ChannelName::from(name).map_err(|_| "the name may have at most 24 bytes")?;
    let value = value.parse().map_err(|_| format!("{value:?} is no number"))?;
    Ok(HealthReading { name, value })
}

/// Everything that the summary says.
#[derive(Debug, Serialize)]
struct Report<'a> {
    #[serde(flatten)]
    play: &'a PlayReport,
    log: &'a ReadReport,
}

/// Runs the command.
pub(super) fn run(args: PlayArgs) -> Result<Outcome, Error> {
    let batch = u64::from(args.batch);
    let options = PlayOptions {
        unit: unit_id(&args.unit)?,
        session: args.session,
        speed: args.speed,
        batch_ticks: usize::from(args.batch),
        health: args.health,
        max_in_flight: (!args.no_acknowledge).then(|| args.in_flight.unwrap_or(IN_FLIGHT.max(4 * batch))),
    };
    let least = 2 * batch + 256;
    if let Some(in_flight) = args.in_flight.filter(|in_flight| *in_flight < least) {
        return Err(Error::Usage(format!(
            "--in-flight is {in_flight}, must be at least {least} with --batch {batch}"
        )));
    }
    let mut events = args.log.open()?;
    let mut bar = Bar::over_log(events.inner().progress());
    let runtime = tokio::runtime::Runtime::new().map_err(|source| Error::Runtime { source })?;
    let played = runtime.block_on(play(&mut events, &options, |report| {
        let speed = if report.elapsed_s > 0.0 { report.log_s / report.elapsed_s } else { 0.0 };
        bar.step(|| format!("{} ticks  {speed:.1}×", report.ticks_sent));
    }));
    bar.finish();
    let (play, log) = (played?, events.inner().report());
    let report = Report { play: &play, log: &log };
    if play.ticks_uncalibrated.is_some_and(|ticks| ticks > 0) {
        show::warn(&format!(
            "{} has no calibration in the service: its readings came back unscaled",
            play.unit
        ));
    }
    if play.restarts.is_some_and(|restarts| restarts > 0)
        || play.ticks_duplicated.is_some_and(|ticks| ticks > 0)
    {
        show::warn(&format!(
            "somebody else plays {}, or more than one service answers: what came back is not sure to be what was sent",
            play.unit
        ));
    }
    print(if args.json { show::json(&report) } else { human(&report) }.as_bytes())?;
    if play.stopped {
        return Err(Error::Stopped);
    }
    Ok(if play.lost_data() || log.lost_data() { Outcome::DataLoss } else { Outcome::Complete })
}

/// The summary as a table.
fn human(report: &Report<'_>) -> String {
    let play = report.play;
    let back = |ticks: Option<u64>| ticks.map_or("not asked for".to_owned(), |ticks| ticks.to_string());
    let rows = [
        ("unit", play.unit.clone()),
        ("gyro ticks sent", play.ticks_sent.to_string()),
        ("accelerometer ticks sent", play.accel_ticks_sent.to_string()),
        ("temperature readings sent", play.temperature_readings_sent.to_string()),
        ("came back", back(play.ticks_acknowledged)),
        ("of these uncalibrated", back(play.ticks_uncalibrated)),
        ("lost", back(play.ticks_lost)),
        ("duplicated", back(play.ticks_duplicated)),
        ("announced missing", back(play.ticks_announced_missing)),
        ("missing in the log", play.log_gaps.to_string()),
        ("time in the log (s)", format!("{:.3}", play.log_s)),
        ("time taken (s)", format!("{:.3}", play.elapsed_s)),
        ("actual speed", format!("{:.2}×", play.actual_speed)),
        ("most behind schedule (ms)", format!("{:.3}", play.latest_s * 1e3)),
    ];
    show::table(&rows) + &show::reading(report.log)
}
