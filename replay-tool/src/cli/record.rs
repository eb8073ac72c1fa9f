//! `isotherm-replay record`.

use std::path::PathBuf;
use std::time::Duration;

use clap::{Args, ValueEnum};
use isotherm_bus::ClientOptions;
use isotherm_cli::Exit;
use isotherm_correction::units::Span;
use isotherm_log::offline::unit_id;

use super::{print, seconds, show};
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
#[command(
    after_help = "Example, of whatever is published on this address for five seconds, with no service to ask:\n  \
    isotherm-replay record --out run.mcap --listen tcp/127.0.0.1:0 --no-service --duration 5\n\n\
    With `isotherm serve` running, the recording alone is enough to correct again what the service\n\
    corrected, to the bit: it holds raw and corrected messages, status, the journal of every unit, the calibration documents,\n\
    the service's configuration and the units' histories. Ctrl-C ends it in order:\n  \
    isotherm-replay record --out run.mcap\n\n\
    Foxglove and PlotJuggler open the files: beside each topic of ticks is a channel …/json.\n\
    Exit code 3: messages were lost, or the disk was full; the files hold everything up to there."
)]
#[expect(clippy::struct_excessive_bools, reason = "each is a switch of the command line")]
pub(super) struct RecordArgs {
    /// File to write to; .mcap is added where it is missing; with --max-size or --max-duration RUN-0001.mcap and so on
    #[arg(long, short, value_name = "FILE")]
    out: PathBuf,
    #[command(flatten)]
    session: ClientOptions,
    /// Unit serial, repeatable (default: all)
    #[arg(long, short, value_name = "SERIAL")]
    unit: Vec<String>,
    /// raw, reference, corrected, status, service, journal, or a key expression; repeatable (default: all of these)
    #[arg(long, short, value_name = "TOPIC")]
    topic: Vec<TopicFilter>,
    /// Stop after this long (s)
    #[arg(long, value_name = "SECONDS", value_parser = seconds)]
    duration: Option<Span>,
    /// Stop when the last service has stopped
    #[arg(long, conflicts_with = "no_service")]
    until_service_stops: bool,
    /// How long to wait for a service, and for its answers (s)
    #[arg(long, value_name = "SECONDS", default_value = "10", value_parser = seconds, hide_short_help = true)]
    timeout: Span,
    /// Wait for a service however long it takes
    #[arg(long, conflicts_with = "no_service")]
    wait: bool,
    /// Record without a service, or without asking it: the log cannot be corrected again to the bit
    #[arg(long, hide_short_help = true)]
    no_service: bool,
    /// How chunks are compressed
    #[arg(long, value_enum, default_value_t, hide_short_help = true)]
    compression: Compression,
    /// Leave out the channels with ticks and readings as JSON, which viewers show: files are half as long
    #[arg(long, hide_short_help = true)]
    no_json_channels: bool,
    /// End a chunk after this long at the latest (s): what a kill can cost
    #[arg(long, value_name = "SECONDS", default_value = "1", value_parser = seconds, hide_short_help = true)]
    chunk_seconds: Span,
    /// Begin a new file when one is this long (bytes, or with K, M, G: 1024, 1024², 1024³)
    #[arg(long, value_name = "BYTES", value_parser = bytes, hide_short_help = true)]
    max_size: Option<u64>,
    /// Begin a new file after this long (s)
    #[arg(long, value_name = "SECONDS", value_parser = seconds, hide_short_help = true)]
    max_duration: Option<Span>,
    /// Keep so many of the newest files and delete older ones of this recording
    #[arg(long, value_name = "FILES", value_parser = clap::value_parser!(u32).range(1..), hide_short_help = true)]
    keep: Option<u32>,
    /// Write over files of this name
    #[arg(long)]
    overwrite: bool,
    /// What may wait in memory to be written (bytes, or with K, M, G); messages beyond it are counted as lost
    #[arg(long, value_name = "BYTES", default_value = "256M", value_parser = bytes, hide_short_help = true)]
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

/// Reads `500M`.
fn bytes(text: &str) -> Result<u64, String> {
    let (number, factor) = match text.char_indices().last() {
        Some((at, 'K' | 'k')) => (text.get(..at), 1 << 10),
        Some((at, 'M' | 'm')) => (text.get(..at), 1 << 20),
        Some((at, 'G' | 'g')) => (text.get(..at), 1 << 30),
        _ => (Some(text), 1),
    };
    let number: Option<u64> = number.and_then(|number| number.parse().ok());
    let bytes = number.and_then(|number| number.checked_mul(factor));
    bytes.ok_or_else(|| "must be a whole number of bytes, or one with K, M or G behind it".to_owned())
}

impl RecordArgs {
    /// What they ask for.
    fn options(&self) -> Result<RecordOptions, Error> {
        let limit = |name: &str, value: Option<u64>, least: u64| match value {
            Some(value) if value < least => {
                Err(Error::Usage(format!("{name} is {value}, must be at least {least} bytes")))
            }
            _ => Ok(()),
        };
        limit("--max-size", self.max_size, SMALLEST_FILE)?;
        limit("--queue", Some(self.queue), SMALLEST_QUEUE)?;
        let at_least = |name: &str, value: Option<Span>, least: f64| match value {
            Some(value) if value.as_s() < least => {
                Err(Error::Usage(format!("{name} is {}, must be at least {least} s", value.as_s())))
            }
            _ => Ok(()),
        };
        at_least("--max-duration", self.max_duration, 0.1)?;
        at_least("--chunk-seconds", Some(self.chunk_seconds), 0.01)?;
        at_least("--timeout", Some(self.timeout), 0.01)?;
        if self.keep.is_some() && self.max_size.is_none() && self.max_duration.is_none() {
            return Err(Error::Usage("--keep needs --max-size or --max-duration".to_owned()));
        }
        let service = if self.no_service {
            ServiceWait::Without
        } else if self.wait {
            ServiceWait::Forever
        } else {
            ServiceWait::Within(time(self.timeout))
        };
        Ok(RecordOptions {
            out: self.out.clone(),
            session: self.session.clone(),
            units: self.unit.iter().map(|serial| unit_id(serial)).collect::<Result<_, _>>()?,
            topics: self.topic.clone(),
            service,
            query_limit: time(self.timeout),
            duration: self.duration.map(time),
            until_service_stops: self.until_service_stops,
            compress: self.compression.compresses(),
            json: !self.no_json_channels,
            bounds: Bounds {
                chunk: time(self.chunk_seconds),
                file_bytes: self.max_size,
                file_time: self.max_duration.map(time),
            },
            keep: self.keep.and_then(|keep| usize::try_from(keep).ok()),
            overwrite: self.overwrite,
            queue_bytes: self.queue,
        })
    }
}

/// A span that is not negative as a duration.
fn time(span: Span) -> Duration {
    Duration::from_nanos(u64::try_from(span.as_ns()).unwrap_or(0))
}

/// Runs the command.
pub(super) fn run(args: &RecordArgs) -> Result<Exit, Error> {
    let options = args.options()?;
    let runtime = tokio::runtime::Runtime::new().map_err(|source| Error::Runtime { source })?;
    let mut live = Live::new();
    let recorded = runtime.block_on(record(&options, |report| live.show(report)));
    live.finish();
    // A writing thread that somebody in a hurry has left behind does not hold the program up.
    runtime.shutdown_background();
    let report = recorded.map_err(|error| table::advise(error, &options))?;
    live.warn(&report);
    if let Some(failure) = &report.failure {
        show::warn(&format!("recording has stopped: {failure}; everything up to there is in the file"));
    }
    if report.lost > 0 {
        show::warn(&format!("{} of {} messages are lost", report.lost, report.received));
    }
    if !report.units_without_memory.is_empty() {
        let units = report.units_without_memory.join(", ");
        show::warn(&format!(
            "nothing says what was known of {units} before: not to be corrected again to the bit"
        ));
    }
    if args.topic.is_empty() && !report.units_without_raw.is_empty() {
        let units = report.units_without_raw.join(", ");
        show::warn(&format!(
            "nothing raw has come of {units}: producers do not reach this recorder; give one --connect, to the service or to \
             a router, and no --listen"
        ));
    }
    print(if args.json { show::json(&report) } else { human(&report) }.as_bytes())?;
    Ok(Exit::of_loss(report.lost_data()))
}
