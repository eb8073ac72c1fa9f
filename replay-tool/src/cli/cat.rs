//! `isotherm-replay cat`.

use std::io::{self, BufWriter, Write};

use clap::Args;
use isotherm_cli::Exit;
use isotherm_log::message::{Message, Topic};
use isotherm_protocol::codec::{self, CodecError};
use isotherm_protocol::corrected::CorrectedBatch;
use isotherm_protocol::journal::JournalPart;
use isotherm_protocol::key::RawStream;
use isotherm_protocol::raw::{AccelBatch, GyroBatch, HealthBatch, TemperatureBatch};
use isotherm_protocol::reference::Reference;
use isotherm_protocol::service_status::ServiceStatus;
use isotherm_protocol::status::Status;
use serde_json::{Value, json};
use zenoh::key_expr::OwnedKeyExpr;

use super::play::key_expression;
use super::{LogArgs, put, show};
use crate::error::Error;
use crate::play::wanted;

/// Print the messages of a log as JSON, one per line
#[derive(Debug, Args)]
#[command(after_help = "Example, in two steps:\n  \
    isotherm-replay simulate --preset mems-chamber --duration 60 --out mems.csv\n  \
    isotherm-replay cat mems.csv --topic 'imu/*/raw/temp' --limit 2\n\n\
    Each line has `topic`, `received_ns` and `message`: the fields of docs/wire.md, most without the unit in their\n\
    names (`end_time` for `end_time_ns`); or `error`, if a frame cannot be read (exit code 3).")]
pub(super) struct CatArgs {
    #[command(flatten)]
    log: LogArgs,
    /// Only these keys, e.g. 'imu/*/raw/gyro'; repeatable
    #[arg(long, value_name = "KEY", value_parser = key_expression)]
    topic: Vec<OwnedKeyExpr>,
    /// Stop after N messages
    #[arg(long, value_name = "N")]
    limit: Option<u64>,
}

/// Runs the command.
pub(super) fn run(args: &CatArgs) -> Result<Exit, Error> {
    let mut messages = args.log.messages()?;
    let mut out = BufWriter::new(io::stdout().lock());
    let (mut printed, mut unread) = (0, false);
    while args.limit.is_none_or(|limit| printed < limit)
        && let Some(message) = messages.next_message()?
    {
        if !wanted(&args.topic, &message.topic) {
            continue;
        }
        let mut line = json!({ "topic": message.topic.key(), "received_ns": message.received_ns });
        match decoded(&message) {
            Ok(value) => line["message"] = value,
            Err(error) => {
                unread = true;
                line["error"] = error.to_string().into();
            }
        }
        printed += 1;
        put(&mut out, &show::json(&line))?;
    }
    out.flush().map_err(Error::Stdout)?;
    let lost = messages.report().lost_data();
    if printed == 0 && args.limit != Some(0) && !lost {
        return Err(Error::Nothing("printed", "message"));
    }
    Ok(Exit::of_loss(unread || lost))
}

/// What a message says; of a key that is none of the protocol's, its length.
fn decoded(message: &Message) -> Result<Value, CodecError> {
    fn of<T: codec::Message + serde::Serialize>(frame: &[u8]) -> Result<Value, CodecError> {
        // Plain structures of numbers and texts, which always serialise; what is no number becomes null.
        Ok(serde_json::to_value(codec::decode::<T>(frame)?).unwrap_or_default())
    }
    let frame = &message.frame;
    match &message.topic {
        Topic::Raw(_, RawStream::Gyro) => codec::decode(frame)
            .map(|GyroBatch { output, ticks }| json!({ "output": output, "ticks": ticks })),
        Topic::Raw(_, RawStream::Accel) => codec::decode(frame)
            .map(|AccelBatch { output, ticks }| json!({ "output": output, "ticks": ticks })),
        Topic::Raw(_, RawStream::Temperature) => {
            codec::decode::<TemperatureBatch>(frame).map(|batch| json!({ "readings": batch.readings }))
        }
        Topic::Raw(_, RawStream::Health) => of::<HealthBatch>(frame),
        Topic::Reference(_) => of::<Reference>(frame),
        Topic::Corrected(_) => of::<CorrectedBatch>(frame),
        Topic::Status(_) => of::<Status>(frame),
        Topic::Journal(_) => of::<JournalPart>(frame),
        Topic::Service(_) => of::<ServiceStatus>(frame),
        Topic::Other(_) => Ok(json!({ "bytes": frame.len() })),
    }
}
