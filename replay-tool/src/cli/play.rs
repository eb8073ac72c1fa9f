//! `isotherm-replay play`.

mod tables;

use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

use clap::Args;
use isotherm_bus::ClientOptions;
use isotherm_bus::outlet::least_in_flight;
use isotherm_cli::{Exit, duration, number, print};
use isotherm_correction::sample::ChannelName;
use isotherm_document::few;
use isotherm_log::faults::FaultOptions;
use isotherm_log::message::Topic;
use isotherm_log::schedule::Clock;
use isotherm_log::source::LogReport;
use isotherm_protocol::key::UnitId;
use isotherm_protocol::raw::{HealthReading, MAX_HEALTH};
use serde::Serialize;
use zenoh::key_expr::OwnedKeyExpr;

use super::{LogArgs, show};
use crate::error::Error;
use crate::keyboard::Keyboard;
use crate::pace::Speed;
use crate::play::{Acknowledge, PlayOptions, PlayReport, Played, Screen, UnitReport, play, wanted};

/// Most copies of a unit.
const MAX_COPIES: u32 = 999;

/// Play a log to the raw topics of its units
#[derive(Debug, Args)]
#[command(after_help = "Example, with `isotherm serve` running:\n  \
    isotherm-replay simulate --preset mems-chamber --duration 60 --out mems.csv\n  \
    isotherm-replay play mems.csv --unit MEMS-0001 --speed max\n  \
    isotherm-replay play mems.csv -u MEMS --speed max --batch 10 \
    --copies 20 --seed 1 --loss 0.01 --duplicate 0.01 --reorder 0.01\n\n\
    At any speed, ticks are sent at most --in-flight ahead of the corrected output, so none is lost.\n\
    Keys on a terminal: space pauses and resumes; n or → (paused) plays up to the next gyro batch; + and - double and\n\
    halve the speed; ← and → or [ and ] go 10 s back and forward; q ends in order, Ctrl-C at once.\n\
    Exit code 3: ticks were lost, or rows or chunks of the log could not be read.")]
pub(super) struct PlayArgs {
    #[command(flatten)]
    log: LogArgs,
    #[command(flatten)]
    session: ClientOptions,
    /// Speed as a multiple of the recorded one, or max: as fast as the service keeps up
    #[arg(long, value_name = "N|max", default_value = "1")]
    speed: Speed,
    /// Clock that sets the pace: ends of ticks, or reception [default: receive; text logs: event]
    #[arg(long, value_enum, hide_short_help = true)]
    clock: Option<ClockArg>,
    /// Repeat the log forever, or N times
    #[arg(long = "loop", value_name = "N", num_args = 0..=1, require_equals = true, default_missing_value = "0", hide_short_help = true)]
    passes: Option<u64>,
    /// Play only these keys, e.g. 'imu/*/raw/gyro'; repeatable
    #[arg(long, value_name = "KEY", value_parser = key_expression, hide_short_help = true)]
    topic: Vec<OwnedKeyExpr>,
    /// Play a unit of the log as another one; repeatable
    #[arg(long, value_name = "UNIT=UNIT", value_parser = remapping)]
    remap: Vec<(UnitId, UnitId)>,
    /// Play each unit N times in parallel: SERIAL-001, SERIAL-002 …
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=i64::from(MAX_COPIES)), hide_short_help = true)]
    copies: Option<u32>,
    /// Delay messages by up to this, in order (ms of log time)
    #[arg(long, value_name = "MS", default_value_t = 0, value_parser = clap::value_parser!(u32).range(0..=3_600_000), hide_short_help = true)]
    jitter_ms: u32,
    /// Share of messages to leave out (0…1)
    #[arg(long, value_name = "P", default_value_t = 0.0, value_parser = share(), hide_short_help = true)]
    loss: f64,
    /// Share of messages to send twice (0…1)
    #[arg(long, value_name = "P", default_value_t = 0.0, value_parser = share(), hide_short_help = true)]
    duplicate: f64,
    /// Share of messages to send after one to four later ones of their key (0…1)
    #[arg(long, value_name = "P", default_value_t = 0.0, value_parser = share(), hide_short_help = true)]
    reorder: f64,
    /// Seed of these four faults
    #[arg(long, value_name = "S", default_value_t = 1, hide_short_help = true)]
    seed: u64,
    /// Number of the first series, for runs that are equal to the byte (default: a new one)
    #[arg(long, value_name = "N", hide_short_help = true)]
    series: Option<u64>,
    /// Gyro ticks per message of a text log (1…4096) [default: 1]
    #[arg(long, value_name = "TICKS", value_parser = clap::value_parser!(u16).range(1..=4096), hide_short_help = true)]
    batch: Option<u16>,
    /// Most unacknowledged gyro ticks per unit; at least 2 × batch + 256 [default: 16384 shared, at most 4096 each]
    #[arg(long, value_name = "TICKS", hide_short_help = true)]
    in_flight: Option<u64>,
    /// Do not wait for corrected ticks: for other subscribers, or a unit in standby
    #[arg(long, conflicts_with = "in_flight", hide_short_help = true)]
    no_acknowledge: bool,
    /// Longest wait for service, subscribers and output (s)
    #[arg(long, value_name = "SECONDS", default_value = "10", value_parser = duration(0.0..=1e9), hide_short_help = true)]
    wait: Duration,
    /// Health reading to add to a text log once a second: voltage (V) or counter; repeatable
    #[arg(long, value_name = "NAME=VALUE", value_parser = health_reading)]
    health: Vec<HealthReading>,
    /// Print the summary as one JSON object
    #[arg(long)]
    json: bool,
}

/// Whose clock sets the pace.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum ClockArg {
    /// The producers': the ends of ticks
    Event,
    /// The recorder's: the moments of reception
    Receive,
}

/// Everything that the summary says.
#[derive(Debug, Serialize)]
struct Report<'a> {
    #[serde(flatten)]
    play: &'a PlayReport,
    log: &'a LogReport,
}

/// Reads `half-wave x=48.2`.
fn health_reading(text: &str) -> Result<HealthReading, String> {
    let (name, value) = text.split_once('=').ok_or("must be NAME=VALUE")?;
    let name = ChannelName::from(name).map_err(|_| "the name may have at most 24 bytes")?;
    let value = value.parse().map_err(|_| format!("{value:?} is not a number"))?;
    Ok(HealthReading { name, value })
}

/// Reads `UNIT=UNIT`.
fn remapping(text: &str) -> Result<(UnitId, UnitId), String> {
    let (old, new) =
        text.split_once('=').ok_or("must be UNIT=UNIT: the serial in the log, the serial to play it as")?;
    let unit = |serial: &str| UnitId::new(serial).map_err(|error| format!("{serial:?} {error}"));
    Ok((unit(old)?, unit(new)?))
}

/// Reads a key expression.
pub(super) fn key_expression(text: &str) -> Result<OwnedKeyExpr, String> {
    OwnedKeyExpr::new(text).map_err(|error| isotherm_bus::words(&error))
}

/// For `value_parser`: a share.
fn share() -> impl Fn(&str) -> Result<f64, String> + Clone {
    number("", 0.0..=1.0)
}

impl PlayArgs {
    /// What is played, and how.
    fn options(&self) -> Result<PlayOptions, Error> {
        let text = !self.log.is_recording()?;
        let batch = self.batch(text)?;
        if self.health.len() > MAX_HEALTH {
            let given = self.health.len();
            return Err(Error::Usage(format!("--health is given {given} times, may be {MAX_HEALTH} times")));
        }
        let mut names = BTreeMap::new();
        for (old, new) in &self.remap {
            if names.insert(old.clone(), new.clone()).is_some() {
                return Err(Error::Usage(format!("--remap names {old} twice")));
            }
        }
        Ok(PlayOptions {
            files: self.log.files(usize::from(batch), None)?,
            part: self.log.part()?,
            topics: self.topic.clone(),
            clock: match self.clock {
                Some(ClockArg::Event) => Clock::Event,
                Some(ClockArg::Receive) | None => Clock::Receive,
            },
            speed: self.speed,
            passes: match self.passes {
                Some(0) => None,
                passes => Some(passes.unwrap_or(1)),
            },
            names,
            copies: self.copies,
            faults: FaultOptions {
                jitter_ns: u64::from(self.jitter_ms) * 1_000_000,
                loss: self.loss,
                duplicate: self.duplicate,
                reorder: self.reorder,
            },
            seed: self.seed,
            series: self.series,
            health: self.health.clone(),
            session: self.session.clone(),
            wait: self.wait,
            acknowledge: self.acknowledge(batch)?,
        })
    }

    /// Gyro ticks in a batch of a text log; refuses what is not for recordings, or not for text logs.
    fn batch(&self, text: bool) -> Result<u16, Error> {
        let refused = match (text, self.clock, self.batch, self.health.is_empty()) {
            (true, Some(ClockArg::Receive), ..) => {
                "--clock receive is for recordings: a text log does not say when it was received"
            }
            (false, _, Some(_), _) => "--batch is for text logs: a recording keeps its batches",
            (false, _, _, false) => "--health is for text logs: a recording has its own health readings",
            _ => return Ok(self.batch.unwrap_or(1)),
        };
        Err(Error::Usage(refused.to_owned()))
    }

    fn acknowledge(&self, batch: u16) -> Result<Acknowledge, Error> {
        let least = least_in_flight(u64::from(batch));
        match self.in_flight {
            Some(in_flight) if in_flight < least => Err(Error::Usage(format!(
                "--in-flight is {in_flight}, must be at least {least} with --batch {batch}"
            ))),
            in_flight if !self.no_acknowledge => Ok(Acknowledge::Bounded(in_flight)),
            _ => Ok(Acknowledge::No),
        }
    }
}

/// Opens the log, and refuses another serial for a unit that it does not have: a misspelt one would leave the unit on its own topics,
/// where the instrument itself may be.
fn check_names(options: &PlayOptions) -> Result<(), Error> {
    let mut messages = options.files.open(&options.part)?;
    let (mut missing, mut units): (BTreeSet<_>, BTreeSet<_>) =
        (options.names.keys().collect(), BTreeSet::new());
    // Up to the first message of the last one: mostly the log's first second.
    while !missing.is_empty() {
        let Some(message) = messages.next_message()? else { break };
        if let Topic::Raw(unit, _) | Topic::Reference(unit) = &message.topic
            && wanted(&options.topics, &message.topic)
        {
            missing.remove(unit);
            units.insert(unit.to_string());
        }
    }
    let Some(missing) = missing.first() else { return Ok(()) };
    let has = few(&units);
    Err(Error::Usage(format!("--remap names {missing}, but there is no such unit to play; units: {has}")))
}

/// Runs the command.
pub(super) fn run(args: &PlayArgs) -> Result<Exit, Error> {
    let options = args.options()?;
    // A log that cannot be read is said before a session is opened.
    check_names(&options)?;
    let runtime = tokio::runtime::Runtime::new().map_err(Error::Runtime)?;
    let (sender, commands) = tokio::sync::mpsc::unbounded_channel();
    let keyboard = Keyboard::listen(sender);
    let screen = Screen::new(keyboard.is_some());
    let played = runtime.block_on(play(&options, commands, &screen));
    screen.finish();
    drop(keyboard);
    // What Zenoh may still do is not waited for.
    runtime.shutdown_background();
    let Played { report: play, log, ended } = played?;
    tables::warnings(&play).iter().for_each(show::warn);
    let report = Report { play: &play, log: &log };
    let lost = play.lost_data() || log.lost_data();
    let text = if args.json { show::json(&report) } else { tables::human(&report, &options) };
    let exit = print(&text, Exit::of_loss(lost));
    ended?;
    // What `--loss` withholds was there.
    let found = |unit: &UnitReport| unit.counts.messages_sent + unit.counts.messages_withheld > 0;
    if !lost && !play.stopped && !play.units.iter().any(found) {
        return Err(Error::Nothing("played", "raw message"));
    }
    Ok(exit)
}
