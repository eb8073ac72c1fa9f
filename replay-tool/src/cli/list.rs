//! `isotherm-replay list`.

use std::collections::BTreeMap;

use clap::Args;
use isotherm_cli::{Bar, Exit, print};
use serde::Serialize;
use zenoh::key_expr::OwnedKeyExpr;

use super::play::key_expression;
use super::{LogArgs, show};
use crate::error::Error;
use crate::play::wanted;

/// List the topics of a log: messages, bytes, times
#[derive(Debug, Args)]
#[command(after_help = "Example, in two steps:\n  \
    isotherm-replay simulate --preset mems-chamber --duration 60 --out mems.csv\n  \
    isotherm-replay list mems.csv\n\n\
    Times are seconds from the log's first message. For contents use `isotherm-replay info` and `isotherm-replay cat`.")]
pub(super) struct ListArgs {
    #[command(flatten)]
    log: LogArgs,
    /// Only these keys, e.g. 'imu/*/raw/gyro'; repeatable
    #[arg(long, value_name = "KEY", value_parser = key_expression)]
    topic: Vec<OwnedKeyExpr>,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

/// What there is of a topic.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
struct Listed {
    messages: u64,
    bytes: u64,
    first_s: f64,
    last_s: f64,
}

/// Runs the command.
pub(super) fn run(args: &ListArgs) -> Result<Exit, Error> {
    let mut messages = args.log.messages()?;
    let mut bar = Bar::over_log(messages.progress().watch());
    let mut topics = BTreeMap::<String, Listed>::new();
    let mut begin_ns = None;
    while let Some(message) = messages.next_message()? {
        let begin_ns = *begin_ns.get_or_insert(message.received_ns);
        if !wanted(&args.topic, &message.topic) {
            continue;
        }
        let at_s = seconds_between(begin_ns, message.received_ns);
        let listed = topics
            .entry(message.topic.key())
            .or_insert_with(|| Listed { first_s: at_s, ..Listed::default() });
        listed.messages += 1;
        listed.bytes += message.frame.len() as u64;
        listed.last_s = at_s;
        bar.step_saying(|| Some(format!("{} topics", topics.len())));
    }
    bar.finish();
    let report = messages.report();
    let text = if args.json {
        show::json(&serde_json::json!({ "topics": topics, "log": report }))
    } else {
        human(&topics)
    };
    Ok(print(&text, Exit::of_loss(report.lost_data())))
}

/// The distance of two moments (s), negative where the second is the earlier.
#[expect(clippy::cast_precision_loss, reason = "shown to the millisecond")]
fn seconds_between(from_ns: u64, to_ns: u64) -> f64 {
    (i128::from(to_ns) - i128::from(from_ns)) as f64 / 1e9
}

fn human(topics: &BTreeMap<String, Listed>) -> String {
    let row = |(key, listed): (&String, &Listed)| {
        let Listed { messages, bytes, first_s, last_s } = listed;
        [
            key.clone(),
            messages.to_string(),
            bytes.to_string(),
            format!("{first_s:.3}"),
            format!("{last_s:.3}"),
        ]
    };
    show::grid(["topic", "messages", "bytes", "first s", "last s"], topics.iter().map(row), 1..)
}
