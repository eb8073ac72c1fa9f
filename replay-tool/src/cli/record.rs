//! `isotherm-replay record`.

use std::path::PathBuf;
use std::time::Duration;

use clap::{Args, ValueEnum};
use isotherm_bus::ClientOptions;
use isotherm_cli::{Exit, duration, print};
use isotherm_log::recording::RecordingOptions;
use isotherm_protocol::key::UnitId;

use super::show;
use crate::error::Error;
use crate::record::{Bounds, RecordOptions, ServiceWait, TopicFilter, record};

mod table;

use table::{Live, human};

/// Smallest file at which a new one may be begun (bytes).
const SMALLEST_FILE: u64 = 16 << 10;
/// Smallest queue (bytes).
const SMALLEST_QUEUE: u64 = 1 << 20;

/// Record what is on the bus to MCAP files
#[derive(Debug, Args)]
#[command(after_help = "Example, five seconds of what is published on this address, without a service:\n  \
    isotherm-replay record --out run.mcap --listen tcp/127.0.0.1:0 --no-service --duration 5\n\n\
    With `isotherm serve` running, the recording alone reproduces the service's output to the bit: it contains raw and\n\
    corrected messages, status, the journal of every unit, calibration documents, the service's configuration and the\n\
    units' histories. Ctrl-C ends it in order:\n  \
    isotherm-replay record --out run.mcap\n\n\
    Foxglove and PlotJuggler open the files: each topic of ticks has a channel …/json too.\n\
    Exit code 3: messages were lost, or the disk was full; everything before that is in the files.")]
#[expect(clippy::struct_excessive_bools, reason = "each is a switch of the command line")]
pub(super) struct RecordArgs {
    /// File to write, with or without .mcap; with --max-size or --max-duration RUN-0001.mcap …
    #[arg(long, short, value_name = "FILE")]
    out: PathBuf,
    #[command(flatten)]
    session: ClientOptions,
    /// Unit serial, repeatable (default: all)
    #[arg(long, short, value_name = "SERIAL", value_parser = UnitId::new)]
    unit: Vec<UnitId>,
    /// raw, reference, corrected, status, service, journal, or a key expression; repeatable (default: all of these)
    #[arg(long, short, value_name = "TOPIC")]
    topic: Vec<TopicFilter>,
    /// Stop after this time (s)
    #[arg(long, value_name = "SECONDS", value_parser = duration(0.0..=1e9))]
    duration: Option<Duration>,
    /// Stop when the last service has stopped
    #[arg(long, conflicts_with = "no_service")]
    until_service_stops: bool,
    /// Longest wait for a service and its answers (s)
    #[arg(long, value_name = "SECONDS", default_value = "10", value_parser = duration(0.01..=1e9), hide_short_help = true)]
    timeout: Duration,
    /// Wait for a service without a limit
    #[arg(long, conflicts_with = "no_service")]
    wait: bool,
    /// Record without querying a service: its output cannot be reproduced to the bit
    #[arg(long, hide_short_help = true)]
    no_service: bool,
    /// Compression
    #[arg(long, value_enum, default_value_t, hide_short_help = true)]
    compression: Compression,
    /// Leave out the JSON channels for viewers: files are half as long
    #[arg(long, hide_short_help = true)]
    no_json_channels: bool,
    /// Longest chunk (s), the most that a crash of the recorder loses
    #[arg(long, value_name = "SECONDS", default_value = "1", value_parser = duration(0.01..=1e9), hide_short_help = true)]
    chunk_seconds: Duration,
    /// Start a new file at this size (bytes, or with K, M, G: 1024, 1024², 1024³)
    #[arg(long, value_name = "BYTES", value_parser = bytes(SMALLEST_FILE), hide_short_help = true)]
    max_size: Option<u64>,
    /// Start a new file after this time (s)
    #[arg(long, value_name = "SECONDS", value_parser = duration(0.1..=1e9), hide_short_help = true)]
    max_duration: Option<Duration>,
    /// Keep the newest N files of this recording, delete older ones
    #[arg(long, value_name = "FILES", value_parser = clap::value_parser!(u32).range(1..), hide_short_help = true)]
    keep: Option<u32>,
    /// Replace files of this name
    #[arg(long)]
    overwrite: bool,
    /// Memory for messages waiting for the disk (bytes, or with K, M, G); more are counted as lost
    #[arg(long, value_name = "BYTES", default_value = "256M", value_parser = bytes(SMALLEST_QUEUE), hide_short_help = true)]
    queue: u64,
    /// Print the summary as one JSON object
    #[arg(long)]
    json: bool,
}

/// How chunks are compressed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
pub(super) enum Compression {
    /// Not at all.
    None,
    /// Zstandard.
    #[default]
    Zstd,
}

impl Compression {
    /// Whether they are.
    pub(super) fn compresses(self) -> bool {
        self == Self::Zstd
    }
}

/// Reads `500M`, and no less than the least.
fn bytes(least: u64) -> impl Fn(&str) -> Result<u64, String> + Clone {
    move |text| {
        let unit = text.chars().next_back().and_then(|unit| "KMG".find(unit.to_ascii_uppercase()));
        let (number, shift) = unit.map_or((text, 0), |place| (&text[..text.len() - 1], 10 * (place + 1)));
        let bytes = number.parse::<u64>().ok().and_then(|number| number.checked_mul(1 << shift));
        bytes.filter(|bytes| *bytes >= least).ok_or_else(|| {
            format!(
                "must be a whole number of bytes, or one followed by K, M or G, and at least {least} bytes"
            )
        })
    }
}

impl RecordArgs {
    /// What they ask for.
    fn options(&self) -> Result<RecordOptions, Error> {
        if self.keep.is_some() && self.max_size.is_none() && self.max_duration.is_none() {
            return Err(Error::Usage("--keep needs --max-size or --max-duration".to_owned()));
        }
        let service = if self.no_service {
            ServiceWait::Without
        } else if self.wait {
            ServiceWait::Forever
        } else {
            ServiceWait::Within(self.timeout)
        };
        Ok(RecordOptions {
            out: self.out.clone(),
            session: self.session.clone(),
            units: self.unit.clone(),
            topics: self.topic.clone(),
            service,
            query_limit: self.timeout,
            duration: self.duration,
            until_service_stops: self.until_service_stops,
            writing: RecordingOptions {
                compress: self.compression.compresses(),
                overwrite: self.overwrite,
                json: !self.no_json_channels,
                ..RecordingOptions::default()
            },
            bounds: Bounds {
                chunk: self.chunk_seconds,
                file_bytes: self.max_size,
                file_time: self.max_duration,
            },
            keep: self.keep.and_then(|keep| usize::try_from(keep).ok()),
            queue_bytes: self.queue,
        })
    }
}

/// Runs the command.
pub(super) fn run(args: &RecordArgs) -> Result<Exit, Error> {
    let options = args.options()?;
    let runtime = tokio::runtime::Runtime::new().map_err(Error::Runtime)?;
    let mut live = Live::new();
    let recorded = runtime.block_on(record(&options, |report| live.show(report)));
    live.finish();
    // A writing thread that somebody in a hurry has left behind does not hold the program up.
    runtime.shutdown_background();
    let report = recorded.map_err(|error| table::advise(error, &options))?;
    live.warn(&report);
    if let Some(failure) = &report.done.failure {
        show::warn(format_args!("recording has stopped: {failure}; everything before that is in the file"));
    }
    if report.lost > 0 {
        show::warn(format_args!("{} of {} messages are lost", report.lost, report.received));
    }
    if !report.done.units_without_memory.is_empty() {
        let units = report.done.units_without_memory.join(", ");
        show::warn(format_args!(
            "no memory or journal of {units} from before the recording: its output cannot be reproduced to the bit"
        ));
    }
    if args.topic.is_empty() && !report.done.units_without_raw.is_empty() {
        let units = report.done.units_without_raw.join(", ");
        show::warn(format_args!(
            "no raw messages of {units} were received: producers do not reach this recorder; give one --connect, to \
             the service or a router, and no --listen"
        ));
    }
    let text = if args.json { show::json(&report) } else { human(&report) };
    Ok(print(&text, Exit::of_loss(report.lost_data())))
}
